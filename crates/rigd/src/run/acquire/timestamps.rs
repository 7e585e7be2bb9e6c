//! When samples were taken, and which they are: the counter's own time and numbers as the log has them.

use wire::Samples;

/// The counter's clock and numbers against the log's.
#[derive(Debug, Default)]
pub(super) struct Timestamps {
    /// Unix time minus device time, ns.
    device_offset_ns: Option<i128>,
    /// Running number in the log minus the counter's own.
    number_offset: u64,
    /// The counter begins anew: it numbers its samples from 0.
    restarts: bool,
}

/// What the log had before a batch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Before {
    /// Number after the last sample.
    pub next_sample: u64,
    /// Time of the last sample, ns.
    pub sample_ns: u64,
    /// Something was sampled ever.
    pub any: bool,
}

/// A batch's first sample in the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dated {
    /// Unix time, ns.
    pub first_ns: u64,
    /// Running number.
    pub first_sample: u64,
    /// The counter had begun anew.
    pub restarted: bool,
}

impl Timestamps {
    /// The counter is lost: what it streams when it is back is dated and numbered anew.
    pub fn restart(&mut self) {
        self.restarts = true;
    }

    /// Dates and numbers a batch, which is not empty. A counter that begins anew is dated by when its first batch arrives, and numbered
    /// after the samples that are missing meanwhile.
    pub fn date(&mut self, batch: &Samples, arrived_ns: u64, before: Before) -> Dated {
        let last_device_ns = batch.device_time_ns + (batch.len() as u64 - 1) * u64::from(batch.dt_ns);
        let offset_now = i128::from(arrived_ns) - i128::from(last_device_ns);
        let restarted = std::mem::take(&mut self.restarts);
        if restarted {
            self.device_offset_ns = None;
            // Nothing was sent before the first sample that there ever was.
            let first_ns = (i128::from(batch.device_time_ns) + offset_now).max(0) as u64;
            let dt_ns = u64::from(batch.dt_ns.max(1));
            // To the nearest: the end of an abandoned run lies a nanosecond past its last sample.
            let since_ns = first_ns.saturating_sub(before.sample_ns);
            let periods = if before.any { (since_ns + dt_ns / 2) / dt_ns } else { 1 };
            let number = before.next_sample + periods.max(1) - 1;
            self.number_offset = number.wrapping_sub(batch.first_sample);
        }
        let offset = *self.device_offset_ns.get_or_insert(offset_now);
        Dated {
            first_ns: (i128::from(batch.device_time_ns) + offset) as u64,
            first_sample: batch.first_sample.wrapping_add(self.number_offset),
            restarted,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// Ten samples, 1 ms apart.
    fn batch(first_sample: u64) -> Samples {
        let device_time_ns = first_sample * MS;
        let deltas = vec![0; 10];
        Samples {
            device_time_ns,
            dt_ns: 1_000_000,
            first_sample,
            input_delta: deltas.clone(),
            output_delta: deltas,
            ..Samples::default()
        }
    }

    #[test]
    fn the_first_batch_fixes_the_clock_and_later_ones_keep_it() {
        let mut timestamps = Timestamps::default();
        let none = Before { next_sample: 0, sample_ns: 0, any: false };
        let first = timestamps.date(&batch(0), 1000 * MS, none);
        assert_eq!(first, Dated { first_ns: 991 * MS, first_sample: 0, restarted: false });
        // 7 ms late on its way: its samples are dated by the counter's clock all the same.
        let before = Before { next_sample: 10, sample_ns: 1000 * MS, any: true };
        let second = timestamps.date(&batch(10), 1017 * MS, before);
        assert_eq!(second, Dated { first_ns: 1001 * MS, first_sample: 10, restarted: false });
    }

    #[test]
    fn a_counter_that_begins_anew_is_numbered_after_what_is_missing() {
        let mut timestamps = Timestamps::default();
        let _ = timestamps.date(&batch(0), 1000 * MS, Before { next_sample: 0, sample_ns: 0, any: false });
        timestamps.restart();
        // 100 ms pass without a sample; the batch's last one is 110 ms after the last before.
        let before = Before { next_sample: 10, sample_ns: 1000 * MS, any: true };
        let dated = timestamps.date(&batch(0), 1110 * MS, before);
        assert_eq!(dated, Dated { first_ns: 1101 * MS, first_sample: 110, restarted: true });
    }
}
