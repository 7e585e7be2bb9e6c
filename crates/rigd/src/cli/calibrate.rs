//! `rigd calibrate`: the brake's two branches, the encoders' discs, the zeros of the angles; found from the rig's own runs, and written with date
//! and uncertainty.

mod brake;
mod encoder;
mod zero;

use std::path::{Path, PathBuf};

use gearmodel::calibration::CalibrationError;
use gearmodel::measure::{AngleGrid, RunConditions, RunTe};
use gearmodel::{Direction, GearPair};
use riglog::{LogError, LogParts, RunSpan, RunStream, RunTotals, RunVisitor, SampleBlock};
use serde_json::Value;
use std::ops::ControlFlow;
use thiserror::Error;

use super::{Exit, fail, print};
use crate::calibration::CalibrationFileError;
use crate::profile::{Profile, ProfileError};
use crate::replay::ReplayError;

/// Find what a rig's brake, encoders and zeros are, with uncertainties
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Torque over coil current, both branches, by the servo's torque over whole turns; moves the rig
    Brake(Box<brake::Args>),
    /// Errors of an encoder's disc, from logs between which it was turned on its shaft
    Encoder(encoder::Args),
    /// Where the indices stand against the gears' zero, from logs in both senses
    Zero(zero::Args),
}

/// Where results go.
#[derive(Debug, clap::Args)]
struct Output {
    /// The calibration; what else it holds stays
    #[arg(long, value_name = "FILE", default_value = "calibration.toml")]
    out: PathBuf,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

impl Output {
    fn tell(&self, json: &Value, text: &str) {
        if self.json { print(&json.to_string()) } else { print(text) }
    }
}

/// Why there is no calibration.
#[derive(Debug, Error)]
enum CalibrateError {
    #[error(transparent)]
    Log(#[from] LogError),
    #[error(transparent)]
    Replay(#[from] ReplayError),
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    #[error(transparent)]
    File(#[from] CalibrationFileError),
    #[error(transparent)]
    Profile(#[from] ProfileError),
    #[error("{}: no attachment rig.toml, so nobody knows how its encoders were mounted; use logs of `rigd run`", path.display())]
    NoProfile { path: PathBuf },
    #[error(
        "the {other} encoder was turned on its shaft, too, between these logs ({first_deg}° and {second_deg}°); turn one encoder at a time"
    )]
    BothTurned { other: &'static str, first_deg: f64, second_deg: f64 },
    #[error("no whole revolution was recorded in these logs; record --revs 2 or more")]
    NoRun,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    match &args.what {
        What::Brake(args) => brake::main(args),
        What::Encoder(args) => encoder::run(args).unwrap_or_else(|error| fail(Exit::BadInput, &error)),
        What::Zero(args) => zero::run(args).unwrap_or_else(|error| fail(Exit::BadInput, &error)),
    }
}

/// TE of every run of one log, and the profile it was recorded with.
struct Recorded {
    path: PathBuf,
    profile: Profile,
    runs: Vec<RunTe>,
    complete: bool,
    encoders: Option<riglog::EncoderMetadata>,
}

fn record(paths: &[PathBuf], pair: &GearPair) -> Result<Vec<Recorded>, CalibrateError> {
    let mut recorded = Vec::new();
    for parts in LogParts::group(paths)? {
        let path = parts.first().to_owned();
        let stream = RunStream::open_parts(parts)?;
        let text = stream.attachment("rig.toml").ok_or_else(|| CalibrateError::NoProfile { path: path.clone() })?;
        let profile = Profile::parse(&String::from_utf8_lossy(text), Path::new("rig.toml"))?;
        let mut collector = Collector { pair, runs: Vec::new() };
        let totals = stream.stream(&mut collector)?;
        let complete = totals.completeness.is_complete() && totals.losses() == 0;
        recorded.push(Recorded { path, profile, runs: collector.runs, complete, encoders: stream.encoders().copied() });
    }
    Ok(recorded)
}

struct Collector<'a> {
    pair: &'a GearPair,
    runs: Vec<RunTe>,
}

impl RunVisitor for Collector<'_> {
    fn run_start(&mut self, _: usize, span: &RunSpan) -> ControlFlow<()> {
        let RunSpan { direction, load_nm, speed_rpm, .. } = *span;
        self.runs.push(RunTe::new(AngleGrid::default(), RunConditions { direction, load_nm, speed_rpm }));
        ControlFlow::Continue(())
    }

    fn samples(&mut self, _: usize, block: &SampleBlock<'_>) -> ControlFlow<()> {
        if let Some(run) = self.runs.last_mut() {
            for (theta1, theta2) in block.theta1_rad.iter().zip(block.theta2_rad) {
                run.push(self.pair, *theta1, *theta2);
            }
        }
        ControlFlow::Continue(())
    }

    fn run_end(&mut self, _: usize, _: &RunSpan, _: &RunTotals) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Names of logs, without their directories.
fn names(recorded: &[Recorded]) -> Vec<String> {
    let name = |log: &Recorded| log.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    recorded.iter().map(name).collect()
}

/// Now, as calibrations date themselves.
fn date() -> String {
    jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string()
}

/// Runs are compared at equal sense, load and speed.
fn key(run: &RunTe) -> (Direction, u64, u64) {
    let RunConditions { direction, load_nm, speed_rpm } = run.conditions();
    (direction, load_nm.to_bits(), speed_rpm.to_bits())
}
