//! The two shafts, by name.

use super::Carrier;

/// Shaft that an effect sits on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shaft {
    /// The driver's.
    Input,
    /// The driven one.
    Output,
}

impl Shaft {
    /// What repeats with its angle.
    #[must_use]
    pub fn carrier(self) -> Carrier {
        match self {
            Self::Input => Carrier::Input,
            Self::Output => Carrier::Output,
        }
    }
}
