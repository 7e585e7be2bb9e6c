//! Recomputes TE and backlash from a log: the same code as live, hence the same bits.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use gearmodel::NominalModel;
use gearmodel::measure::RunConditions;
use riglog::{LogError, LogParts, RunSpan, RunStream, RunTotals, RunVisitor, SampleBlock};
use thiserror::Error;

use crate::analysis::Analysis;
use riglog::pair::{self, PairError};

/// Why a log cannot be replayed.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The log has no gear pair.
    #[error("{path}: no attachment pair.toml, so there is no model to compare with; give one with --pair")]
    NoPair {
        /// The log.
        path: PathBuf,
    },
    /// Its gear pair is not valid.
    #[error("{path}: {source}")]
    Pair {
        /// The log.
        path: PathBuf,
        /// What is wrong.
        source: PairError,
    },
    /// The pair of another file.
    #[error(transparent)]
    OtherPair(PairError),
}

/// What a replay found beside TE and backlash.
#[derive(Debug, Default)]
pub struct Replayed {
    /// Samples that are missing.
    pub losses: u64,
    /// Why the logs are incomplete, a line each.
    pub incomplete: Vec<String>,
}

/// The text of the log's `pair.toml`, and its backend.
///
/// # Errors
/// [`LogError`] when the log cannot be read.
pub fn head(path: &Path) -> Result<(Option<String>, String), LogError> {
    let stream = RunStream::open(path)?;
    let pair = stream.attachment("pair.toml").map(|text| String::from_utf8_lossy(text).into_owned());
    let backend = stream.metadata().map(|run| run.backend.clone()).unwrap_or_default();
    Ok((pair, backend))
}

/// The model that a log is compared with, its own or that of another file, and the log's backend.
///
/// # Errors
/// [`ReplayError`] when the log cannot be read, or neither gives a valid pair.
pub fn model_for(path: &Path, other: Option<&Path>) -> Result<(NominalModel, String), ReplayError> {
    let (pair_in_log, backend) = head(path)?;
    let model = match other {
        Some(other) => pair::load(Some(other)).map_err(ReplayError::OtherPair)?.1,
        None => {
            let text = pair_in_log.ok_or_else(|| ReplayError::NoPair { path: path.into() })?;
            pair::parse(&text, Path::new("pair.toml"))
                .map_err(|source| ReplayError::Pair { path: path.into(), source })?
        }
    };
    Ok((model, backend))
}

/// Paces a replay by the recorded time.
struct Pace {
    began: Instant,
    first_ns: Option<u64>,
    speed: f64,
}

struct Feed<'a> {
    analysis: &'a mut Analysis,
    pace: Option<Pace>,
    last_ns: u64,
}

impl RunVisitor for Feed<'_> {
    fn run_start(&mut self, _: usize, span: &RunSpan) -> ControlFlow<()> {
        let RunSpan { direction, load_nm, speed_rpm, .. } = *span;
        self.analysis.begin(RunConditions { direction, load_nm, speed_rpm });
        ControlFlow::Continue(())
    }

    fn samples(&mut self, _: usize, block: &SampleBlock<'_>) -> ControlFlow<()> {
        if let (Some(pace), Some(time_ns)) = (&mut self.pace, block.time_ns.first()) {
            pace.wait(*time_ns);
        }
        for (theta1, theta2) in block.theta1_rad.iter().zip(block.theta2_rad) {
            self.analysis.push(*theta1, *theta2);
        }
        self.last_ns = block.time_ns.last().copied().unwrap_or(self.last_ns);
        ControlFlow::Continue(())
    }

    fn run_end(&mut self, _: usize, span: &RunSpan, totals: &RunTotals) -> ControlFlow<()> {
        // A run that was cut off ends with its last sample.
        let end_ns = span.end_ns.unwrap_or(self.last_ns);
        let duration_s = end_ns.saturating_sub(span.start_ns) as f64 * 1e-9;
        self.analysis.end(totals.losses, duration_s);
        ControlFlow::Continue(())
    }
}

impl Pace {
    fn wait(&mut self, time_ns: u64) {
        let first = *self.first_ns.get_or_insert(time_ns);
        let due = Duration::from_nanos(time_ns.saturating_sub(first)).div_f64(self.speed);
        std::thread::sleep(due.saturating_sub(self.began.elapsed()));
    }
}

/// Replays logs in their order, the parts of a log that was split as one, into `analysis`; `speed` is a multiple of real time, `None` as fast as it goes.
///
/// # Errors
/// [`ReplayError`] names the log and what to do.
pub fn replay(paths: &[PathBuf], analysis: &mut Analysis, speed: Option<f64>) -> Result<Replayed, ReplayError> {
    let mut replayed = Replayed::default();
    let pace = speed.map(|speed| Pace { began: Instant::now(), first_ns: None, speed });
    let mut feed = Feed { analysis, pace, last_ns: 0 };
    for log in LogParts::group(paths)? {
        let path = log.first().to_owned();
        let totals = RunStream::open_parts(log)?.stream(&mut feed)?;
        let losses = totals.losses_in_file;
        replayed.losses += losses;
        if losses > 0 {
            replayed.incomplete.push(format!("{}: {losses} samples are missing", path.display()));
        }
        if !totals.completeness.is_complete() {
            replayed.incomplete.push(format!("{}: {}", path.display(), totals.completeness));
        }
    }
    Ok(replayed)
}
