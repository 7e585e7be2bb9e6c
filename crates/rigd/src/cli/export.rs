//! `rigd export`: the samples of a log as a table, with units in the names of its columns. `rigd import` reads it back.
//!
//! A sample that was lost is a row without angles: nothing is interpolated, and nothing that follows moves up.

mod csv_file;
mod npy_file;
#[cfg(feature = "parquet")]
mod parquet_file;
mod row;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use gearmodel::NominalModel;
use riglog::{LogError, RunSpan, RunStream, RunVisitor, SampleBlock};
use serde_json::json;
use thiserror::Error;

use super::{Exit, fail, print};
use riglog::pair;
use row::{Row, Table};

/// Write the samples of a log as a table
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The log; of one that was split, any part
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// The table's format
    #[arg(long, value_enum)]
    to: Format,
    /// The table [default: the log's name with the format's ending]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    Csv,
    Parquet,
    Npy,
}

impl Format {
    fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Npy => "npy",
        }
    }
}

/// Why a log does not become a table.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The table is there already.
    #[error("{} exists already; name another one with --out, or move it away", path.display())]
    Exists {
        /// The table.
        path: PathBuf,
    },
    /// The table cannot be written.
    #[error("cannot write {}: {source}; free space, or name another place with --out", path.display())]
    Write {
        /// The table.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The Parquet writer refused.
    #[cfg(feature = "parquet")]
    #[error("cannot write {}: {source}; free space, or name another place with --out", path.display())]
    Parquet {
        /// The table.
        path: PathBuf,
        /// Its reason.
        source: parquet::errors::ParquetError,
    },
    /// This build has no Parquet.
    #[cfg(not(feature = "parquet"))]
    #[error(
        "this build of rigd cannot write Parquet; build it with `cargo build --release -p rigd --features parquet`, or use --to csv or npy"
    )]
    NoParquet,
    /// More samples are missing than a table can show.
    #[error(
        "{missing} samples are missing before sample {sample}, more than the {limit} rows that a gap may have; audit the log with `rigd audit`"
    )]
    Gap {
        /// How many.
        missing: u64,
        /// The sample behind the gap.
        sample: u64,
        /// The most.
        limit: u64,
    },
}

/// A gap of an hour at 18 kHz; beyond that the numbers are not to be believed.
const LONGEST_GAP: u64 = 65_000_000;

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    match run(args) {
        Ok(exit) => exit,
        Err(error @ (ExportError::Write { .. } | ExportError::Gap { .. })) => fail(Exit::Failed, &error),
        Err(error) => fail(Exit::BadInput, &error),
    }
}

fn run(args: &Args) -> Result<Exit, ExportError> {
    let stream = RunStream::open(&args.log)?;
    let model = model(&stream);
    let path = args.out.clone().unwrap_or_else(|| args.log.with_extension(args.to.extension()));
    if path.exists() {
        return Err(ExportError::Exists { path });
    }
    let table = create(args.to, &path, model.is_some())?;
    let mut exporter = Exporter {
        table,
        model: model.as_ref(),
        origin_ns: stream.start_ns().unwrap_or(0),
        run: None,
        previous: None,
        missing: 0,
        rows: 0,
        lost: 0,
        error: None,
    };
    let totals = stream.stream(&mut exporter)?;
    let written = match exporter.error.take() {
        Some(error) => Err(error),
        None => exporter.table.finish(),
    };
    if let Err(error) = written {
        // Half a table would pass for a whole one.
        let _ = std::fs::remove_file(&path);
        return Err(error);
    }
    let complete = totals.completeness.is_complete() && totals.losses() == 0;
    if args.json {
        let told = json!({
            "schema": "rigd.export/1",
            "log": args.log.display().to_string(),
            "table": path.display().to_string(),
            "columns": row::columns(model.is_some()),
            "runs": totals.runs.len(),
            "rows": exporter.rows,
            "losses": exporter.lost,
            "complete": complete,
        });
        print(&told.to_string());
    } else {
        print(&format!(
            "{}: {} rows of {} runs, {} of them lost samples",
            path.display(),
            exporter.rows,
            totals.runs.len(),
            exporter.lost
        ));
    }
    if !totals.completeness.is_complete() {
        eprintln!("warning: {}: {}", args.log.display(), totals.completeness);
    }
    if totals.runs.is_empty() {
        eprintln!("warning: {}: no recorded run; the table has no rows", args.log.display());
    }
    Ok(if complete && !totals.runs.is_empty() { Exit::Done } else { Exit::Incomplete })
}

