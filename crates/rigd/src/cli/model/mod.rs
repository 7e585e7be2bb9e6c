//! `rigd model`: questions to the model of a pair. One subcommand is one file; here they are only routed.

mod backlash;
mod curve;
mod error;
mod method;
mod output;
mod source;
mod table;
mod te;

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
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let answered: Result<Exit, ModelError> = match &args.question {
        Question::Te(args) => te::run(args).map(|()| Exit::Done),
        Question::Backlash(args) => backlash::run(args).map(|()| Exit::Done),
    };
    answered.unwrap_or_else(|error| fail(error.exit(), &error))
}
