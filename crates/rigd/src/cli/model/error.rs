//! Why a question to the model has no answer, and the exit code that says so.

use std::path::PathBuf;

use gearmodel::GeometryError;
use gearmodel::contact::ContactError;
use gearmodel::tolerance::ToleranceError;
use thiserror::Error;

use super::source::SourceError;
use crate::chart::ChartError;
use crate::cli::Exit;
use crate::quantity::QuantityError;

/// Why a result went nowhere.
#[derive(Debug, Error)]
pub enum OutputError {
    /// Two things for one stdout.
    #[error("{first} and {second} both ask for stdout, which takes one; give one of them a file's name")]
    TwoOnStdout {
        /// One option.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// Two drawings for one stdout.
    #[error("{option} - : a drawing holds one gear; choose it with --gear 1 or --gear 2, or give a file's name")]
    TwoGears {
        /// The option.
        option: &'static str,
    },
    /// This build has no Parquet.
    #[error(
        "--parquet {}: this build of rigd cannot write Parquet; build it with `cargo build --release -p rigd --features parquet`, or use --csv",
        path.display()
    )]
    NoParquet {
        /// The file.
        path: PathBuf,
    },
    /// Parquet ends in its own index, which a pipe cannot take back.
    #[error("--parquet - : Parquet needs a file, not stdout; give it a name")]
    ParquetOnStdout,
    /// Writing Parquet failed.
    #[cfg(feature = "parquet")]
    #[error("--parquet {}: {source}", path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// Why.
        source: parquet::errors::ParquetError,
    },
    /// The picture cannot be made.
    #[error("--plot {}: {source}", path.display())]
    Chart {
        /// The file.
        path: PathBuf,
        /// Why.
        source: ChartError,
    },
    /// The file cannot be written.
    #[error("{option} {}: {source}; is the directory there and writable?", path.display())]
    Write {
        /// The option that asked for it.
        option: &'static str,
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The table cannot be written.
    #[error("{option} {}: {source}", path.display())]
    Csv {
        /// The option that asked for it.
        option: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        source: csv::Error,
    },
}

impl OutputError {
    /// Bad usage, or a failure of this computer.
    #[must_use]
    pub fn exit(&self) -> Exit {
        match self {
            Self::TwoOnStdout { .. } | Self::TwoGears { .. } | Self::NoParquet { .. } | Self::ParquetOnStdout => {
                Exit::BadInput
            }
            Self::Chart { source: ChartError::Format { .. }, .. } => Exit::BadInput,
            _ => Exit::Failed,
        }
    }
}

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
