//! `rigd import`: a table of angles becomes a rig log that everything else here can read.

mod csv_table;
mod error;
mod log;
#[cfg(feature = "parquet")]
mod parquet_table;
mod rows;

use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};

use gearmodel::Direction;
use gearmodel::measure::AngleGrid;
use riglog::{LogError, LogWriter, RunMetadata, WriterOptions};
use serde::Serialize;

use super::{Exit, fail, print};
use crate::analysis::Analysis;
use crate::present::{angle, arcsec};
use crate::quantity::{SPEED, TORQUE};
use crate::summary::{Origin, Summary};
use csv_table::CsvTable;
use error::ImportError;
use log::{Imported, Importer, encoders};
use riglog::pair;
use rows::{Row, Stated};

/// Make a log from a table of angles.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The table, .csv or .parquet, with the columns time_s, theta1_rad, theta2_rad, load_nm, speed_rpm, direction
    #[arg(value_name = "TABLE")]
    table: PathBuf,
    /// The gear pair that was measured
    #[arg(long, value_name = "FILE")]
    pair: PathBuf,
    /// The log [default: the table's name with .mcap]
    #[arg(long, value_name = "LOG")]
    out: Option<PathBuf>,
    /// Load of all rows, as `10Nm`, in place of the column
    #[arg(long)]
    load: Option<String>,
    /// Speed of the driver of all rows, as `5`, in place of the column
    #[arg(long)]
    rpm: Option<String>,
    /// Sense of all rows, in place of the column
    #[arg(long, value_name = "ccw|cw")]
    direction: Option<Direction>,
    /// Resolution of the log: angles are rounded to 2π over this; a number or a power, as 2^26
    #[arg(long, default_value = "2^26", value_name = "N", value_parser = counts)]
    counts_per_rev: u64,
    /// For the log
    #[arg(long, default_value = "")]
    operator: String,
    /// For the log
    #[arg(long, default_value = "")]
    note: String,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

/// Coarsest and finest resolution: below, TE drowns in it; above, turns no longer fit.
const COUNTS: std::ops::RangeInclusive<u64> = 1 << 10..=1 << 40;

fn counts(text: &str) -> Result<u64, String> {
    let value = match text.split_once('^') {
        Some((base, power)) => base.parse::<u64>().ok().zip(power.parse().ok()).and_then(|(b, p)| b.checked_pow(p)),
        None => text.parse().ok(),
    };
    value
        .filter(|value| COUNTS.contains(value))
        .ok_or_else(|| format!("'{text}' is no resolution; write a number of 2^10 to 2^40, for instance 2^26"))
}

enum Table {
    Csv(Box<CsvTable>),
    #[cfg(feature = "parquet")]
    Parquet(Box<parquet_table::ParquetTable>),
}

impl Table {
    fn open(path: &Path, stated: Stated) -> Result<Self, ImportError> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("csv" | "tsv" | "txt") => Ok(Self::Csv(Box::new(CsvTable::open(path, stated)?))),
            #[cfg(feature = "parquet")]
            Some("parquet" | "pq") => Ok(Self::Parquet(Box::new(parquet_table::ParquetTable::open(path, stated)?))),
            #[cfg(not(feature = "parquet"))]
            Some("parquet" | "pq") => Err(ImportError::NoParquet { path: path.into() }),
            _ => Err(ImportError::Format { path: path.into() }),
        }
    }

    fn next(&mut self) -> Result<Option<Row>, ImportError> {
        match self {
            Self::Csv(table) => table.next(),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.next(),
        }
    }

    fn ignored(&self) -> &[String] {
        match self {
            Self::Csv(table) => table.ignored(),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.ignored(),
        }
    }
}

/// `rigd.import/1`: the summary of the log and what rounding did to it.
#[derive(Debug, Serialize)]
struct Outcome {
    #[serde(flatten)]
    summary: Summary,
    /// The table.
    table: String,
    /// What rounding did.
    quantisation: Quantisation,
}

/// What rounding angles to counts did.
#[derive(Debug, Serialize)]
struct Quantisation {
    /// Resolution.
    counts_per_rev: u64,
    /// Half a count: no angle moved further.
    angle_bound_rad: f64,
    /// Largest move of an angle.
    angle_largest_rad: f64,
    /// Half a count of either shaft, the driver's times the largest ratio: no TE moved further.
    te_bound_rad: f64,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    match run(args) {
        Ok(exit) => exit,
        // Refused before anything was written.
        Err(error @ ImportError::Log(LogError::Exists { .. } | LogError::Locked { .. })) => {
            fail(Exit::BadInput, &error)
        }
        Err(error @ (ImportError::Log(_) | ImportError::Rename { .. })) => fail(Exit::Failed, &error),
        Err(error) => fail(Exit::BadInput, &error),
    }
}

