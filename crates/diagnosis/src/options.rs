//! What a person may say before the data is looked at, and why there is no diagnosis.

use super::settings::Settings;
use gearmodel::effect::{Effect, LIBRARY, by_name};

/// What may be said before the data is looked at.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Effects that are there: always in the model.
    pub known: Vec<String>,
    /// Effects that are not.
    pub exclude: Vec<String>,
    /// Every number that can change the verdict.
    pub settings: Settings,
}

/// Why there is no diagnosis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GapError {
    /// No recording at all.
    #[error("no recording was given: at least 1 is needed")]
    NoRecording,
    /// Recordings without a segment in which the driver turns.
    #[error(
        "{recordings} recordings hold {points} segments of motion together: at least {needed} are needed (a quarter degree each)"
    )]
    TooShort {
        /// Recordings given.
        recordings: usize,
        /// Segments found.
        points: usize,
        /// Least number.
        needed: usize,
    },
    /// An effect that the library does not have.
    #[error("effect {name:?} is unknown: the library has {allowed}")]
    UnknownEffect {
        /// The name given.
        name: String,
        /// The names there are.
        allowed: String,
    },
    /// The sums over the recordings cannot be solved.
    #[error("the residuals cannot be fitted: their sums are not finite; check the angles and loads for absurd values")]
    Singular,
    /// Both known and excluded.
    #[error("effect {name:?} is both known and excluded: name it in one of the two")]
    KnownAndExcluded {
        /// The name.
        name: String,
    },
}

impl Options {
    /// True of an effect that is said not to be there.
    pub(crate) fn excludes(&self, effect: &dyn Effect) -> bool {
        self.exclude.iter().any(|name| name == effect.name())
    }

    pub(crate) fn check(&self) -> Result<(), GapError> {
        for name in self.known.iter().chain(&self.exclude) {
            if by_name(name).is_none() {
                let allowed = LIBRARY.iter().map(|e| e.name()).collect::<Vec<_>>().join(", ");
                return Err(GapError::UnknownEffect { name: name.clone(), allowed });
            }
        }
        match self.known.iter().find(|name| self.exclude.contains(name)) {
            Some(name) => Err(GapError::KnownAndExcluded { name: name.clone() }),
            None => Ok(()),
        }
    }
}
