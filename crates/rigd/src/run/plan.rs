//! What one `rigd run` shall measure.

use gearmodel::Direction;
use riglog::RunMetadata;

/// What a run shall measure.
#[derive(Debug, Clone, PartialEq)]
pub struct RunPlan {
    /// Senses, in their order.
    pub directions: Vec<Direction>,
    /// Loads at the driven gear, N·m, in their order.
    pub loads_nm: Vec<f64>,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Whole revolutions of the driver to record, each.
    pub revolutions: f64,
    /// Sampling, Hz.
    pub rate_hz: f64,
    /// The operator accepts a drive that has no watchdog of its own.
    pub accept_no_watchdog: bool,
}

impl RunPlan {
    /// What the log says of it.
    #[must_use]
    pub fn conditions(&self) -> RunMetadata {
        let directions: Vec<_> = self.directions.iter().map(ToString::to_string).collect();
        RunMetadata {
            direction: directions.join(","),
            load_nm: self.loads_nm.clone(),
            speed_rpm: vec![self.speed_rpm],
            revolutions: Some(self.revolutions),
            ..RunMetadata::default()
        }
    }
}
