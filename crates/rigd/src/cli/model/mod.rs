//! `rigd model`: questions to the model of a pair. One subcommand is one file; here they are only routed.

mod backlash;
mod check;
mod curve;
pub mod error;
mod method;
mod outline;
pub(super) mod output;
mod parameter;
#[cfg(feature = "parquet")]
mod parquet;
mod phases;
mod progress;
mod question;
mod source;
mod sweep;
pub(super) mod table;
mod te;
mod tolerance;

use clap::Subcommand;
use error::ModelError;

use super::{Exit, fail};

/// Ask the model of a gear pair.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    question: Question,
}

#[derive(Debug, Subcommand)]
enum Question {
    /// Predicted transmission error over θ1
    Te(te::Args),
    /// Predicted backlash over θ1
    Backlash(backlash::Args),
    /// How to mount the gears so that their eccentricities disturb least
    Phases(phases::Args),
    /// A figure over a grid of parameters
    Sweep(sweep::Args),
    /// What scatter of the errors does to TE and backlash of made pairs
    Tolerance(tolerance::Args),
    /// The gears as drawings: DXF, SVG, points
    Outline(outline::Args),
    /// Whether the pair closes, can be cut, keeps contact and does not bind (exit code 1 with a fault)
    Check(check::Args),
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let answered: Result<Exit, ModelError> = match &args.question {
        Question::Te(args) => te::run(args).map(|()| Exit::Done),
        Question::Backlash(args) => backlash::run(args).map(|()| Exit::Done),
        Question::Phases(args) => phases::run(args).map(|()| Exit::Done),
        Question::Sweep(args) => sweep::run(args),
        Question::Tolerance(args) => tolerance::run(args).map(|()| Exit::Done),
        Question::Outline(args) => outline::run(args).map(|()| Exit::Done),
        Question::Check(args) => check::run(args),
    };
    answered.unwrap_or_else(|error| fail(error.exit(), &error))
}
