//! Parameters of a fault, by the names under which the diagnosis reports them; units are in the names.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A number.
    Number(f64),
    /// One number for each of many, teeth for instance.
    Numbers(Vec<f64>),
    /// A choice.
    Word(String),
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<&str> for Value {
    fn from(word: &str) -> Self {
        Self::Word(word.to_owned())
    }
}

/// The parameters of one fault.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Parameters(BTreeMap<String, Value>);

impl Parameters {
    /// Parameters that are all numbers.
    #[must_use]
    pub fn of(numbers: &[(&str, f64)]) -> Self {
        Self(numbers.iter().map(|&(name, value)| (name.to_owned(), Value::Number(value))).collect())
    }

    /// The same with this one, be it new or another value of one that is there.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.0.insert(name.to_owned(), value.into());
        self
    }

    /// The same with one number multiplied.
    #[must_use]
    pub fn times(self, name: &str, factor: f64) -> Self {
        self.scaled(&[(name, 1.0)], factor)
    }

    /// A number; 0, which switches a fault off, where there is none.
    #[must_use]
    pub fn number(&self, name: &str) -> f64 {
        match self.0.get(name) {
            Some(Value::Number(value)) => *value,
            _ => 0.0,
        }
    }

    /// Numbers; none where there are none.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        match self.0.get(name) {
            Some(Value::Numbers(values)) => values.clone(),
            _ => Vec::new(),
        }
    }

    /// A choice; empty where there is none.
    #[must_use]
    pub fn word(&self, name: &str) -> &str {
        match self.0.get(name) {
            Some(Value::Word(word)) => word,
            _ => "",
        }
    }

    /// All parameters by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }

    /// The same parameters with those in `amounts` multiplied by `factor` to the power given there.
    #[must_use]
    pub fn scaled(&self, amounts: &[(&str, f64)], factor: f64) -> Self {
        let mut scaled = self.clone();
        for &(name, power) in amounts {
            match scaled.0.get_mut(name) {
                Some(Value::Number(value)) => *value *= factor.powf(power),
                Some(Value::Numbers(values)) => values.iter_mut().for_each(|value| *value *= factor.powf(power)),
                _ => {}
            }
        }
        scaled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_scale_and_the_rest_stays() {
        let parameters = Parameters::of(&[("eps", 2.0), ("f_hz", 8.0), ("phase_rad", 1.0)])
            .with("ccw_mm", Value::Numbers(vec![1.0, -2.0]))
            .with("flank", "ccw");
        let scaled = parameters.scaled(&[("eps", 1.0), ("f_hz", -0.5), ("ccw_mm", 1.0)], 4.0);
        assert_eq!((scaled.number("eps"), scaled.number("f_hz"), scaled.number("phase_rad")), (8.0, 4.0, 1.0));
        assert_eq!(scaled.numbers("ccw_mm"), [4.0, -8.0]);
        assert_eq!((scaled.word("flank"), scaled.number("nothing")), ("ccw", 0.0));
    }

    #[test]
    fn they_survive_json() {
        let parameters = Parameters::of(&[("eps", 2.5e-5)]).with("ccw_mm", Value::Numbers(vec![1.0]));
        let text = serde_json::to_string(&parameters).unwrap();
        assert_eq!(serde_json::from_str::<Parameters>(&text).unwrap(), parameters);
    }
}
