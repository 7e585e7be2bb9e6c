//! Streams the runs of a log as shaft angles, block by block: what replay stands on.

use std::{
    ops::{ControlFlow, Range},
    path::{Path, PathBuf},
};

use prost::Message;

use crate::{
    completeness::Completeness,
    error::LogError,
    metadata::{AngleScale, EncoderMetadata, RunMetadata},
    proto::AngleBatch,
    reader::{bad_message, open},
    runs::{RunSpan, RunTotals},
    survey::{Survey, survey},
    topic::Topic,
    walk::{Event, Walk},
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

/// A log whose runs are known and can be streamed, as often as wanted.
#[derive(Debug, Clone)]
pub struct RunStream {
    path: PathBuf,
    survey: Survey,
}

impl RunStream {
    /// Walks over the log once to learn its runs, wherever their states stand among the samples.
    ///
    /// # Errors
    /// The file is no rig log, or a state or an encoder record in it makes no sense.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref().to_owned();
        let survey = survey(&path)?;
        Ok(Self { path, survey })
    }

    /// The runs, in order of time.
    pub fn runs(&self) -> &[RunSpan] {
        &self.survey.spans
    }

    /// What was run, as far as the log says.
    pub fn metadata(&self) -> Option<&RunMetadata> {
        self.survey.run.as_ref()
    }

    /// The encoders as first homed.
    pub fn encoders(&self) -> Option<&EncoderMetadata> {
        self.survey.encoders.as_ref()
    }

    /// Device time of the first sample in the file.
    pub fn start_ns(&self) -> Option<u64> {
        self.survey.first_sample_ns
    }

    /// Whether the log is whole.
    pub fn completeness(&self) -> &Completeness {
        &self.survey.completeness
    }

    /// The content of an attachment, as `pair.toml`; the last one of that name. `None` also above 1 MiB.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.survey.attachments.iter().rev().find(|a| a.name == name)?.data.as_deref()
    }

    pub(crate) fn survey(&self) -> &Survey {
        &self.survey
    }

    /// Streams every run to `visitor`.
    ///
    /// # Errors
    /// The log holds runs but no encoders, or a batch does not decode or jumps back in time.
    pub fn stream(&self, visitor: &mut impl RunVisitor) -> Result<StreamTotals, LogError> {
        match self.survey.encoders {
            Some(encoders) => self.drive(&encoders, visitor),
            None if self.survey.spans.is_empty() => self.drive(&NO_ENCODERS, visitor),
            None => Err(LogError::NoEncoders { path: self.path.clone() }),
        }
    }

    /// Counts samples and losses; without encoders, revolutions mean nothing.
    pub(crate) fn count(&self) -> Result<StreamTotals, LogError> {
        struct Nobody;
        impl RunVisitor for Nobody {
            fn samples(&mut self, _: usize, _: &SampleBlock<'_>) -> ControlFlow<()> {
                ControlFlow::Continue(())
            }
        }
        self.drive(&self.survey.encoders.unwrap_or(NO_ENCODERS), &mut Nobody)
    }

    fn drive(&self, encoders: &EncoderMetadata, visitor: &mut impl RunVisitor) -> Result<StreamTotals, LogError> {
        let (source, bytes) = open(&self.path)?;
        let mut walk = Walk::new(source, bytes, &self.path)?;
        let mut state = Streaming {
            spans: &self.survey.spans,
            visitor,
            theta1: encoders.theta1(),
            theta2: encoders.theta2(),
            totals: vec![Tally::default(); self.survey.spans.len()],
            under_way: None,
            previous: None,
            columns: Columns::default(),
            samples_in_file: 0,
            losses_in_file: 0,
        };
        let mut batch = AngleBatch::default();
        let mut flow = ControlFlow::Continue(());
        while flow.is_continue() {
            match walk.next()? {
                None => break,
                Some(Event::Message { chunk_at, topic: Some(topic @ Topic::Angles), message }) => {
                    // Cleared, the vectors keep their memory from batch to batch.
                    batch.clear();
                    batch
                        .merge(message.data)
                        .map_err(|source| bad_message(&self.path, topic, message.log_time_ns, chunk_at, source))?;
                    batch.validate()?;
                    state.check_time(&batch, &self.path)?;
                    flow = state.batch(&batch);
                }
                Some(Event::Metadata { name, map }) if name == EncoderMetadata::NAME => {
                    let encoders = EncoderMetadata::from_map(&map)?;
                    (state.theta1, state.theta2) = (encoders.theta1(), encoders.theta2());
                }
                Some(_) => {}
            }
        }
        if flow.is_continue() {
            let _ = state.end_run();
        }
        let completeness = walk.completeness().unwrap_or(&self.survey.completeness).clone();
        Ok(state.finish(completeness))
    }
}

/// Counts taken for angles: for logs whose runs nobody asks the angles of.
const NO_ENCODERS: EncoderMetadata = EncoderMetadata {
    input_counts_per_rev: 1,
    output_counts_per_rev: 1,
    input_lines: 1,
    output_lines: 1,
    input_index_counts: 0,
    output_index_counts: 0,
    input_sign: 1,
    output_sign: 1,
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

struct Streaming<'a, V> {
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

impl<V: RunVisitor> Streaming<'_, V> {
    fn check_time(&self, batch: &AngleBatch, path: &Path) -> Result<(), LogError> {
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

    fn batch(&mut self, batch: &AngleBatch) -> ControlFlow<()> {
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

    fn end_run(&mut self) -> ControlFlow<()> {
        match self.under_way.take() {
            Some(run) => self.visitor.run_end(run, &self.spans[run], &self.totals[run].totals),
            None => ControlFlow::Continue(()),
        }
    }

    fn finish(self, completeness: Completeness) -> StreamTotals {
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
