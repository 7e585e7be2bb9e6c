//! What a stream of runs delivers, and to whom.

use std::ops::ControlFlow;

use crate::{
    completeness::Completeness,
    runs::{RunSpan, RunTotals},
};

/// Samples of one run that follow each other without a gap; all slices are equally long.
#[derive(Debug, Clone, Copy)]
pub struct SampleBlock<'a> {
    /// Running number of the first sample in the file.
    pub first_sample: u64,
    /// Device times.
    pub time_ns: &'a [u64],
    /// Counts of the input encoder.
    pub input_counts: &'a [i64],
    /// Counts of the output encoder.
    pub output_counts: &'a [i64],
    /// Angles of the driver.
    pub theta1_rad: &'a [f64],
    /// Angles of the driven gear.
    pub theta2_rad: &'a [f64],
}

/// Receives the runs of a log in order; `Break` ends the stream early.
pub trait RunVisitor {
    /// The first samples of run `index` follow.
    fn run_start(&mut self, index: usize, span: &RunSpan) -> ControlFlow<()> {
        let _ = (index, span);
        ControlFlow::Continue(())
    }

    /// Samples of run `index`.
    fn samples(&mut self, index: usize, block: &SampleBlock<'_>) -> ControlFlow<()>;

    /// `missing` samples of run `index` were lost here.
    fn gap(&mut self, index: usize, missing: u64) -> ControlFlow<()> {
        let _ = (index, missing);
        ControlFlow::Continue(())
    }

    /// No more samples of run `index` follow.
    fn run_end(&mut self, index: usize, span: &RunSpan, totals: &RunTotals) -> ControlFlow<()> {
        let _ = (index, span, totals);
        ControlFlow::Continue(())
    }
}

/// What a stream delivered.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamTotals {
    /// Every run of the log with what was counted in it.
    pub runs: Vec<(RunSpan, RunTotals)>,
    /// Samples in the file, those outside of runs included.
    pub samples_in_file: u64,
    /// Samples missing in the file, those outside of runs included.
    pub losses_in_file: u64,
    /// Whether the log is whole.
    pub completeness: Completeness,
}

impl StreamTotals {
    /// Samples in runs.
    pub fn samples(&self) -> u64 {
        self.runs.iter().map(|(_, totals)| totals.samples).sum()
    }

    /// Samples missing in runs.
    pub fn losses(&self) -> u64 {
        self.runs.iter().map(|(_, totals)| totals.losses).fold(0, u64::saturating_add)
    }
}
