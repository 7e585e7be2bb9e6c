//! Rows of a CSV file: comma, semicolon or tab between fields, `#` before comments, columns by name in any order.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

use csv::{ReaderBuilder, StringRecord, Trim};

use super::error::ImportError;
use super::rows::{Cell, Layout, Row, Stated};

/// An open table.
pub struct CsvTable {
    path: PathBuf,
    reader: csv::Reader<File>,
    record: StringRecord,
    layout: Layout,
}

impl CsvTable {
    /// Opens a table and reads its names.
    ///
    /// # Errors
    /// [`ImportError`] when it cannot be read or lacks a column.
    pub fn open(path: &Path, stated: Stated) -> Result<Self, ImportError> {
        let unreadable = |source| ImportError::Open { path: path.into(), source };
        let file = File::open(path).map_err(unreadable)?;
        let delimiter = delimiter(path).map_err(unreadable)?;
        let mut reader =
            ReaderBuilder::new().delimiter(delimiter).comment(Some(b'#')).trim(Trim::All).from_reader(file);
        let names = reader.headers().map_err(|source| ImportError::Csv { path: path.into(), source })?;
        let names: Vec<String> = names.iter().map(str::to_owned).collect();
        let layout = Layout::of(path, &names, stated)?;
        Ok(Self { path: path.into(), reader, record: StringRecord::new(), layout })
    }

    /// Columns that mean nothing here.
    pub fn ignored(&self) -> &[String] {
        &self.layout.ignored
    }

    /// The next row.
    ///
    /// # Errors
    /// [`ImportError`] names the line.
    pub fn next(&mut self) -> Result<Option<Row>, ImportError> {
        let more = self
            .reader
            .read_record(&mut self.record)
            .map_err(|source| ImportError::Csv { path: self.path.clone(), source })?;
        if !more {
            return Ok(None);
        }
        let line = self.record.position().map_or(0, csv::Position::line);
        let record = &self.record;
        let cell = |place: usize| match record.get(place) {
            None | Some("") => Cell::Empty,
            Some(text) => Cell::Text(text),
        };
        self.layout.row(line, cell).map(Some)
    }
}

/// What stands between the names of the columns.
fn delimiter(path: &Path) -> std::io::Result<u8> {
    /// Longest line of names that is looked at.
    const LONGEST: usize = 1 << 16;
    let mut reader = BufReader::with_capacity(LONGEST, File::open(path)?);
    let head = reader.fill_buf()?;
    let names = head.split(|byte| *byte == b'\n').find(|line| !line.starts_with(b"#") && !line.is_empty());
    let names = names.unwrap_or_default();
    let count = |byte: u8| names.iter().filter(|one| **one == byte).count();
    // Of equals the last wins, so the comma stands last.
    Ok([b';', b'\t', b','].into_iter().max_by_key(|byte| count(*byte)).unwrap_or(b','))
}
