//! The gap diagnosis of logs: what `rigd diagnose`, `rigd verify` and the blind test share.

use std::path::{Path, PathBuf};

use gearmodel::PairFile;
use riglog::LogError;
use riglog::pair::{self, PairError};
use thiserror::Error;

use crate::campaign_logs::CampaignLogs;
use crate::verify::{Verified, verify};
use crate::{Diagnosis, GapError, Nominal, Options, Settings, diagnose_runs};

/// Why logs are not diagnosed.
#[derive(Debug, Error)]
pub enum LogsError {
    /// A log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// No log has a gear pair.
    #[error("{path}: no attachment pair.toml, so there is no model to compare with; give one with --pair")]
    NoPair {
        /// The first log.
        path: PathBuf,
    },
    /// The pair in the log is not valid.
    #[error("{path}: {source}; give another one with --pair")]
    Pair {
        /// The log.
        path: PathBuf,
        /// What is wrong.
        source: PairError,
    },
    /// The pair given is not valid.
    #[error(transparent)]
    OtherPair(PairError),
    /// There is no diagnosis.
    #[error(transparent)]
    Gap(#[from] GapError),
}

/// Logs with the nominal model that they are compared with.
pub struct Logs {
    logs: CampaignLogs,
    /// The pair in force.
    pub pair: PairFile,
    nominal: Nominal,
    /// What a person should know before believing the numbers.
    pub notes: Vec<String>,
}

/// A diagnosis, and what the logs lack.
pub struct Diagnosed {
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// Why the logs are incomplete, a line each.
    pub incomplete: Vec<String>,
}

impl Logs {
    /// Opens logs of one campaign, named in any order; the pair is that of the file, or the earliest log's own.
    ///
    /// # Errors
    /// [`LogsError`] names the file and what to do.
    pub fn open(paths: &[PathBuf], other: Option<&Path>) -> Result<Self, LogsError> {
        let logs = CampaignLogs::open(paths)?;
        let mut notes = Vec::new();
        let (pair, model) = match other {
            Some(path) => pair::load_file(path).map_err(LogsError::OtherPair)?,
            None => {
                let mut own = logs.paths().zip(logs.pair_texts()).filter_map(|(path, text)| Some((path, text?)));
                let Some((path, text)) = own.next() else {
                    let path = logs.paths().next().unwrap_or(Path::new("")).to_owned();
                    return Err(LogsError::NoPair { path });
                };
                for (other, _) in own.filter(|(_, t)| *t != text) {
                    notes.push(format!(
                        "{} carries another pair.toml than {}, which is used for all; give one with --pair",
                        other.display(),
                        path.display()
                    ));
                }
                pair::parse_file(&text, Path::new("pair.toml"))
                    .map_err(|source| LogsError::Pair { path: path.to_owned(), source })?
            }
        };
        let nominal = logs.nominal(model);
        Ok(Self { logs, pair, nominal, notes })
    }

    /// Diagnoses them, reading every sample once and holding none.
    ///
    /// # Errors
    /// [`LogsError`] when a log breaks off in the middle of a message or the data is too little.
    pub fn diagnose(&self, options: &Options) -> Result<Diagnosed, LogsError> {
        let reduced = self.logs.reduce(&self.nominal, &options.settings)?;
        let incomplete = reduced.incomplete();
        let diagnosis = diagnose_runs(&self.nominal, reduced.runs, options)?;
        Ok(Diagnosed { diagnosis, incomplete })
    }

    /// Compares them with the model, without looking for causes; `None` where nothing turned.
    ///
    /// # Errors
    /// [`LogsError`] when a log breaks off in the middle of a message.
    pub fn verify(&self) -> Result<(Option<Verified>, Vec<String>), LogsError> {
        let reduced = self.logs.reduce(&self.nominal, &Settings::default())?;
        let incomplete = reduced.incomplete();
        let runs = reduced.runs.into_iter().map(|(run, _)| run).collect();
        Ok((verify(&self.nominal, runs), incomplete))
    }
}
