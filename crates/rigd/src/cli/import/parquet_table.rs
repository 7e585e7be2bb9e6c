//! Rows of a Parquet file.

use std::fs::File;
use std::path::{Path, PathBuf};

use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;
use parquet::record::reader::RowIter;

use super::error::ImportError;
use super::rows::{Cell, Layout, Row, Stated};

/// An open table.
pub struct ParquetTable {
    path: PathBuf,
    rows: RowIter<'static>,
    number: u64,
    layout: Layout,
}

impl ParquetTable {
    /// Opens a table and reads its names.
    ///
    /// # Errors
    /// [`ImportError`] when it cannot be read or lacks a column.
    pub fn open(path: &Path, stated: Stated) -> Result<Self, ImportError> {
        let file = File::open(path).map_err(|source| ImportError::Open { path: path.into(), source })?;
        let reader =
            SerializedFileReader::new(file).map_err(|source| ImportError::Parquet { path: path.into(), source })?;
        let schema = reader.metadata().file_metadata().schema();
        let names: Vec<String> = schema.get_fields().iter().map(|field| field.name().to_owned()).collect();
        let layout = Layout::of(path, &names, stated)?;
        Ok(Self { path: path.into(), rows: reader.into_iter(), number: 0, layout })
    }

    /// Columns that mean nothing here.
    pub fn ignored(&self) -> &[String] {
        &self.layout.ignored
    }

    /// The next row.
    ///
    /// # Errors
    /// [`ImportError`] names the row.
    pub fn next(&mut self) -> Result<Option<Row>, ImportError> {
        let Some(row) = self.rows.next() else { return Ok(None) };
        let row = row.map_err(|source| ImportError::Parquet { path: self.path.clone(), source })?;
        self.number += 1;
        let fields: Vec<&Field> = row.get_column_iter().map(|(_, field)| field).collect();
        self.layout.row(self.number, |place| fields.get(place).map_or(Cell::Empty, |field| cell(field))).map(Some)
    }
}

fn cell(field: &Field) -> Cell<'_> {
    match field {
        Field::Double(value) => Cell::Number(*value),
        Field::Float(value) => Cell::Number(f64::from(*value)),
        Field::Byte(value) => Cell::Number(f64::from(*value)),
        Field::Short(value) => Cell::Number(f64::from(*value)),
        Field::Int(value) => Cell::Number(f64::from(*value)),
        // Whole numbers of a set-point stay far below 2⁵³.
        Field::Long(value) => Cell::Number(*value as f64),
        Field::UByte(value) => Cell::Number(f64::from(*value)),
        Field::UShort(value) => Cell::Number(f64::from(*value)),
        Field::UInt(value) => Cell::Number(f64::from(*value)),
        Field::ULong(value) => Cell::Number(*value as f64),
        Field::Str(text) => Cell::Text(text),
        _ => Cell::Empty,
    }
}
