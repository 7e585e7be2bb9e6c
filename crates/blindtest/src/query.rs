//! Asks the diagnosis about a log: the same way in as `rigd diagnose LOG --json`, so that what is scored is what people get.

use std::path::{Path, PathBuf};

use diagnosis::Options;
use serde_json::Value;
use thiserror::Error;

use diagnosis::logs::{Logs, LogsError};

/// Why there is no answer.
#[derive(Debug, Error)]
pub enum QueryError {
    /// It refused.
    #[error("{}: {source}", log.display())]
    Refused {
        /// The log.
        log: PathBuf,
        /// Why.
        source: LogsError,
    },
    /// It answered something else than JSON.
    #[error("{}: the answer is no JSON: {source}", log.display())]
    Answer {
        /// The log.
        log: PathBuf,
        /// What is wrong with it.
        source: serde_json::Error,
    },
}

/// The diagnosis of a log, as `to_dict()` gives it; the pair is the one in the log. `exclude` names effects that it shall do without.
///
/// # Errors
/// [`QueryError`] when there is no answer.
pub fn diagnose(log: &Path, exclude: &[String]) -> Result<Value, QueryError> {
    let options = Options { exclude: exclude.to_vec(), ..Options::default() };
    let diagnosed = Logs::open(&[log.to_owned()], None)
        .and_then(|logs| logs.diagnose(&options))
        .map_err(|source| QueryError::Refused { log: log.into(), source })?;
    // By way of its text, as a reader of `--json` has it.
    serde_json::from_str(&diagnosed.diagnosis.to_json())
        .map_err(|source| QueryError::Answer { log: log.into(), source })
}
