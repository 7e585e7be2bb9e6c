//! What happened on a line: the figures that the log, the summary and `rigd doctor` show.

use std::time::Duration;

use serde::Serialize;

/// What happened between a driver and its device so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct BusStatistics {
    /// Requests answered.
    pub answered: u64,
    /// Requests sent again.
    pub retried: u64,
    /// Answers that were late or never came.
    pub timeouts: u64,
    /// Answers that were damaged or did not fit.
    pub damaged: u64,
    /// Requests that the device refused.
    pub refused: u64,
    /// Writes that read back otherwise and were written again.
    pub rewritten: u64,
    /// Bytes that came when none were due: late, repeated or foreign answers, thrown away.
    pub stray_bytes: u64,
    /// Requests that waited because their answer could not have been told from one that might still come.
    pub waited: u64,
    /// Sum of all times from a request's last byte to its answer's last, µs.
    pub total_us: u64,
    /// The longest of them, µs.
    pub slowest_us: u64,
}

impl BusStatistics {
    /// Counts an answer that took so long.
    pub(super) fn answered_after(&mut self, time: Duration) {
        let us = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        self.answered += 1;
        self.total_us = self.total_us.saturating_add(us);
        self.slowest_us = self.slowest_us.max(us);
    }

    /// Mean time to an answer, ms; 0 before the first.
    #[must_use]
    pub fn mean_ms(&self) -> f64 {
        if self.answered == 0 { 0.0 } else { self.total_us as f64 / self.answered as f64 * 1e-3 }
    }
}

impl std::fmt::Display for BusStatistics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { answered, retried, timeouts, damaged, refused, rewritten, stray_bytes, slowest_us, .. } = self;
        write!(f, "{answered} requests answered, {retried} sent again ({timeouts} timed out, {damaged} damaged)")?;
        if refused + rewritten + stray_bytes > 0 {
            write!(f, ", {refused} refused, {rewritten} written again, {stray_bytes} stray bytes thrown away")?;
        }
        write!(f, "; mean {:.1} ms, slowest {:.1} ms", self.mean_ms(), *slowest_us as f64 * 1e-3)
    }
}
