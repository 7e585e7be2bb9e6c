//! From batches in file order to the samples of each run.

use std::{
    ops::{ControlFlow, Range},
    path::Path,
};

use crate::{
    completeness::Completeness,
    error::LogError,
    metadata::{AngleScale, EncoderMetadata},
    proto::AngleBatch,
    run_visitor::{RunVisitor, SampleBlock, StreamTotals},
    runs::{RunSpan, RunTotals},
};

#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    totals: RunTotals,
    first_theta1_rad: Option<f64>,
}

/// The columns of a block, reused.
#[derive(Default)]
struct Columns {
    time_ns: Vec<u64>,
    input_counts: Vec<i64>,
    output_counts: Vec<i64>,
    theta1_rad: Vec<f64>,
    theta2_rad: Vec<f64>,
}

/// Cuts batches into the samples of runs, and counts what is missing between them.
pub(super) struct Streaming<'a, V> {
    spans: &'a [RunSpan],
    visitor: &'a mut V,
    theta1: AngleScale,
    theta2: AngleScale,
    totals: Vec<Tally>,
    /// The run that was started last and not ended.
    under_way: Option<usize>,
    /// Number after the last sample, and its time.
    previous: Option<(u64, u64)>,
    columns: Columns,
    samples_in_file: u64,
    losses_in_file: u64,
}

impl<'a, V: RunVisitor> Streaming<'a, V> {
    pub(super) fn new(spans: &'a [RunSpan], encoders: &EncoderMetadata, visitor: &'a mut V) -> Self {
        Self {
            spans,
            visitor,
            theta1: encoders.theta1(),
            theta2: encoders.theta2(),
            totals: vec![Tally::default(); spans.len()],
            under_way: None,
            previous: None,
            columns: Columns::default(),
            samples_in_file: 0,
            losses_in_file: 0,
        }
    }

    pub(super) fn use_encoders(&mut self, encoders: &EncoderMetadata) {
        (self.theta1, self.theta2) = (encoders.theta1(), encoders.theta2());
    }

    /// Device time runs forwards, or no sample can be told to belong to a run.
    pub(super) fn check_time(&self, batch: &AngleBatch, path: &Path) -> Result<(), LogError> {
        match self.previous {
            Some((_, before_ns)) if !batch.is_empty() && batch.t0_ns < before_ns => Err(LogError::TimeReversed {
                path: path.to_owned(),
                first_sample: batch.first_sample,
                at_ns: batch.t0_ns,
                before_ns,
            }),
            _ => Ok(()),
        }
    }

    /// Delivers a batch that was validated.
    pub(super) fn batch(&mut self, batch: &AngleBatch) -> ControlFlow<()> {
        let Some(last_ns) = batch.last_time_ns() else { return ControlFlow::Continue(()) };
        self.losses(batch)?;
        self.previous = Some((batch.first_sample + batch.len() as u64, last_ns));
        self.samples_in_file += batch.len() as u64;
        // The first run that is not over before the batch begins.
        let mut run = self.spans.partition_point(|span| span.end_ns.is_some_and(|end_ns| end_ns <= batch.t0_ns));
        if self.spans.get(run).is_none_or(|span| span.start_ns > last_ns) {
            return ControlFlow::Continue(());
        }
        self.columns.fill(batch, self.theta1, self.theta2);
        while let Some(span) = self.spans.get(run).filter(|span| span.start_ns <= last_ns) {
            let range = samples_within(span, &self.columns.time_ns);
            if !range.is_empty() {
                self.deliver(run, batch.first_sample, range)?;
            }
            run += 1;
        }
        ControlFlow::Continue(())
    }

    fn deliver(&mut self, run: usize, first_of_batch: u64, range: Range<usize>) -> ControlFlow<()> {
        if self.under_way != Some(run) {
            self.end_run()?;
            self.visitor.run_start(run, &self.spans[run])?;
            self.under_way = Some(run);
        }
        let columns = &self.columns;
        let block = SampleBlock {
            first_sample: first_of_batch + range.start as u64,
            time_ns: &columns.time_ns[range.clone()],
            input_counts: &columns.input_counts[range.clone()],
            output_counts: &columns.output_counts[range.clone()],
            theta1_rad: &columns.theta1_rad[range.clone()],
            theta2_rad: &columns.theta2_rad[range],
        };
        let tally = &mut self.totals[run];
        tally.totals.samples += block.time_ns.len() as u64;
        if let [first, ..] = block.theta1_rad
            && let [.., last] = block.theta1_rad
        {
            let first_rad = *tally.first_theta1_rad.get_or_insert(*first);
            tally.totals.revolutions = (last - first_rad).abs() / std::f64::consts::TAU;
        }
        self.visitor.samples(run, &block)
    }

