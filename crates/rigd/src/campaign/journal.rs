//! What a campaign has done, a line of JSON each, synced before anything else happens: the next start reads where to go on.

use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::CampaignError;

/// The journal's name in the campaign's directory.
pub const FILE: &str = "journal.jsonl";

/// A line of the journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "what", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Line {
    /// The campaign began, or was taken up again.
    Began {
        /// Fingerprint of plan and order.
        plan: String,
        /// RFC 3339.
        at: String,
        /// Who runs it.
        operator: String,
        /// First run to do, from 0.
        first: usize,
    },
    /// A run is complete and its log finalised.
    Finished(Box<FinishedRun>),
    /// The campaign was interrupted.
    Interrupted {
        /// RFC 3339.
        at: String,
        /// Why.
        why: String,
        /// It goes on by itself.
        goes_on: bool,
    },
}

/// A run that is complete.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FinishedRun {
    /// Index in the schedule, from 0.
    pub run: usize,
    /// `measure`, `reference` or `warm-up`.
    pub kind: String,
    /// Sense.
    pub direction: String,
    /// Load, N·m.
    pub load_nm: f64,
    /// Speed, rpm.
    pub speed_rpm: f64,
    /// Revolutions.
    pub revolutions: f64,
    /// Its log, in the campaign's directory.
    pub log: String,
    /// RFC 3339.
    pub at: String,
    /// Time of the rig at its end, ns since the Unix epoch.
    pub ended_ns: u64,
    /// Samples recorded.
    pub samples: u64,
    /// Samples lost from its approach to its end.
    pub losses: u64,
    /// Mean of the mean TE curve, rad.
    #[serde(default)]
    pub te_mean_rad: Option<f64>,
    /// Its peak-to-peak, rad.
    #[serde(default)]
    pub te_pp_rad: Option<f64>,
    /// RMS of measured minus predicted, rad.
    #[serde(default)]
    pub residual_rms_rad: Option<f64>,
}

/// The journal, open to be continued.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    is_empty: bool,
    /// Complete runs of all starts, in the order in which they ended.
    pub finished: Vec<FinishedRun>,
}

impl Journal {
    /// Opens or makes the journal of a directory, for a plan with this fingerprint.
    ///
    /// # Errors
    /// [`CampaignError::OtherCampaign`], [`CampaignError::Journal`], [`CampaignError::Io`].
    pub fn open(directory: &Path, fingerprint: &str) -> Result<Self, CampaignError> {
        let path = directory.join(FILE);
        let failed = |action| {
            let path = path.clone();
            move |source| CampaignError::Io { path, action, source }
        };
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(failed("read the journal")(error)),
        };
        // A line that a kill or a power cut left without its end was never told to anybody.
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut finished = Vec::new();
        for (n, line) in text[..whole].lines().enumerate() {
            let line: Line = serde_json::from_str(line).map_err(|error| CampaignError::Journal {
                path: path.clone(),
                line: n + 1,
                reason: error.to_string(),
            })?;
            match line {
                Line::Began { plan, .. } if plan != fingerprint => {
                    return Err(CampaignError::OtherCampaign {
                        directory: directory.into(),
                        found: plan,
                        wanted: fingerprint.into(),
                    });
                }
                Line::Finished(run) => finished.push(*run),
                Line::Began { .. } | Line::Interrupted { .. } => {}
            }
        }
        let file = OpenOptions::new().append(true).create(true).open(&path).map_err(failed("open the journal"))?;
        file.set_len(whole as u64).map_err(failed("cut the journal's broken last line"))?;
        Ok(Self { path, file, is_empty: whole == 0, finished })
    }

    /// No campaign was ever begun here, so that what lies here is somebody else's.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.is_empty
    }

    /// The first run that is not complete, of `runs`.
    #[must_use]
    pub fn first_unfinished(&self, runs: usize) -> usize {
        (0..runs).find(|index| !self.finished.iter().any(|run| run.run == *index)).unwrap_or(runs)
    }

    /// Writes a line and syncs it to the disk.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn write(&mut self, line: &Line) -> Result<(), CampaignError> {
        let failed = |source| CampaignError::Io { path: self.path.clone(), action: "write the journal", source };
        let mut text = serde_json::to_string(line).map_err(|error| failed(error.into()))?;
        text.push('\n');
        self.file.write_all(text.as_bytes()).map_err(failed)?;
        self.file.sync_data().map_err(failed)?;
        if let Line::Finished(run) = line {
            self.finished.push((**run).clone());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finished(run: usize) -> Line {
        Line::Finished(Box::new(FinishedRun {
            run,
            kind: "measure".into(),
            direction: "ccw".into(),
            load_nm: 5.0,
            speed_rpm: 30.0,
            revolutions: 2.0,
            log: format!("run-{run}.mcap"),
            at: String::new(),
            ended_ns: 1,
            samples: 10,
            losses: 0,
            te_mean_rad: Some(1e-6),
            te_pp_rad: None,
            residual_rms_rad: None,
        }))
    }

    fn began(plan: &str) -> Line {
        Line::Began { plan: plan.into(), at: String::new(), operator: String::new(), first: 0 }
    }

    #[test]
    fn goes_on_at_the_first_unfinished_run_after_a_kill_at_any_byte() {
        let directory = tempfile::TempDir::new().expect("a directory");
        let mut journal = Journal::open(directory.path(), "abc").expect("a journal");
        journal.write(&began("abc")).expect("written");
        let mut ends = vec![(std::fs::metadata(directory.path().join(FILE)).expect("a file").len(), 0)];
        for run in 0..3 {
            journal.write(&finished(run)).expect("written");
            ends.push((std::fs::metadata(directory.path().join(FILE)).expect("a file").len(), run + 1));
        }
        let whole = std::fs::read(directory.path().join(FILE)).expect("a file");
        for length in 0..=whole.len() {
            std::fs::write(directory.path().join(FILE), &whole[..length]).expect("a file");
            let mut cut = Journal::open(directory.path(), "abc").expect("readable");
            let expected =
                ends.iter().filter(|(end, _)| *end <= length as u64).map(|(_, runs)| *runs).max().unwrap_or(0);
            assert_eq!(cut.first_unfinished(5), expected, "cut at {length}");
            // And what is written next is whole again.
            cut.write(&finished(expected)).expect("written");
            assert_eq!(Journal::open(directory.path(), "abc").expect("readable").finished.len(), expected + 1);
        }
    }

    #[test]
    fn another_plan_and_a_broken_line_are_refused() {
        let directory = tempfile::TempDir::new().expect("a directory");
        let mut journal = Journal::open(directory.path(), "abc").expect("a journal");
        journal.write(&began("abc")).expect("written");
        let said = Journal::open(directory.path(), "xyz").expect_err("another plan").to_string();
        assert!(said.contains("abc") && said.contains("xyz") && said.contains("--out"), "{said}");
        std::fs::write(directory.path().join(FILE), "{}\n").expect("a file");
        let said = Journal::open(directory.path(), "abc").expect_err("no line").to_string();
        assert!(said.contains("line 1"), "{said}");
    }
}
