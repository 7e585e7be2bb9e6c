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

/// How a parameter came by its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterKind {
    /// An amplitude of the fit, or what follows from amplitudes; a number has a standard deviation.
    Fitted,
    /// An angle of the fit: it has no size of its own, and its standard deviation is one of a turn.
    Phase,
    /// Of the shape that the search found best.
    Searched,
    /// Follows from the other parameters or from what is documented.
    Derived,
}

/// A parameter with its name and unit as in the contract of the log and the Python package.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name, unit included.
    pub name: &'static str,
    /// What was found.
    pub value: Value,
    /// Standard deviation of a fitted number.
    pub std: Option<f64>,
    /// Unit as text; empty for a pure number.
    pub unit: &'static str,
    /// How it came by its value.
    pub kind: ParameterKind,
}

impl Parameter {
    /// A fitted number with its standard deviation.
    #[must_use]
    pub fn number(name: &'static str, value: f64, std: f64, unit: &'static str) -> Self {
        Self { name, value: Value::Number(value), std: Some(std), unit, kind: ParameterKind::Fitted }
    }

    /// A fitted phase, rad, with its standard deviation.
    #[must_use]
    pub fn phase(name: &'static str, value_rad: f64, std_rad: f64) -> Self {
        Self { kind: ParameterKind::Phase, ..Self::number(name, value_rad, std_rad, "rad") }
    }

    /// Fitted numbers, one a tooth.
    #[must_use]
    pub fn table(name: &'static str, values: Vec<f64>, unit: &'static str) -> Self {
        Self { name, value: Value::Table(values), std: None, unit, kind: ParameterKind::Fitted }
    }

    /// A value that the search found on its grid.
    #[must_use]
    pub fn grid(name: &'static str, value: f64, unit: &'static str) -> Self {
        Self { name, value: Value::Number(value), std: None, unit, kind: ParameterKind::Searched }
    }

    /// A word that the search found.
    #[must_use]
    pub fn word(name: &'static str, word: &'static str) -> Self {
        Self { name, value: Value::Text(word), std: None, unit: "", kind: ParameterKind::Searched }
    }

    /// A number that was neither fitted nor searched for.
    #[must_use]
    pub fn derived(name: &'static str, value: f64, unit: &'static str) -> Self {
        Self { name, value: Value::Number(value), std: None, unit, kind: ParameterKind::Derived }
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