    /// Counts the samples missing before `batch`, each to the run whose time it would have had.
    fn losses(&mut self, batch: &AngleBatch) -> ControlFlow<()> {
        let Some((expected, before_ns)) = self.previous else { return ControlFlow::Continue(()) };
        let missing = batch.first_sample.saturating_sub(expected);
        if missing == 0 {
            return ControlFlow::Continue(());
        }
        self.losses_in_file = self.losses_in_file.saturating_add(missing);
        for (run, span) in self.spans.iter().enumerate() {
            let gap = Gap { missing, before_ns, after_ns: batch.t0_ns };
            let upto = span.end_ns.map_or(missing, |end_ns| gap.earlier_than(end_ns));
            let lost = upto.saturating_sub(gap.earlier_than(span.start_ns));
            if lost > 0 {
                let losses = &mut self.totals[run].totals.losses;
                *losses = losses.saturating_add(lost);
                if self.under_way == Some(run) {
                    self.visitor.gap(run, lost)?;
                }
            }
        }
        ControlFlow::Continue(())
    }

    pub(super) fn end_run(&mut self) -> ControlFlow<()> {
        match self.under_way.take() {
            Some(run) => self.visitor.run_end(run, &self.spans[run], &self.totals[run].totals),
            None => ControlFlow::Continue(()),
        }
    }

    pub(super) fn finish(self, completeness: Completeness) -> StreamTotals {
        let totals = self.totals.iter().map(|tally| tally.totals);
        StreamTotals {
            runs: self.spans.iter().copied().zip(totals).collect(),
            samples_in_file: self.samples_in_file,
            losses_in_file: self.losses_in_file,
            completeness,
        }
    }
}

impl Columns {
    fn fill(&mut self, batch: &AngleBatch, theta1: AngleScale, theta2: AngleScale) {
        self.time_ns.clear();
        self.time_ns.extend((0..batch.len() as u64).map(|n| batch.t0_ns + n * u64::from(batch.dt_ns)));
        accumulate(&mut self.input_counts, batch.input_base, &batch.input_delta);
        accumulate(&mut self.output_counts, batch.output_base, &batch.output_delta);
        self.theta1_rad.clear();
        self.theta1_rad.extend(self.input_counts.iter().map(|&counts| theta1.angle_rad(counts)));
        self.theta2_rad.clear();
        self.theta2_rad.extend(self.output_counts.iter().map(|&counts| theta2.angle_rad(counts)));
    }
}

/// counts\[n\] = base + Σ delta\[0..=n\]; the batch was validated, so no sum leaves 64 bits.
fn accumulate(counts: &mut Vec<i64>, base: i64, deltas: &[i32]) {
    counts.clear();
    counts.extend(deltas.iter().scan(base, |sum, &delta| {
        *sum += i64::from(delta);
        Some(*sum)
    }));
}

/// Which of the increasing `times_ns` lie in the run.
fn samples_within(span: &RunSpan, times_ns: &[u64]) -> Range<usize> {
    let start = times_ns.partition_point(|&t| t < span.start_ns);
    let end = span.end_ns.map_or(times_ns.len(), |end_ns| times_ns.partition_point(|&t| t < end_ns));
    start..end.max(start)
}

/// Missing samples between two that are there; number k of them is taken to lie at
/// t_k = before + k·(after − before)/(missing + 1).
struct Gap {
    missing: u64,
    before_ns: u64,
    after_ns: u64,
}

impl Gap {
    /// How many of them lie before `time_ns`.
    fn earlier_than(&self, time_ns: u64) -> u64 {
        let length = u128::from(self.after_ns.saturating_sub(self.before_ns));
        let elapsed = u128::from(time_ns.saturating_sub(self.before_ns));
        if elapsed == 0 {
            return 0;
        }
        if elapsed >= length {
            return self.missing;
        }
        // k·length < elapsed·(missing + 1)
        let product = elapsed * (u128::from(self.missing) + 1);
        let count = product.div_ceil(length) - 1;
        u64::try_from(count).unwrap_or(u64::MAX).min(self.missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_samples_fall_evenly_between_their_neighbours() {
        // Numbers 1, 2, 3 are missing between times 100 and 140: they would lie at 110, 120, 130.
        let gap = Gap { missing: 3, before_ns: 100, after_ns: 140 };
        let counts = [100, 110, 111, 120, 121, 130, 131, 140, 999].map(|t| gap.earlier_than(t));
        assert_eq!(counts, [0, 0, 1, 1, 2, 2, 3, 3, 3]);
    }

    #[test]
    fn absurd_gaps_of_foreign_files_do_not_overflow() {
        let gap = Gap { missing: u64::MAX, before_ns: 0, after_ns: u64::MAX };
        assert_eq!(gap.earlier_than(u64::MAX), u64::MAX);
        assert!(gap.earlier_than(u64::MAX / 2) >= u64::MAX / 2 - 1);
    }
}
