//! Irregular torque of a powder brake at low slip: chains of powder build up over the slip angle and break.
//!
//! Makers recommend at least 10 rpm of slip. Below, the torque rises steadily until the chains break at a random
//! threshold, drops by as much as it rose, and builds up anew: a saw-tooth of zero mean over the slip angle (so the
//! calibrated curve stays true) whose size grows in proportion to the slip that is missing.

use rand_distr::{Distribution, StandardUniform};
use rand_pcg::Pcg64Mcg;

/// A break is spread over this time by the powder's own inertia, s.
const RELEASE_S: f64 = 2e-3;
/// Thresholds lie evenly between these levels.
const THRESHOLDS: (f64, f64) = (0.5, 1.5);

/// The state of the powder.
#[derive(Debug, Clone)]
pub(super) struct StickSlip {
    ratio_at_rest: f64,
    inverse_limit_s_per_rad: f64,
    inverse_build_up_rad: f64,
    release: f64,
    level: f64,
    threshold: f64,
    output: f64,
    rng: Pcg64Mcg,
}

impl StickSlip {
    pub fn new(ratio_at_rest: f64, limit_rad_per_s: f64, build_up_rad: f64, rng: Pcg64Mcg) -> Self {
        Self {
            ratio_at_rest,
            inverse_limit_s_per_rad: 1.0 / limit_rad_per_s,
            inverse_build_up_rad: 1.0 / build_up_rad,
            release: 1.0,
            level: 0.0,
            threshold: 1.0,
            output: 0.0,
            rng,
        }
    }

    pub fn set_step(&mut self, dt_s: f64) {
        self.release = 1.0 - (-dt_s / RELEASE_S).exp();
    }

    /// Relative deviation of the torque while the brake slips `slip_rad` at `slip_rad_per_s` (both positive).
    #[inline]
    pub fn deviation(&mut self, slip_rad: f64, slip_rad_per_s: f64) -> f64 {
        let missing = 1.0 - slip_rad_per_s * self.inverse_limit_s_per_rad;
        let mut target = 0.0;
        if missing > 0.0 {
            self.level += slip_rad * self.inverse_build_up_rad;
            if self.level >= self.threshold {
                let draw: f64 = StandardUniform.sample(&mut self.rng);
                self.threshold = THRESHOLDS.0 + (THRESHOLDS.1 - THRESHOLDS.0) * draw;
                self.level = -self.threshold;
            }
            target = self.ratio_at_rest * missing * self.level;
        }
        self.output += self.release * (target - self.output);
        self.output
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// (mean, RMS) of the deviation at a steady slip.
    fn statistics(rpm: f64) -> (f64, f64) {
        let speed = rpm * std::f64::consts::TAU / 60.0;
        let mut powder = StickSlip::new(0.0175, 10.0 * std::f64::consts::TAU / 60.0, 0.01, Pcg64Mcg::seed_from_u64(5));
        powder.set_step(1e-4);
        let values: Vec<f64> = (0..2_000_000).map(|_| powder.deviation(speed * 1e-4, speed)).collect();
        let count = values.len() as f64;
        (values.iter().sum::<f64>() / count, (values.iter().map(|v| v * v).sum::<f64>() / count).sqrt())
    }

    #[test]
    fn irregularity_grows_as_the_slip_falls_and_ends_at_the_limit() {
        let sizes: Vec<f64> = [1.0, 2.5, 5.0, 7.5].map(|rpm| statistics(rpm).1).to_vec();
        assert!(sizes.windows(2).all(|pair| pair[0] > pair[1]), "{sizes:?}");
        assert!((sizes[2] - 0.005).abs() < 0.0005, "at 5 rpm: {}", sizes[2]);
        assert_eq!(statistics(12.0).1, 0.0);
    }

    #[test]
    fn the_mean_torque_is_that_of_the_curve() {
        let (mean, rms) = statistics(5.0);
        assert!(mean.abs() < 0.02 * rms, "{mean}");
    }
}