fn run(args: &Args) -> Result<Exit, ImportError> {
    let stated = Stated {
        direction: args.direction,
        load_nm: args.load.as_deref().map(|text| TORQUE.parse(text)).transpose()?,
        speed_rpm: args.rpm.as_deref().map(|text| SPEED.parse(text)).transpose()?,
    };
    let (pair_toml, model) = pair::load(Some(&args.pair))?;
    let mut table = Table::open(&args.table, stated)?;
    let log = args.out.clone().unwrap_or_else(|| args.table.with_extension("mcap"));
    if log.exists() {
        return Err(LogError::Exists { path: log }.into());
    }
    // Under a name of its own until it is whole: a table that is refused halfway leaves nothing.
    let part = log.with_extension("mcap.part");
    let analysis = Analysis::new(model);
    let imported = fill(args, &mut table, &part, analysis, &pair_toml).inspect_err(|error| {
        if !matches!(error, ImportError::Log(LogError::Exists { .. } | LogError::Locked { .. })) {
            // What cannot be removed is an unfinished log that says so itself.
            let _ = fs::remove_file(&part);
        }
    })?;
    fs::rename(&part, &log).map_err(|source| ImportError::Rename { path: log.clone(), part, source })?;

    let Imported { analysis, lost, largest_rounding_rad, mut warnings } = imported;
    if !table.ignored().is_empty() {
        warnings.push(format!("{}: ignored columns: {}", args.table.display(), table.ignored().join(", ")));
    }
    if lost > 0 {
        warnings.push(format!("{}: {lost} rows have no angle and count as lost samples", args.table.display()));
    }
    let half_rad = 0.5 * TAU / args.counts_per_rev as f64;
    let pair = &analysis.model().pair;
    let steepest = AngleGrid::default().centres().map(|theta| pair.ratio(theta)).fold(0.0, f64::max);
    let quantisation = Quantisation {
        counts_per_rev: args.counts_per_rev,
        angle_bound_rad: half_rad,
        angle_largest_rad: largest_rounding_rad,
        te_bound_rad: half_rad * (1.0 + steepest),
    };
    let origin = Origin {
        schema: "rigd.import/1",
        log: vec![log.display().to_string()],
        backend: BACKEND.into(),
        losses: lost,
        ended: "done".into(),
        warnings: warnings.clone(),
    };
    let summary = Summary::of(&analysis, origin);
    let outcome = Outcome { summary, table: args.table.display().to_string(), quantisation };
    if args.json {
        // A summary is plain data: it always becomes JSON.
        print(&serde_json::to_string_pretty(&outcome).unwrap_or_default());
    } else {
        print(outcome.summary.text().trim_start_matches('\n').trim_end());
        print(&format!(
            "rounding to {} counts a revolution moved angles by {:.2e} rad at most, TE by {} at most ({:.4}\")",
            args.counts_per_rev,
            largest_rounding_rad,
            angle(outcome.quantisation.te_bound_rad),
            arcsec(outcome.quantisation.te_bound_rad)
        ));
    }
    for warning in &warnings {
        eprintln!("warning: {warning}");
    }
    Ok(if lost == 0 { Exit::Done } else { Exit::Incomplete })
}

/// The backend that an imported log names.
const BACKEND: &str = "import";
/// This program, as logs name it.
const SOFTWARE: &str = concat!("rigd ", env!("CARGO_PKG_VERSION"));

fn fill(
    args: &Args,
    table: &mut Table,
    part: &Path,
    analysis: Analysis,
    pair_toml: &str,
) -> Result<Imported, ImportError> {
    let mut writer = LogWriter::create(part, WriterOptions::new(SOFTWARE))?;
    writer.attach(0, "pair.toml", "application/toml", pair_toml.as_bytes())?;
    writer.encoders(&encoders(args.counts_per_rev))?;
    let mut importer = Importer::new(&args.table, writer, analysis, args.counts_per_rev);
    while let Some(row) = table.next()? {
        importer.push(&row)?;
    }
    let name = args.table.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let made = format!("imported from {name}; angles rounded to 2 pi / {} rad", args.counts_per_rev);
    importer.finish(RunMetadata {
        run_id: uuid::Uuid::new_v4().to_string(),
        started: jiff::Timestamp::now().to_string(),
        software: SOFTWARE.into(),
        host: nix::unistd::gethostname().ok().and_then(|name| name.into_string().ok()).unwrap_or_default(),
        backend: BACKEND.into(),
        operator: args.operator.clone(),
        note: if args.note.is_empty() { made } else { format!("{}; {made}", args.note) },
        ..RunMetadata::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolutions_are_numbers_or_powers() {
        assert_eq!(counts("2^26"), Ok(1 << 26));
        assert_eq!(counts("360000"), Ok(360_000));
        for wrong in ["0", "2^9", "2^41", "many", "2^", "-5"] {
            assert!(counts(wrong).unwrap_err().contains("2^26"), "{wrong}");
        }
    }
}
