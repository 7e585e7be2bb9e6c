//! What an effect reports: its parameters in the contract's names and units.

use crate::stated::Stated;

/// A parameter as found: a number or, for tooth tables, one a tooth.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// One number a tooth.
    Table(Vec<f64>),
    /// A word, as a flank's name.
    Text(&'static str),
}

/// A parameter with its name and unit as in the contract of the log and the Python package.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name, unit included.
    pub name: &'static str,
    /// What was found.
    pub value: Value,
    /// Standard deviation; `None` for tables, words and grid values.
    pub std: Option<f64>,
    /// Unit as text; empty for a pure number.
    pub unit: &'static str,
}

impl Parameter {
    /// A number with its standard deviation.
    #[must_use]
    pub fn number(name: &'static str, value: f64, std: f64, unit: &'static str) -> Self {
        Self { name, value: Value::Number(value), std: Some(std), unit }
    }

    /// A value that the search found on its grid.
    #[must_use]
    pub fn grid(name: &'static str, value: f64, unit: &'static str) -> Self {
        Self { name, value: Value::Number(value), std: None, unit }
    }
}

impl From<Value> for Stated {
    fn from(value: Value) -> Self {
        match value {
            Value::Number(number) => Self::Number(number),
            Value::Table(table) => Self::Table(table),
            Value::Text(text) => Self::Text(text.to_owned()),
        }
    }
}
