//! Senses of rotation on the command line.

use gearmodel::Direction;

/// Senses in the order in which they are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Directions {
    /// Counter-clockwise alone.
    Ccw,
    /// Clockwise alone.
    Cw,
    /// Counter-clockwise, then clockwise.
    Both,
}

impl Directions {
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
