//! The table as CSV: numbers as short as they read back exactly.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use super::ExportError;
use super::row::{Row, Table, columns};

pub struct CsvFile {
    path: PathBuf,
    out: BufWriter<File>,
    with_te: bool,
}

impl CsvFile {
    /// Creates the table and writes its names.
    pub fn create(path: &Path, with_te: bool) -> Result<Self, ExportError> {
        let file = File::create_new(path).map_err(|source| ExportError::Write { path: path.into(), source })?;
        let mut table = Self { path: path.into(), out: BufWriter::with_capacity(1 << 18, file), with_te };
        let names = columns(with_te).join(",");
        table.line(&names)?;
        Ok(table)
    }

    fn line(&mut self, line: &str) -> Result<(), ExportError> {
        let path = &self.path;
        writeln!(self.out, "{line}").map_err(|source| ExportError::Write { path: path.clone(), source })
    }
}

impl Table for CsvFile {
    fn push(&mut self, row: &Row) -> Result<(), ExportError> {
        const NS_PER_S: u64 = 1_000_000_000;
        let (seconds, ns) = (row.since_start_ns / NS_PER_S, row.since_start_ns % NS_PER_S);
        let [theta1, theta2, input, output, te] = match &row.reading {
            Some(reading) => [
                reading.theta1_rad.to_string(),
                reading.theta2_rad.to_string(),
                reading.input_counts.to_string(),
                reading.output_counts.to_string(),
                reading.te_rad.map_or(String::new(), |te| te.to_string()),
            ],
            None => [const { String::new() }; 5],
        };
        let mut line = format!(
            "{seconds}.{ns:09},{theta1},{theta2},{},{},{},{},{},{},{input},{output}",
            row.load_nm, row.speed_rpm, row.direction, row.run, row.sample, row.time_ns
        );
        if self.with_te {
            line.push(',');
            line.push_str(&te);
        }
        self.line(&line)
    }

    fn finish(&mut self) -> Result<(), ExportError> {
        self.out.flush().map_err(|source| ExportError::Write { path: self.path.clone(), source })
    }
}
