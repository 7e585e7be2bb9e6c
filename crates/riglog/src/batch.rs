//! Batches of raw encoder counts: building them from samples, and taking them apart again.
//!
//! Sample n of a batch: counts = base + Σ delta\[0..=n\], time = t0 + n·dt, exactly.

use crate::{error::BatchError, proto::AngleBatch};

impl AngleBatch {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.input_delta.len()
    }

    /// Whether the batch holds no sample.
    pub fn is_empty(&self) -> bool {
        self.input_delta.is_empty()
    }

    /// The samples as (device time in ns, input counts, output counts).
    ///
    /// # Errors
    /// The numbers of deltas differ, or counts, time or sample numbers would leave 64 bits.
    pub fn samples(&self) -> Result<impl ExactSizeIterator<Item = (u64, i64, i64)> + '_, BatchError> {
        self.validate()?;
        let (mut time_ns, dt_ns) = (self.t0_ns, u64::from(self.dt_ns));
        let (mut input, mut output) = (self.input_base, self.output_base);
        Ok(self.input_delta.iter().zip(&self.output_delta).map(move |(&di, &d_o)| {
            input += i64::from(di);
            output += i64::from(d_o);
            let sample = (time_ns, input, output);
            // The step past the last sample may leave the range that was validated.
            time_ns = time_ns.wrapping_add(dt_ns);
            sample
        }))
    }

    /// Checks once what makes every sample computable, so that the loop over samples need not.
    ///
    /// # Errors
    /// As [`AngleBatch::samples`].
    pub fn validate(&self) -> Result<(), BatchError> {
        let (samples, first_sample) = (self.input_delta.len(), self.first_sample);
        if samples != self.output_delta.len() {
            let (input, output) = (samples, self.output_delta.len());
            return Err(BatchError::Lengths { first_sample, input, output });
        }
        let range = |quantity, start| BatchError::Range { first_sample, quantity, start, samples };
        // A delta has 32 bits, so no sum of n of them leaves ±n·2³¹.
        let reach = (samples as i128) << 31;
        for (quantity, base) in [("input counts", self.input_base), ("output counts", self.output_base)] {
            let base = i128::from(base);
            if base + reach > i128::from(i64::MAX) || base - reach < i128::from(i64::MIN) {
                return Err(range(quantity, base));
            }
        }
        let steps = samples.saturating_sub(1) as u128;
        if u128::from(self.t0_ns) + steps * u128::from(self.dt_ns) > u128::from(u64::MAX) {
            return Err(range("time", self.t0_ns.into()));
        }
        if first_sample.checked_add(samples as u64).is_none() {
            return Err(range("sample number", first_sample.into()));
        }
        Ok(())
    }

    /// Device time of the last sample in ns; `None` for an empty batch or one that leaves 64 bits.
    pub fn last_time_ns(&self) -> Option<u64> {
        let steps = (self.len() as u64).checked_sub(1)?;
        self.t0_ns.checked_add(steps.checked_mul(self.dt_ns.into())?)
    }
}

/// Gathers samples into batches; a batch ends where it is full, where samples are missing, and
/// where the time step changes, because a batch states times by start and step alone.
#[derive(Debug)]
pub struct BatchBuilder {
    batch: AngleBatch,
    last: (u64, i64, i64),
    max_samples: usize,
}

impl BatchBuilder {
    /// A builder of batches of at most `max_samples` samples (at least one).
    pub fn new(max_samples: usize) -> Self {
        Self { batch: AngleBatch::default(), last: (0, 0, 0), max_samples: max_samples.max(1) }
    }

    /// Adds sample number `sample`, taken at device time `time_ns`. Returns the batch that this
    /// sample completes or, where the sample does not continue it, the batch before it.
    pub fn push(&mut self, sample: u64, time_ns: u64, input_counts: i64, output_counts: i64) -> Option<AngleBatch> {
        let mut done = None;
        if !self.append(sample, time_ns, input_counts, output_counts) {
            done = self.take();
            self.start(sample, time_ns, input_counts, output_counts);
        }
        // With one sample a batch, a sample that follows a gap leaves nothing behind to return.
        if done.is_none() && self.batch.len() >= self.max_samples {
            done = self.take();
        }
        done
    }

    /// Ends the batch under way, as at the edges of a run.
    pub fn take(&mut self) -> Option<AngleBatch> {
        if self.batch.is_empty() {
            return None;
        }
        let room = self.batch.len();
        let next = AngleBatch {
            input_delta: Vec::with_capacity(room),
            output_delta: Vec::with_capacity(room),
            ..AngleBatch::default()
        };
        Some(std::mem::replace(&mut self.batch, next))
    }

    /// Number of samples in the batch under way.
    pub fn pending(&self) -> usize {
        self.batch.len()
    }

