//! Whole runs in memory.

use std::{ops::ControlFlow, path::Path};

use gearmodel::Direction;

use crate::{
    error::LogError,
    run_stream::RunStream,
    run_visitor::{RunVisitor, SampleBlock},
    runs::{RunSpan, RunTotals},
};

/// A run in memory, as shaft angles.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedRun {
    /// The driver's sense.
    pub direction: Direction,
    /// Load set-point.
    pub load_nm: f64,
    /// Speed set-point.
    pub speed_rpm: f64,
    /// Turns of the driver between the first and the last sample.
    pub revolutions: f64,
    /// Device time since the first sample of the file.
    pub time_s: Vec<f64>,
    /// Angle of the driver.
    pub theta1_rad: Vec<f64>,
    /// Angle of the driven gear.
    pub theta2_rad: Vec<f64>,
    /// Number of samples.
    pub samples: u64,
    /// Samples that are missing in between.
    pub losses: u64,
}

/// Reads every run of a log into memory. A log that was cut off gives what is whole of it.
///
/// # Errors
/// The file is no rig log, a message does not decode, or there are runs but no encoder metadata.
pub fn read_runs(path: impl AsRef<Path>) -> Result<Vec<RecordedRun>, LogError> {
    let stream = RunStream::open(path)?;
    let mut collector = Collector { runs: Vec::new(), origin_ns: stream.start_ns().unwrap_or(0) };
    stream.stream(&mut collector)?;
    Ok(collector.runs)
}

struct Collector {
    runs: Vec<RecordedRun>,
    origin_ns: u64,
}

impl RunVisitor for Collector {
    fn run_start(&mut self, _: usize, span: &RunSpan) -> ControlFlow<()> {
        self.runs.push(RecordedRun {
            direction: span.direction,
            load_nm: span.load_nm,
            speed_rpm: span.speed_rpm,
            revolutions: 0.0,
            time_s: Vec::new(),
            theta1_rad: Vec::new(),
            theta2_rad: Vec::new(),
            samples: 0,
            losses: 0,
        });
        ControlFlow::Continue(())
    }

    fn samples(&mut self, _: usize, block: &SampleBlock<'_>) -> ControlFlow<()> {
        const S_PER_NS: f64 = 1e-9;
        if let Some(run) = self.runs.last_mut() {
            let origin_ns = self.origin_ns;
            run.time_s.extend(block.time_ns.iter().map(|t| t.saturating_sub(origin_ns) as f64 * S_PER_NS));
            run.theta1_rad.extend_from_slice(block.theta1_rad);
            run.theta2_rad.extend_from_slice(block.theta2_rad);
        }
        ControlFlow::Continue(())
    }

    fn run_end(&mut self, _: usize, _: &RunSpan, totals: &RunTotals) -> ControlFlow<()> {
        if let Some(run) = self.runs.last_mut() {
            run.samples = totals.samples;
            run.losses = totals.losses;
            run.revolutions = totals.revolutions;
        }
        ControlFlow::Continue(())
    }
}
