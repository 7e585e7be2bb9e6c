//! The table as Parquet, zstd, in row groups of some seconds.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;

use super::ExportError;
use super::row::{Row, Table};

/// Rows of a group.
const GROUP: usize = 1 << 18;

pub struct ParquetFile {
    path: PathBuf,
    writer: Option<SerializedFileWriter<File>>,
    rows: Vec<Row>,
    with_te: bool,
}

impl ParquetFile {
    /// Creates the table.
    pub fn create(path: &Path, with_te: bool) -> Result<Self, ExportError> {
        let te = if with_te { "optional double te_rad;" } else { "" };
        let schema = format!(
            "message rig {{ required double time_s; optional double theta1_rad; optional double theta2_rad; required double load_nm; \
             required double speed_rpm; required binary direction (UTF8); required int32 run; required int64 sample; \
             required int64 time_unix_ns; optional int64 input_counts; optional int64 output_counts; {te} }}"
        );
        let refuse = |source| ExportError::Parquet { path: path.into(), source };
        let schema = Arc::new(parse_message_type(&schema).map_err(refuse)?);
        let level = ZstdLevel::try_new(1).map_err(refuse)?;
        let properties = Arc::new(WriterProperties::builder().set_compression(Compression::ZSTD(level)).build());
        let file = File::create_new(path).map_err(|source| ExportError::Write { path: path.into(), source })?;
        let writer = SerializedFileWriter::new(file, schema, properties).map_err(refuse)?;
        Ok(Self { path: path.into(), writer: Some(writer), rows: Vec::with_capacity(GROUP), with_te })
    }

    fn group(&mut self) -> Result<(), ExportError> {
        let Some(writer) = self.writer.as_mut().filter(|_| !self.rows.is_empty()) else { return Ok(()) };
        let (rows, with_te) = (&self.rows, self.with_te);
        let mut write = || -> Result<(), ParquetError> {
            let mut group = writer.next_row_group()?;
            let all = |of: fn(&Row) -> f64| rows.iter().map(of).collect::<Vec<f64>>();
            column::<DoubleType>(&mut group, &all(|row| row.since_start_ns as f64 * 1e-9), None)?;
            optional::<DoubleType>(&mut group, rows, |row| Some(row.reading?.theta1_rad))?;
            optional::<DoubleType>(&mut group, rows, |row| Some(row.reading?.theta2_rad))?;
            column::<DoubleType>(&mut group, &all(|row| row.load_nm), None)?;
            column::<DoubleType>(&mut group, &all(|row| row.speed_rpm), None)?;
            let senses: Vec<ByteArray> = rows.iter().map(|row| ByteArray::from(row.direction.as_str())).collect();
            column::<ByteArrayType>(&mut group, &senses, None)?;
            let runs: Vec<i32> = rows.iter().map(|row| row.run as i32).collect();
            column::<Int32Type>(&mut group, &runs, None)?;
            let whole = |of: fn(&Row) -> u64| rows.iter().map(|row| of(row) as i64).collect::<Vec<i64>>();
            column::<Int64Type>(&mut group, &whole(|row| row.sample), None)?;
            column::<Int64Type>(&mut group, &whole(|row| row.time_ns), None)?;
            optional::<Int64Type>(&mut group, rows, |row| Some(row.reading?.input_counts))?;
            optional::<Int64Type>(&mut group, rows, |row| Some(row.reading?.output_counts))?;
            if with_te {
                optional::<DoubleType>(&mut group, rows, |row| row.reading?.te_rad)?;
            }
            group.close().map(drop)
        };
        write().map_err(|source| ExportError::Parquet { path: self.path.clone(), source })?;
        self.rows.clear();
        Ok(())
    }
}

/// Writes the next column of the group.
fn column<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, File>,
    values: &[T::T],
    present: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let Some(mut column) = group.next_column()? else {
        return Err(ParquetError::General("the schema has fewer columns than are written".into()));
    };
    column.typed::<T>().write_batch(values, present, None)?;
    column.close()
}

/// Writes the next column, whose values may be missing.
fn optional<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, File>,
    rows: &[Row],
    of: impl Fn(&Row) -> Option<T::T>,
) -> Result<(), ParquetError> {
    let values: Vec<Option<T::T>> = rows.iter().map(of).collect();
    let present: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    let values: Vec<T::T> = values.into_iter().flatten().collect();
    column::<T>(group, &values, Some(&present))
}

impl Table for ParquetFile {
    fn push(&mut self, row: &Row) -> Result<(), ExportError> {
        self.rows.push(*row);
        if self.rows.len() >= GROUP { self.group() } else { Ok(()) }
    }

    fn finish(&mut self) -> Result<(), ExportError> {
        self.group()?;
        let Some(writer) = self.writer.take() else { return Ok(()) };
        writer.close().map(drop).map_err(|source| ExportError::Parquet { path: self.path.clone(), source })
    }
}
