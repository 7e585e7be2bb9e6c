//! The host's clock: monotonic, anchored once to the Unix epoch, so that a step of the system's clock never reaches a log.
//!
//! Under a paused runtime it runs on simulated time from a fixed date; two runs with one seed then carry equal time stamps.

use std::time::{SystemTime, UNIX_EPOCH};

use tokio::time::Instant;

/// 2026-01-01T00:00:00Z, where simulated time begins, ns since the Unix epoch.
const SIMULATED_EPOCH_NS: u64 = 1_767_225_600_000_000_000;

/// Nanoseconds since the Unix epoch, by the runtime's clock.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    anchor_ns: u64,
    start: Instant,
    simulated: bool,
}

impl Clock {
    /// Wall-clock time.
    #[must_use]
    pub fn real() -> Self {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { anchor_ns: since_epoch.as_nanos() as u64, start: Instant::now(), simulated: false }
    }

    /// Simulated time.
    #[must_use]
    pub fn simulated() -> Self {
        Self::simulated_after(0)
    }

    /// Simulated time that goes on after `ns`: a campaign that is taken up again keeps one time for all its logs.
    #[must_use]
    pub fn simulated_after(ns: u64) -> Self {
        Self { anchor_ns: SIMULATED_EPOCH_NS.max(ns), start: Instant::now(), simulated: true }
    }

    /// Time does not pass by itself.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        self.simulated
    }

    /// Now, ns since the Unix epoch.
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.anchor_ns + self.elapsed_ns()
    }

    /// Since the clock was made, ns.
    #[must_use]
    pub fn elapsed_ns(&self) -> u64 {
        self.start.elapsed().as_nanos() as u64
    }
}
