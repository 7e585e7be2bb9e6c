//! Asks the diagnosis about a log: the command `rigd diagnose` of this very program, as anybody would, so that what is scored is what
//! people get.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use thiserror::Error;

/// Why there is no answer.
#[derive(Debug, Error)]
pub enum AskError {
    /// The program cannot be started.
    #[error("rigd diagnose {}: cannot be started: {source}", log.display())]
    Start {
        /// The log.
        log: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// It refused.
    #[error("rigd diagnose {} ended with {code}: {said}", log.display())]
    Refused {
        /// The log.
        log: PathBuf,
        /// Its exit code, or the signal that ended it.
        code: String,
        /// Its last words.
        said: String,
    },
    /// It answered something else than JSON.
    #[error("rigd diagnose {}: its answer is no JSON: {source}", log.display())]
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
/// [`AskError`] when there is no answer.
pub fn diagnose(log: &Path, exclude: &[String]) -> Result<Value, AskError> {
    let start = |source| AskError::Start { log: log.into(), source };
    let mut command = Command::new(std::env::current_exe().map_err(start)?);
    command.arg("diagnose").arg(log).arg("--json");
    for name in exclude {
        command.arg("--exclude").arg(name);
    }
    let output = command.output().map_err(start)?;
    // Exit code 3 is an answer, too: that the data cannot tell.
    if !matches!(output.status.code(), Some(0 | 3)) {
        let said = String::from_utf8_lossy(&output.stderr).trim().lines().next().unwrap_or_default().to_owned();
        return Err(AskError::Refused { log: log.into(), code: output.status.to_string(), said });
    }
    serde_json::from_slice(&output.stdout).map_err(|source| AskError::Answer { log: log.into(), source })
}
