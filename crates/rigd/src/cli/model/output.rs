//! Where a result goes: a text for people, or one machine-readable form on stdout, and files beside.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::error::OutputError;
use super::table::Table;
use crate::chart::{Chart, Format};
use crate::cli::print;

/// Where a result goes.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Output {
    /// Write the table as CSV (`-` is stdout)
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the table as Parquet (builds with the feature `parquet`)
    #[arg(long, value_name = "FILE")]
    parquet: Option<PathBuf>,
    /// Draw a picture: .svg, .png, or .html with the values under the pointer (`-` is SVG on stdout)
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

/// A result in every form.
#[derive(Debug, Default)]
pub struct Report {
    /// For people.
    pub text: String,
    /// For scripts, without the table.
    pub json: Value,
    /// The numbers.
    pub table: Table,
    /// The picture.
    pub chart: Chart,
}

/// A file made by a command itself, beside those that every command makes.
#[derive(Debug)]
pub struct Extra {
    /// The option that asked for it.
    pub option: &'static str,
    /// Where it goes.
    pub path: PathBuf,
    /// What is in it.
    pub content: Vec<u8>,
}

fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

impl Output {
    /// Refuses what cannot be delivered, before anything is computed. `own` are the command's own files by option.
    ///
    /// # Errors
    /// [`OutputError`] names the option and the way out.
    pub fn check(&self, own: &[(&'static str, Option<&Path>)]) -> Result<(), OutputError> {
        if let Some(path) = &self.plot {
            Format::of(path).map_err(|source| OutputError::Chart { path: path.clone(), source })?;
        }
        if let Some(path) = &self.parquet {
            if !cfg!(feature = "parquet") {
                return Err(OutputError::NoParquet { path: path.clone() });
            }
            if is_stdout(path) {
                return Err(OutputError::ParquetOnStdout);
            }
        }
        let mut taken = self.json.then_some("--json");
        let common = [("--csv", self.csv.as_deref()), ("--plot", self.plot.as_deref())];
        for (option, path) in common.iter().chain(own) {
            if path.is_some_and(is_stdout) {
                if let Some(first) = taken {
                    return Err(OutputError::TwoOnStdout { first, second: option });
                }
                taken = Some(option);
            }
        }
        Ok(())
    }

    /// Writes a report, and `extras`, where they belong.
    ///
    /// # Errors
    /// [`OutputError`] when a file cannot be written.
    pub fn deliver(&self, report: Report, extras: &[Extra]) -> Result<(), OutputError> {
        let mut quiet = self.json;
        for extra in extras {
            quiet |= is_stdout(&extra.path);
            write(extra.option, &extra.path, &extra.content)?;
        }
        if let Some(path) = &self.csv {
            quiet |= is_stdout(path);
            let mut text = Vec::new();
            report.table.write_csv(&mut text).map_err(|source| OutputError::Csv {
                option: "--csv",
                path: path.clone(),
                source,
            })?;
            write("--csv", path, &text)?;
        }
        #[cfg(feature = "parquet")]
        if let Some(path) = &self.parquet {
            super::parquet::write(&report.table, path)?;
        }
        if let Some(path) = &self.plot {
            quiet |= is_stdout(path);
            let picture = Format::of(path)
                .and_then(|format| report.chart.encode(format))
                .map_err(|source| OutputError::Chart { path: path.clone(), source })?;
            write("--plot", path, &picture)?;
        }
        if self.json {
            let mut object = report.json;
            if let Value::Object(fields) = &mut object {
                fields.insert("table".into(), report.table.to_json());
            }
            print(&object.to_string());
        } else if !quiet {
            print(report.text.trim_end());
        }
        Ok(())
    }
}

fn write(option: &'static str, path: &Path, content: &[u8]) -> Result<(), OutputError> {
    if is_stdout(path) {
        // A reader that closed the pipe is not an error.
        let _ = std::io::stdout().write_all(content);
        return Ok(());
    }
    std::fs::write(path, content).map_err(|source| OutputError::Write { option, path: path.into(), source })
}
