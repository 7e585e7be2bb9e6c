//! The driver's sense of rotation.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Sense in which the driver turns, and with it the flank that carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Counter-clockwise: θ1 and θ2 increase.
    Ccw,
    /// Clockwise: θ1 and θ2 decrease.
    Cw,
}

impl Direction {
    /// Both senses, in the order in which a run records them.
    pub const BOTH: [Self; 2] = [Self::Ccw, Self::Cw];

    /// +1 for [`Direction::Ccw`], −1 for [`Direction::Cw`].
    #[must_use]
    #[inline]
    pub fn sign(self) -> f64 {
        match self {
            Self::Ccw => 1.0,
            Self::Cw => -1.0,
        }
    }

    /// 0 for [`Direction::Ccw`], 1 for [`Direction::Cw`]: the order of all tables by flank.
    #[inline]
    pub(crate) fn index(self) -> usize {
        match self {
            Self::Ccw => 0,
            Self::Cw => 1,
        }
    }

    /// The other sense.
    #[must_use]
    pub fn reversed(self) -> Self {
        match self {
            Self::Ccw => Self::Cw,
            Self::Cw => Self::Ccw,
        }
    }

    /// `"ccw"` or `"cw"`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Ccw => "ccw",
            Self::Cw => "cw",
        }
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// A direction that is neither `ccw` nor `cw`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("direction {given:?} is unknown: write \"ccw\" or \"cw\" (the driver's sense of rotation)")]
pub struct ParseDirectionError {
    /// The text that was given.
    pub given: String,
}

impl FromStr for Direction {
    type Err = ParseDirectionError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.trim().to_ascii_lowercase().as_str() {
            "ccw" => Ok(Self::Ccw),
            "cw" => Ok(Self::Cw),
            _ => Err(ParseDirectionError { given: text.to_owned() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_round_trip() {
        for direction in Direction::BOTH {
            assert_eq!(direction.to_string().parse::<Direction>(), Ok(direction));
            assert_eq!(direction.reversed().sign(), -direction.sign());
        }
        let error = "left".parse::<Direction>().unwrap_err();
        assert!(error.to_string().contains("\"left\""));
    }
}
