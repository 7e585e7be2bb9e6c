//! A batch as counts, sample by sample, and its parts as messages of the log.

use riglog::proto::AngleBatch;
use wire::Samples;

/// Counts of a batch's samples, as logged; reused from batch to batch.
#[derive(Debug, Default)]
pub(super) struct Counts {
    pub inputs: Vec<i64>,
    pub outputs: Vec<i64>,
}

impl Counts {
    /// Takes a batch, whose counts are logged so much higher.
    pub fn fill(&mut self, batch: &Samples, [input_offset, output_offset]: [i64; 2]) {
        accumulate(batch.input_base.wrapping_add(input_offset), &batch.input_delta, &mut self.inputs);
        accumulate(batch.output_base.wrapping_add(output_offset), &batch.output_delta, &mut self.outputs);
    }

    /// Samples of the batch.
    pub fn len(&self) -> usize {
        self.inputs.len()
    }

    /// Counts of the last sample.
    pub fn last(&self) -> [i64; 2] {
        [&self.inputs, &self.outputs].map(|counts| counts.last().copied().unwrap_or_default())
    }

    /// Samples `from..to` of the batch as a message of their own; the batch's first sample is number `first_sample`, taken at `first_ns`.
    pub fn part(
        &self,
        batch: &Samples,
        [first_ns, first_sample]: [u64; 2],
        from: usize,
        to: usize,
    ) -> Option<AngleBatch> {
        if from == to {
            return None;
        }
        let deltas = |all: &[i32]| {
            let mut part = all[from..to].to_vec();
            part[0] = 0;
            part
        };
        Some(AngleBatch {
            t0_ns: first_ns + from as u64 * u64::from(batch.dt_ns),
            dt_ns: batch.dt_ns,
            first_sample: first_sample + from as u64,
            input_base: self.inputs[from],
            output_base: self.outputs[from],
            input_delta: deltas(&batch.input_delta),
            output_delta: deltas(&batch.output_delta),
        })
    }
}

/// Counts from a base and the steps between samples; the first step is 0.
fn accumulate(base: i64, deltas: &[i32], counts: &mut Vec<i64>) {
    counts.clear();
    let mut value = base;
    counts.extend(deltas.iter().map(|delta| {
        value += i64::from(*delta);
        value
    }));
}
