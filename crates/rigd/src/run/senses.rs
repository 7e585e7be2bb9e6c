//! One sense of rotation or both, as the command line and plans write them.

use gearmodel::Direction;
use serde::{Deserialize, Serialize};

/// Senses in the order in which they are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Senses {
    /// Counter-clockwise alone.
    Ccw,
    /// Clockwise alone.
    Cw,
    /// Counter-clockwise, then clockwise.
    Both,
}

impl Senses {
    /// As a list.
    #[must_use]
    pub fn list(self) -> Vec<Direction> {
        match self {
            Self::Ccw => vec![Direction::Ccw],
            Self::Cw => vec![Direction::Cw],
            Self::Both => vec![Direction::Ccw, Direction::Cw],
        }
    }
}
