//! A table as a Parquet file: one row group, plain columns, zstd.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::error::OutputError;
use super::table::{Column, Table, Values};

/// Writes the table.
///
/// # Errors
/// [`OutputError`] names the file and what refused.
pub fn write(table: &Table, path: &Path) -> Result<(), OutputError> {
    let file =
        File::create(path).map_err(|source| OutputError::Write { option: "--parquet", path: path.into(), source })?;
    write_to(table, file).map_err(|source| OutputError::Parquet { path: path.into(), source })
}

fn field(column: &Column) -> Result<Arc<Type>, ParquetError> {
    let builder = match &column.values {
        Values::Numbers(_) => Type::primitive_type_builder(&column.name, Physical::DOUBLE),
        Values::Texts(_) => Type::primitive_type_builder(&column.name, Physical::BYTE_ARRAY)
            .with_logical_type(Some(LogicalType::String)),
    };
    Ok(Arc::new(builder.with_repetition(Repetition::REQUIRED).build()?))
}

fn write_to(table: &Table, file: File) -> Result<(), ParquetError> {
    let fields = table.columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("table").with_fields(fields).build()?);
    let properties = WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::default())).build();
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties))?;
    let mut rows = writer.next_row_group()?;
    for column in &table.columns {
        // As many columns as fields: the schema was made of them.
        let Some(mut out) = rows.next_column()? else { break };
        match &column.values {
            Values::Numbers(values) => {
                out.typed::<DoubleType>().write_batch(values, None, None)?;
            }
            Values::Texts(values) => {
                let texts: Vec<ByteArray> = values.iter().map(|text| ByteArray::from(text.as_str())).collect();
                out.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
            }
        }
        out.close()?;
    }
    rows.close()?;
    writer.close()?;
    Ok(())
}
