//! Samples of both encoders, whichever reader they come from.

/// A batch of samples, both counters latched, or brought, to the same instants.
///
/// Sample n of the batch was taken at `device_time_ns + n·dt_ns`; its counts are the base plus the deltas up to and
/// including n, in two's complement. The first delta is 0.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Samples {
    /// Frame number since start, of a reader that sends frames; a jump is a lost frame.
    pub sequence: u32,
    /// The reader's time of the first sample, ns.
    pub device_time_ns: u64,
    /// Time between samples, ns.
    pub dt_ns: u32,
    /// Number of the first sample since start; a jump is a loss of samples.
    pub first_sample: u64,
    /// What happened since the last batch.
    pub flags: SampleFlags,
    /// Input count at the latest index pulse; valid once [`SampleFlags::INPUT_INDEX`] was set since start.
    pub input_index_counts: i64,
    /// Output count at the latest index pulse; valid once [`SampleFlags::OUTPUT_INDEX`] was set since start.
    pub output_index_counts: i64,
    /// Input count of the first sample.
    pub input_base: i64,
    /// Output count of the first sample.
    pub output_base: i64,
    /// Differences of the input count; as many as samples, the first 0.
    pub input_delta: Vec<i32>,
    /// Differences of the output count; as many as samples, the first 0.
    pub output_delta: Vec<i32>,
}

impl Samples {
    /// Samples in the batch.
    pub fn len(&self) -> usize {
        self.input_delta.len()
    }

    /// Whether the batch has no samples.
    pub fn is_empty(&self) -> bool {
        self.input_delta.is_empty()
    }

    /// Input counts, sample by sample.
    pub fn input_counts(&self) -> impl Iterator<Item = i64> + '_ {
        running(self.input_base, &self.input_delta)
    }

    /// Output counts, sample by sample.
    pub fn output_counts(&self) -> impl Iterator<Item = i64> + '_ {
        running(self.output_base, &self.output_delta)
    }
}

fn running(base: i64, deltas: &[i32]) -> impl Iterator<Item = i64> + '_ {
    deltas.iter().scan(base, |count, delta| {
        *count = count.wrapping_add(i64::from(*delta));
        Some(*count)
    })
}

/// What happened since the last batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct SampleFlags(pub u16);

impl SampleFlags {
    /// The input index pulse passed; `input_index_counts` is fresh.
    pub const INPUT_INDEX: u16 = 1 << 0;
    /// The output index pulse passed; `output_index_counts` is fresh.
    pub const OUTPUT_INDEX: u16 = 1 << 1;
    /// The line was too slow: samples before this batch are lost.
    pub const OVERFLOW: u16 = 1 << 2;
    /// The input encoder's signals were bad.
    pub const INPUT_FAULT: u16 = 1 << 3;
    /// The output encoder's signals were bad.
    pub const OUTPUT_FAULT: u16 = 1 << 4;

    /// Whether all of these bits are set.
    pub fn has(self, bits: u16) -> bool {
        self.0 & bits == bits
    }

    /// Sets bits.
    pub fn set(&mut self, bits: u16) {
        self.0 |= bits;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_run_from_the_base() {
        let samples = Samples {
            input_base: 100,
            output_base: i64::MAX,
            input_delta: vec![0, 3, -1],
            output_delta: vec![0, 1, -1],
            ..Samples::default()
        };
        assert_eq!(samples.input_counts().collect::<Vec<_>>(), [100, 103, 102]);
        // A counter wraps; it does not panic.
        assert_eq!(samples.output_counts().collect::<Vec<_>>(), [i64::MAX, i64::MIN, i64::MAX]);
    }
}
