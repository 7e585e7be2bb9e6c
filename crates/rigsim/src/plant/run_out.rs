//! Non-repeatable run-out of the bearings: why two revolutions are never quite alike.
//!
//! The gears' distance along the pitch line wanders as an Ornstein–Uhlenbeck process over the angle travelled, in
//! either sense: x ← x e^(−Δ/L) + σ √(1 − e^(−2Δ/L)) N(0, 1), drawn at knots and joined by straight lines.

use super::error::{PlantError, in_range};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// Knots per correlation length.
const KNOTS: f64 = 32.0;

/// Random disturbances of the mechanics.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseSpec {
    /// Non-repeatable run-out along the pitch line, mm RMS; at a driven radius of 72.5 mm the default makes 1 µrad.
    pub run_out_rms_mm: f64,
    /// Correlation length of the run-out in driver revolutions.
    pub run_out_correlation_rev: f64,
    /// Slower run-out, which varies from run to run, mm RMS.
    pub slow_run_out_rms_mm: f64,
    /// Its correlation length in driver revolutions.
    pub slow_run_out_correlation_rev: f64,
}

impl Default for NoiseSpec {
    fn default() -> Self {
        Self {
            run_out_rms_mm: 7.25e-5,
            run_out_correlation_rev: 0.3,
            slow_run_out_rms_mm: 0.0,
            slow_run_out_correlation_rev: 5.0,
        }
    }
}

impl NoiseSpec {
    pub(super) fn validate(&self) -> Result<(), PlantError> {
        let (size, length) = ((0.0, 0.1), (1e-3, 1e3));
        in_range("noise.run_out_rms_mm", self.run_out_rms_mm, "mm", size, "RMS along the pitch line")?;
        in_range("noise.slow_run_out_rms_mm", self.slow_run_out_rms_mm, "mm", size, "RMS along the pitch line")?;
        in_range("noise.run_out_correlation_rev", self.run_out_correlation_rev, "rev", length, "driver revolutions")?;
        let slow = self.slow_run_out_correlation_rev;
        in_range("noise.slow_run_out_correlation_rev", slow, "rev", length, "driver revolutions")
    }
}

/// The running process.
#[derive(Debug, Clone)]
pub(super) struct RunOut {
    rms_mm: f64,
    keep: f64,
    renew: f64,
    knots_per_rad: f64,
    from_mm: f64,
    to_mm: f64,
    progress: f64,
    rng: Pcg64Mcg,
}

impl RunOut {
    /// A process of this size that remembers itself over `correlation_rev` driver revolutions.
    pub fn new(rms_mm: f64, correlation_rev: f64, mut rng: Pcg64Mcg) -> Self {
        let keep = (-1.0 / KNOTS).exp();
        let renew = (1.0 - keep * keep).sqrt();
        let draw: f64 = StandardNormal.sample(&mut rng);
        let start = rms_mm * draw;
        Self {
            rms_mm,
            keep,
            renew,
            knots_per_rad: KNOTS / (TAU * correlation_rev),
            from_mm: start,
            to_mm: start,
            progress: 0.0,
            rng,
        }
    }

    /// Run-out after a further `travel_rad` of driver rotation (positive), mm.
    #[inline]
    pub fn advance(&mut self, travel_rad: f64) -> f64 {
        self.progress += travel_rad * self.knots_per_rad;
        while self.progress >= 1.0 {
            self.progress -= 1.0;
            let draw: f64 = StandardNormal.sample(&mut self.rng);
            self.from_mm = self.to_mm;
            self.to_mm = self.keep * self.to_mm + self.renew * self.rms_mm * draw;
        }
        self.from_mm + self.progress * (self.to_mm - self.from_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn the_process_has_its_size_and_its_memory() {
        let mut process = RunOut::new(7.25e-5, 0.3, Pcg64Mcg::seed_from_u64(9));
        let step = TAU / 100.0;
        let values: Vec<f64> = (0..400_000).map(|_| process.advance(step)).collect();
        let variance = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        assert!((variance.sqrt() / 7.25e-5 - 1.0).abs() < 0.05, "{}", variance.sqrt());
        let lagged = values.windows(31).map(|w| w[0] * w[30]).sum::<f64>() / values.len() as f64 / variance;
        assert!((lagged - (-1.0f64).exp()).abs() < 0.05, "{lagged}");
    }

    #[test]
    fn at_rest_nothing_moves() {
        let mut process = RunOut::new(7.25e-5, 0.3, Pcg64Mcg::seed_from_u64(9));
        let first = process.advance(0.4);
        assert_eq!(process.advance(0.0), first);
    }
}