    fn start(&mut self, sample: u64, time_ns: u64, input: i64, output: i64) {
        self.batch.t0_ns = time_ns;
        self.batch.dt_ns = 0;
        self.batch.first_sample = sample;
        self.batch.input_base = input;
        self.batch.output_base = output;
        self.batch.input_delta.push(0);
        self.batch.output_delta.push(0);
        self.last = (time_ns, input, output);
    }

    /// Adds the sample where it continues the batch exactly; otherwise leaves the batch alone.
    fn append(&mut self, sample: u64, time_ns: u64, input: i64, output: i64) -> bool {
        let batch = &mut self.batch;
        let len = batch.len();
        if len == 0 || len >= self.max_samples {
            return false;
        }
        if batch.first_sample.checked_add(len as u64) != Some(sample) {
            return false;
        }
        let step = time_ns.checked_sub(self.last.0).and_then(|dt| u32::try_from(dt).ok());
        let deltas = input
            .checked_sub(self.last.1)
            .and_then(|d| i32::try_from(d).ok())
            .zip(output.checked_sub(self.last.2).and_then(|d| i32::try_from(d).ok()));
        let (Some(dt_ns), Some((delta_in, delta_out))) = (step, deltas) else { return false };
        // The first pair sets the step.
        if len > 1 && dt_ns != batch.dt_ns {
            return false;
        }
        batch.dt_ns = dt_ns;
        batch.input_delta.push(delta_in);
        batch.output_delta.push(delta_out);
        self.last = (time_ns, input, output);
        true
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn build(samples: &[(u64, u64, i64, i64)], max: usize) -> Vec<AngleBatch> {
        let mut builder = BatchBuilder::new(max);
        let mut batches: Vec<_> = samples.iter().filter_map(|&(n, t, i, o)| builder.push(n, t, i, o)).collect();
        batches.extend(builder.take());
        batches
    }

    #[test]
    fn a_steady_stream_fills_batches_to_the_brim() {
        let samples: Vec<_> = (0..25u64).map(|n| (n, 1000 + n * 100, n as i64 * 60, -(n as i64) * 30)).collect();
        let batches = build(&samples, 10);
        assert_eq!(batches.iter().map(AngleBatch::len).collect::<Vec<_>>(), [10, 10, 5]);
        assert!(batches.iter().all(|b| b.input_delta[0] == 0 && b.dt_ns == 100));
        assert_eq!(batches[1].first_sample, 10);
        assert_eq!(batches[2].last_time_ns(), Some(1000 + 24 * 100));
    }

    #[test]
    fn a_missing_sample_and_a_changed_step_begin_a_batch() {
        let batches = build(&[(0, 0, 0, 0), (1, 10, 1, 1), (3, 30, 3, 3), (4, 39, 4, 4)], 100);
        assert_eq!(batches.iter().map(|b| b.first_sample).collect::<Vec<_>>(), [0, 3]);
        let batches = build(&[(0, 0, 0, 0), (1, 10, 1, 1), (2, 21, 2, 2), (3, 32, 3, 3)], 100);
        assert_eq!(batches.iter().map(|b| b.first_sample).collect::<Vec<_>>(), [0, 2]);
    }

    #[test]
    fn unequal_lengths_and_overflows_are_named() {
        let short = AngleBatch { input_delta: vec![0, 1], output_delta: vec![0], ..Default::default() };
        assert!(matches!(short.samples().err(), Some(BatchError::Lengths { input: 2, output: 1, .. })));
        let full = AngleBatch { input_delta: vec![0], output_delta: vec![0], ..Default::default() };
        let counts = AngleBatch { input_base: i64::MAX, ..full.clone() };
        assert!(matches!(counts.samples().err(), Some(BatchError::Range { quantity: "input counts", .. })));
        let number = AngleBatch { first_sample: u64::MAX, ..full };
        assert!(matches!(number.samples().err(), Some(BatchError::Range { quantity: "sample number", .. })));
    }

    proptest! {
        // Whatever a device sends, the batches give back exactly what went in, in order.
        #[test]
        fn batches_give_back_what_went_in(
            steps in prop::collection::vec((0u64..3, 0u64..1 << 33, any::<i64>(), -200i64..200), 1..200),
            max in 1usize..50,
        ) {
            let (mut n, mut t, mut o) = (0, 0, 0);
            let mut samples = Vec::new();
            for (jump, dt, input, d_out) in steps {
                n += jump;
                t += dt;
                o += d_out;
                samples.push((n, t, input >> 8, o));
            }
            let mut out = Vec::new();
            for batch in build(&samples, max) {
                prop_assert!(batch.len() <= max);
                for (k, (t, i, o)) in batch.samples().unwrap().enumerate() {
                    out.push((batch.first_sample + k as u64, t, i, o));
                }
            }
            prop_assert_eq!(out, samples);
        }
    }
}
