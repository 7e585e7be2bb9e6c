//! Why there is no withheld data, or no score.

use std::path::PathBuf;

use riglog::{LogError, PairError};
use rigsim::plant::PlantError;
use thiserror::Error;

use super::plant_of_pair::NoSimulatedGears;

/// Why there is no withheld data, or no score.
#[derive(Debug, Error)]
pub enum BlindError {
    /// The rig of a case cannot be built.
    #[error("withheld case: {0}")]
    Plant(#[from] PlantError),
    /// The pair has no simulated gears.
    #[error("withheld case: {0}")]
    Gears(#[from] NoSimulatedGears),
    /// The pair cannot be read.
    #[error("withheld case: {0}")]
    Pair(#[from] PairError),
    /// The brake cannot make the load.
    #[error("withheld case: a load of {load_nm} N·m is beyond {where_}; plan a smaller load")]
    BeyondBrake {
        /// The load, N·m.
        load_nm: f64,
        /// What ends before it.
        where_: &'static str,
    },
    /// The simulated rig does not get there.
    #[error(
        "withheld case: waited {patience_s:.1} s of simulated time for {what}; the plan's speed or load stalls the rig"
    )]
    Stuck {
        /// What was waited for.
        what: &'static str,
        /// How long, s.
        patience_s: f64,
    },
    /// An effect could not be drawn at the size asked for.
    #[error("withheld case: {effect} at {rms_rad:.1e} rad RMS leaves no rig that can be built; ask for a smaller size")]
    Unfit {
        /// The effect.
        effect: &'static str,
        /// The size, rad.
        rms_rad: f64,
    },
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A label cannot be understood.
    #[error("label {}: {reason}; make the withheld data anew", path.display())]
    Label {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}