/// The model of the log's own pair; without one there is no TE to write.
fn model(stream: &RunStream) -> Option<NominalModel> {
    let text = String::from_utf8_lossy(stream.attachment("pair.toml")?).into_owned();
    pair::parse(&text, Path::new("pair.toml")).ok()
}

fn create(format: Format, path: &Path, with_te: bool) -> Result<Box<dyn Table>, ExportError> {
    Ok(match format {
        Format::Csv => Box::new(csv_file::CsvFile::create(path, with_te)?),
        Format::Npy => Box::new(npy_file::NpyFile::create(path, with_te)?),
        #[cfg(feature = "parquet")]
        Format::Parquet => Box::new(parquet_file::ParquetFile::create(path, with_te)?),
        #[cfg(not(feature = "parquet"))]
        Format::Parquet => return Err(ExportError::NoParquet),
    })
}

struct Exporter<'a> {
    table: Box<dyn Table>,
    model: Option<&'a NominalModel>,
    origin_ns: u64,
    run: Option<(usize, RunSpan)>,
    /// Time and number of the sample before, within the run.
    previous: Option<(u64, u64)>,
    /// Samples lost since.
    missing: u64,
    rows: u64,
    lost: u64,
    error: Option<ExportError>,
}

impl Exporter<'_> {
    fn block(&mut self, index: usize, block: &SampleBlock<'_>) -> Result<(), ExportError> {
        let Some((_, span)) = self.run else { return Ok(()) };
        let origin_ns = self.origin_ns;
        let row = |time_ns: u64, sample: u64| Row {
            run: index as u32 + 1,
            sample,
            time_ns,
            since_start_ns: time_ns.saturating_sub(origin_ns),
            direction: span.direction,
            load_nm: span.load_nm,
            speed_rpm: span.speed_rpm,
            reading: None,
        };
        if let ([first_ns, ..], missing @ 1..) = (block.time_ns, self.missing) {
            self.missing = 0;
            if missing > LONGEST_GAP {
                return Err(ExportError::Gap { missing, sample: block.first_sample, limit: LONGEST_GAP });
            }
            if let Some((before_ns, number)) = self.previous {
                let step_ns = first_ns.saturating_sub(before_ns) / (missing + 1);
                for lost in 1..=missing {
                    self.table.push(&row(before_ns + lost * step_ns, number + lost))?;
                }
                self.rows += missing;
                self.lost += missing;
            }
        }
        for n in 0..block.time_ns.len() {
            let (theta1_rad, theta2_rad) = (block.theta1_rad[n], block.theta2_rad[n]);
            let reading = row::Reading {
                theta1_rad,
                theta2_rad,
                // TE = θ2 − f(θ1), as live and on replay; no zero is subtracted.
                te_rad: self.model.map(|model| theta2_rad - model.pair.theta2(theta1_rad)),
                input_counts: block.input_counts[n],
                output_counts: block.output_counts[n],
            };
            let number = block.first_sample + n as u64;
            self.table.push(&Row { reading: Some(reading), ..row(block.time_ns[n], number) })?;
            self.previous = Some((block.time_ns[n], number));
        }
        self.rows += block.time_ns.len() as u64;
        Ok(())
    }
}

impl RunVisitor for Exporter<'_> {
    fn run_start(&mut self, index: usize, span: &RunSpan) -> ControlFlow<()> {
        self.run = Some((index, *span));
        (self.previous, self.missing) = (None, 0);
        ControlFlow::Continue(())
    }

    fn gap(&mut self, _: usize, missing: u64) -> ControlFlow<()> {
        self.missing = self.missing.saturating_add(missing);
        ControlFlow::Continue(())
    }

    fn samples(&mut self, index: usize, block: &SampleBlock<'_>) -> ControlFlow<()> {
        match self.block(index, block) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.error = Some(error);
                ControlFlow::Break(())
            }
        }
    }
}
