//! Columns with names: what goes out as CSV, Parquet and JSON.

use std::io::Write;

use serde_json::{Map, Value, json};

/// A table; all columns are equally long.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// The columns, from the left.
    pub columns: Vec<Column>,
}

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Quantity and unit (`te_ccw_rad`).
    pub name: String,
    /// What stands in it.
    pub values: Values,
}

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers; what is not finite is an empty field.
    Numbers(Vec<f64>),
    /// Names.
    Texts(Vec<String>),
}

impl Column {
    /// A column of numbers.
    #[must_use]
    pub fn numbers(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), values: Values::Numbers(values) }
    }

    /// A column of names.
    #[must_use]
    pub fn texts(name: impl Into<String>, values: Vec<String>) -> Self {
        Self { name: name.into(), values: Values::Texts(values) }
    }

    fn field(&self, row: usize) -> String {
        match &self.values {
            // `{}` of an f64 reads back to the same bits.
            Values::Numbers(values) => {
                values.get(row).filter(|value| value.is_finite()).map_or_else(String::new, f64::to_string)
            }
            Values::Texts(values) => values.get(row).cloned().unwrap_or_default(),
        }
    }
}

impl Table {
    /// Rows of the longest column.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns
            .iter()
            .map(|column| match &column.values {
                Values::Numbers(values) => values.len(),
                Values::Texts(values) => values.len(),
            })
            .max()
            .unwrap_or(0)
    }

    /// As CSV with a line of names.
    ///
    /// # Errors
    /// [`csv::Error`] when the writer refuses.
    pub fn write_csv(&self, writer: impl Write) -> Result<(), csv::Error> {
        let mut out = csv::Writer::from_writer(writer);
        out.write_record(self.columns.iter().map(|column| &column.name))?;
        for row in 0..self.rows() {
            out.write_record(self.columns.iter().map(|column| column.field(row)))?;
        }
        out.flush()?;
        Ok(())
    }

    /// As an object of columns; numbers that are not finite are null.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let columns = self.columns.iter().map(|column| {
            let values = match &column.values {
                Values::Numbers(values) => json!(values),
                Values::Texts(values) => json!(values),
            };
            (column.name.clone(), values)
        });
        Value::Object(columns.collect::<Map<_, _>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_read_back_to_the_bit_and_gaps_are_empty() {
        let table = Table {
            columns: vec![
                Column::numbers("a_rad", vec![0.1 + 0.2, f64::NAN, 1e-300]),
                Column::texts("name", vec!["x, y".into(), "z".into(), String::new()]),
            ],
        };
        let mut out = Vec::new();
        table.write_csv(&mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines[0], "a_rad,name");
        assert_eq!(lines[1], "0.30000000000000004,\"x, y\"");
        assert_eq!(lines[2], ",z");
        assert_eq!(lines[3].trim_end_matches(',').parse::<f64>().unwrap(), 1e-300);
        assert_eq!(table.to_json()["a_rad"][1], Value::Null);
    }
}
