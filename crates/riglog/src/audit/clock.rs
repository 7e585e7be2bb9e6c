//! Does time run forwards, and do the device's clock and the host's agree but for delay and drift?
//!
//! A batch cannot arrive before its last sample was taken, but may be late by any delay. So the difference host − device is looked at by its
//! least value in windows of device time: delays lie above it, and what moves it is a clock. A crystal drifts by some tens of ppm; a step is
//! a clock that was set.

use std::path::Path;

use super::{FindingKind, Findings};
use crate::proto::AngleBatch;

/// Windows of device time.
const WINDOW_NS: u64 = 10_000_000_000;
/// A least difference that changes by more from window to window is a clock that was set: no crystal drifts by 1 %.
const STEP_NS: i128 = 100_000_000;
/// Windows from which a drift can be told.
const FEWEST_WINDOWS: usize = 6;

/// Least difference of host and device in a window.
#[derive(Debug, Clone, Copy)]
struct Window {
    begins_ns: u64,
    at_ns: u64,
    least_ns: i128,
}

/// Follows both clocks through a log.
#[derive(Debug, Default)]
pub(super) struct ClockAudit {
    first_ns: Option<u64>,
    last_ns: Option<u64>,
    last_log_ns: Option<u64>,
    windows: Vec<Window>,
    largest_delay_ns: i128,
}

impl ClockAudit {
    /// Takes a batch that was validated and arrived at `log_ns`.
    pub(super) fn batch(&mut self, batch: &AngleBatch, log_ns: u64, path: &Path, findings: &mut Findings) {
        let Some(end_ns) = batch.last_time_ns() else { return };
        if let Some(before_ns) = self.last_ns.filter(|before_ns| batch.t0_ns <= *before_ns) {
            let what =
                format!("device time {} ns of sample {} is not after {before_ns} ns", batch.t0_ns, batch.first_sample);
            findings.add(FindingKind::Clock, path, what);
        }
        if let Some(before_ns) = self.last_log_ns.filter(|before_ns| log_ns < *before_ns) {
            let what =
                format!("host time runs back from {before_ns} ns to {log_ns} ns at sample {}", batch.first_sample);
            findings.add(FindingKind::Clock, path, what);
        }
        self.first_ns.get_or_insert(batch.t0_ns);
        (self.last_ns, self.last_log_ns) = (Some(end_ns), Some(log_ns));
        let ahead_ns = i128::from(log_ns) - i128::from(end_ns);
        match self.windows.last_mut() {
            Some(window) if end_ns.saturating_sub(window.begins_ns) < WINDOW_NS => {
                self.largest_delay_ns = self.largest_delay_ns.max(ahead_ns - window.least_ns);
                if ahead_ns < window.least_ns {
                    (window.least_ns, window.at_ns) = (ahead_ns, end_ns);
                }
            }
            _ => self.windows.push(Window { begins_ns: end_ns, at_ns: end_ns, least_ns: ahead_ns }),
        }
    }

    pub(super) fn end(&self, path: &Path, findings: &mut Findings) {
        for pair in self.windows.windows(2) {
            let step_ns = pair[1].least_ns - pair[0].least_ns;
            if step_ns.abs() > STEP_NS {
                let what = format!(
                    "host and device time move apart by {:.3} s between device times {} ns and {} ns: a clock was set",
                    step_ns as f64 * 1e-9,
                    pair[0].at_ns,
                    pair[1].at_ns
                );
                findings.add(FindingKind::Clock, path, what);
            }
        }
    }

    pub(super) fn device_s(&self) -> f64 {
        self.first_ns.zip(self.last_ns).map_or(0.0, |(first, last)| last.saturating_sub(first) as f64 * 1e-9)
    }

    pub(super) fn largest_delay_ms(&self) -> f64 {
        self.largest_delay_ns as f64 * 1e-6
    }

    /// Slope of the least differences by least squares: a host that gains on the device makes the device slow.
    pub(super) fn drift_ppm(&self) -> Option<f64> {
        let [first, .., _] = self.windows[..] else { return None };
        if self.windows.len() < FEWEST_WINDOWS {
            return None;
        }
        let points = self.windows.iter().map(|window| {
            let time_s = window.at_ns.saturating_sub(first.at_ns) as f64 * 1e-9;
            (time_s, (window.least_ns - first.least_ns) as f64 * 1e-9)
        });
        let n = self.windows.len() as f64;
        let (sum_t, sum_d) = points.clone().fold((0.0, 0.0), |(t, d), point| (t + point.0, d + point.1));
        let (mean_t, mean_d) = (sum_t / n, sum_d / n);
        let (sxy, sxx) = points
            .fold((0.0, 0.0), |(xy, xx), (t, d)| (xy + (t - mean_t) * (d - mean_d), xx + (t - mean_t) * (t - mean_t)));
        (sxx > 0.0).then(|| -1e6 * sxy / sxx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START_NS: u64 = 1_790_000_000_000_000_000;

    /// Batches of 10 ms over `seconds`; `arrives` gives the host's time, s, of a device time, s.
    fn watched(seconds: u64, arrives: impl Fn(f64) -> f64) -> (ClockAudit, Findings) {
        let (mut clock, mut findings) = (ClockAudit::default(), Findings::default());
        for n in 0..seconds * 100 {
            let t0_ns = START_NS + n * 10_000_000;
            let batch = AngleBatch {
                t0_ns,
                dt_ns: 1_000_000,
                first_sample: n * 10,
                input_delta: vec![0; 10],
                output_delta: vec![0; 10],
                ..AngleBatch::default()
            };
            let device_s = n as f64 * 0.01 + 0.009;
            let log_ns = START_NS + (arrives(device_s) * 1e9) as u64;
            clock.batch(&batch, log_ns, Path::new("x"), &mut findings);
        }
        clock.end(Path::new("x"), &mut findings);
        (clock, findings)
    }

    #[test]
    fn late_batches_are_no_drift_and_a_drifting_crystal_is_no_step() {
        // 50 ppm slow, every seventh batch up to 0.4 s late.
        let late = |t: f64| if ((t * 100.0) as u64).is_multiple_of(7) { 0.004 } else { 0.0 };
        let (clock, findings) = watched(300, |t| t * (1.0 + 50e-6) + 0.002 + late(t));
        assert!(findings.list.is_empty(), "{:?}", findings.list);
        let drift = clock.drift_ppm().unwrap();
        assert!((drift + 50.0).abs() < 1.0, "{drift}");
        assert!((clock.largest_delay_ms() - 4.0).abs() < 0.6, "{}", clock.largest_delay_ms());
    }

    #[test]
    fn a_clock_that_was_set_is_found_forwards_and_backwards() {
        for step in [0.5, -0.5] {
            let (_, findings) = watched(60, |t| t + 1.0 + if t > 30.0 { step } else { 0.0 });
            assert!(findings.list.iter().any(|finding| finding.kind == FindingKind::Clock), "{step}");
        }
        assert!(watched(60, |t| t + 1.0).1.list.is_empty());
    }
}
