//! A campaign: many runs by a plan, each with a log of its own, taken up again where it ended.
//!
//! `plan` (TOML, checked as a whole) → `schedule` (the order of the runs) → `estimate` (time and heat) → `observer` (one log a run,
//! through [`crate::run::run_job`]) → `journal` (what is done, for the next start) → `report`.

pub mod estimate;
pub mod journal;
pub mod observer;
pub mod plan;
pub mod report;
pub mod schedule;

use std::path::PathBuf;

use thiserror::Error;

/// Why a campaign cannot begin or go on.
#[derive(Debug, Error)]
pub enum CampaignError {
    /// The plan could not be read.
    #[error("plan {path}: {source}; `rigd campaign --help` says what a plan holds")]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The file is no plan.
    #[error("plan {path}: {source}")]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, key and reason.
        source: Box<toml::de::Error>,
    },
    /// Values that are out of range, all of them.
    #[error("plan {path}: {}", faults.join(&format!("\nplan {}: ", path.display())))]
    Faults {
        /// The file.
        path: PathBuf,
        /// A line each: key, value, unit, limit, what to do.
        faults: Vec<String>,
    },
    /// The directory holds another campaign.
    #[error(
        "{directory} holds the campaign of another plan or seed ({found} there, {wanted} here); name another directory with --out"
    )]
    OtherCampaign {
        /// The directory.
        directory: PathBuf,
        /// Fingerprint of the plan there.
        found: String,
        /// Fingerprint of this plan.
        wanted: String,
    },
    /// The journal does not read.
    #[error("journal {path}, line {line}: {reason}; move the file away to begin anew, the logs stay")]
    Journal {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// A file of the campaign could not be written or moved.
    #[error("{path}: could not {action}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The operating system's reason.
        source: std::io::Error,
    },
}
