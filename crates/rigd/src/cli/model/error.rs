//! Why a question to the model has no answer, and the exit code that says so.

use gearmodel::GeometryError;
use gearmodel::contact::ContactError;
use gearmodel::tolerance::ToleranceError;
use thiserror::Error;

use super::output::OutputError;
use super::source::SourceError;
use crate::cli::Exit;
use crate::quantity::QuantityError;

/// Why a question to the model has no answer.
#[derive(Debug, Error)]
pub enum ModelError {
    /// The pair.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// A quantity on the command line.
    #[error(transparent)]
    Quantity(#[from] QuantityError),
    /// The model refuses.
    #[error("{pair}: {source}")]
    Geometry {
        /// Which pair.
        pair: String,
        /// Why.
        source: GeometryError,
    },
    /// The teeth do not touch as they must.
    #[error("{pair}: {source}")]
    Contact {
        /// Which pair.
        pair: String,
        /// Why.
        source: ContactError,
    },
    /// The printed equations know no load.
    #[error(
        "--load {load_nm} N·m: the method published knows no load; leave --load out or take common_normal or exact"
    )]
    PublishedLoad {
        /// The load given.
        load_nm: f64,
    },
    /// A count out of its range.
    #[error("{option} {given}: {lower} to {upper} are possible")]
    Count {
        /// The option.
        option: &'static str,
        /// What was given.
        given: u64,
        /// Least.
        lower: u64,
        /// Most.
        upper: u64,
    },
    /// A study of nothing.
    #[error(
        "nothing scatters; give --sigma KEY=SIGMA or --uniform KEY=WIDTH, for instance --sigma e1_mm=0.01 --uniform phi1_rad=3.1416"
    )]
    NothingScatters,
    /// The study cannot be run.
    #[error(transparent)]
    Tolerance(#[from] ToleranceError),
    /// Nowhere to put the result.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl ModelError {
    /// The exit code.
    #[must_use]
    pub fn exit(&self) -> Exit {
        match self {
            Self::Output(error) => error.exit(),
            _ => Exit::BadInput,
        }
    }
}

/// Passes a count in `lower..=upper`.
pub fn check_count(option: &'static str, given: u64, (lower, upper): (u64, u64)) -> Result<u64, ModelError> {
    if (lower..=upper).contains(&given) { Ok(given) } else { Err(ModelError::Count { option, given, lower, upper }) }
}
