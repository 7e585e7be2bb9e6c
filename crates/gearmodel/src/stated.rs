//! Parameters as a person states them in a file: the way back from an effect's parameters to its shape and amplitudes.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A parameter as it stands in a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Stated {
    /// A number.
    Number(f64),
    /// One number a tooth, or a list of times.
    Table(Vec<f64>),
    /// A word.
    Text(String),
}

/// Parameters of one effect by name.
pub type StatedEffect = BTreeMap<String, Stated>;

/// Why stated parameters do not describe an effect.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StatedError {
    /// No effect of this name.
    #[error("effect `{effect}` is unknown: the library has {allowed}")]
    Effect {
        /// The name given.
        effect: String,
        /// The names there are.
        allowed: String,
    },
    /// This pair cannot have it.
    #[error(
        "effect `{effect}` needs teeth, which a pair of constant ratio has not: describe the gears as circular, or leave it out"
    )]
    NeedsTeeth {
        /// The effect.
        effect: &'static str,
    },
    /// A parameter that the effect does not have.
    #[error("effect `{effect}` has no parameter `{parameter}`: it has {allowed}")]
    Unknown {
        /// The effect.
        effect: &'static str,
        /// The parameter given.
        parameter: String,
        /// Its parameters.
        allowed: String,
    },
    /// A parameter without which the trace is not fixed.
    #[error("effect `{effect}` needs its parameter `{parameter}`: it has {allowed}")]
    Missing {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// Its parameters.
        allowed: String,
    },
    /// A value of the wrong kind.
    #[error("effect `{effect}`: `{parameter}` is {given}, and {needed} is needed")]
    Kind {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// What was given.
        given: String,
        /// What belongs there.
        needed: String,
    },
    /// A value outside its limits.
    #[error("effect `{effect}`: `{parameter}` = {value} is outside {lower} to {upper}")]
    OutOfRange {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// The value.
        value: f64,
        /// Smallest value accepted.
        lower: f64,
        /// Largest value accepted.
        upper: f64,
    },
}

/// Stated parameters of one effect, whose names are known to be its own.
#[derive(Clone, Copy, Debug)]
pub struct Given<'a> {
    effect: &'static str,
    parameters: &'a StatedEffect,
    names: &'static [&'static str],
}

fn listed(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

impl<'a> Given<'a> {
    /// Parameters of the effect `effect`, whose parameters are `names`.
    ///
    /// # Errors
    /// [`StatedError::Unknown`].
    pub fn new(
        effect: &'static str,
        names: &'static [&'static str],
        parameters: &'a StatedEffect,
    ) -> Result<Self, StatedError> {
        match parameters.keys().find(|key| !names.contains(&key.as_str())) {
            Some(key) => Err(StatedError::Unknown { effect, parameter: key.clone(), allowed: listed(names) }),
            None => Ok(Self { effect, parameters, names }),
        }
    }

    /// Its parameters' names.
    #[must_use]
    pub fn names(&self) -> &'static [&'static str] {
        self.names
    }

    /// Whether a parameter is stated.
    #[must_use]
    pub fn has(&self, parameter: &str) -> bool {
        self.parameters.contains_key(parameter)
    }

    fn missing(&self, parameter: &'static str) -> StatedError {
        StatedError::Missing { effect: self.effect, parameter, allowed: listed(self.names) }
    }

    fn kind(&self, parameter: &'static str, given: &Stated, needed: impl Into<String>) -> StatedError {
        StatedError::Kind { effect: self.effect, parameter, given: format!("{given:?}"), needed: needed.into() }
    }

    /// A finite number.
    ///
    /// # Errors
    /// [`StatedError`] when it is not stated, no number, or not finite.
    pub fn number(&self, parameter: &'static str) -> Result<f64, StatedError> {
        match self.parameters.get(parameter).ok_or_else(|| self.missing(parameter))? {
            Stated::Number(number) if number.is_finite() => Ok(*number),
            other => Err(self.kind(parameter, other, "a finite number")),
        }
    }

    /// A number that may be left out.
    ///
    /// # Errors
    /// As for [`Given::number`], save that it may be missing.
    pub fn number_or(&self, parameter: &'static str, usual: f64) -> Result<f64, StatedError> {
        if self.has(parameter) { self.number(parameter) } else { Ok(usual) }
    }

    /// A number within limits.
    ///
    /// # Errors
    /// As for [`Given::number`], and [`StatedError::OutOfRange`].
    pub fn number_in(&self, parameter: &'static str, lower: f64, upper: f64) -> Result<f64, StatedError> {
        let value = self.number(parameter)?;
        if (lower..=upper).contains(&value) {
            Ok(value)
        } else {
            Err(StatedError::OutOfRange { effect: self.effect, parameter, value, lower, upper })
        }
    }

    /// A list of finite numbers; `length` is the number that is needed, where it is known.
    ///
    /// # Errors
    /// [`StatedError`] when it is not stated, no list, or of another length.
    pub fn table(&self, parameter: &'static str, length: Option<usize>) -> Result<&'a [f64], StatedError> {
        match self.parameters.get(parameter).ok_or_else(|| self.missing(parameter))? {
            Stated::Table(table)
                if table.iter().all(|x| x.is_finite()) && length.is_none_or(|length| table.len() == length) =>
            {
                Ok(table)
            }
            other => {
                let needed =
                    length.map_or("a list of finite numbers".to_owned(), |n| format!("a list of {n} finite numbers"));
                Err(self.kind(parameter, other, needed))
            }
        }
    }

    /// Which of `words` is stated; the first where none is and `may_be_missing`.
    ///
    /// # Errors
    /// [`StatedError`] when it is another word, or missing.
    pub fn word(&self, parameter: &'static str, words: &[&str], may_be_missing: bool) -> Result<usize, StatedError> {
        match self.parameters.get(parameter) {
            None if may_be_missing => Ok(0),
            None => Err(self.missing(parameter)),
            Some(Stated::Text(text)) if words.contains(&text.as_str()) => {
                Ok(words.iter().position(|word| word == text).unwrap_or_default())
            }
            Some(other) => Err(self.kind(parameter, other, format!("one of {}", listed(words)))),
        }
    }

    /// Amplitudes of the columns sin x, cos x of a trace a sin(x − φ), φ stated as `phase_rad`: β = (a cos φ, −a sin φ).
    ///
    /// # Errors
    /// As for [`Given::number`].
    pub fn polar(&self, amplitude: &'static str) -> Result<Vec<f64>, StatedError> {
        let (a, phase_rad) = (self.number(amplitude)?, self.number("phase_rad")?);
        Ok(vec![a * phase_rad.cos(), -a * phase_rad.sin()])
    }
}
