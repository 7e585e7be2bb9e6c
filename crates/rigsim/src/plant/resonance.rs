//! A soft coupling between the output shaft and its encoder: the disc swings on it, driven by the shaft's uneven motion.
//!
//! ẍ + 2ζω ẋ + ω² x = −q̈ for the twist x of the coupling, q the shaft. Far below the resonance the twist is −q̈/ω²: once a turn on a
//! non-circular pair, with the square of the speed; near it a tooth mesh is amplified.

use super::error::{PlantError, in_range};
use std::f64::consts::TAU;

/// The encoder's coupling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftCouplingSpec {
    /// Resonance of the disc on its coupling, Hz.
    pub f_hz: f64,
    /// Damping ratio.
    pub zeta: f64,
}

impl SoftCouplingSpec {
    pub(super) fn validate(&self) -> Result<(), PlantError> {
        in_range("encoders.output_coupling.f_hz", self.f_hz, "Hz", (0.5, 300.0), "of the disc on its coupling")?;
        in_range("encoders.output_coupling.zeta", self.zeta, "", (1e-3, 2.0), "1 is critical")
    }
}

/// The swinging disc.
#[derive(Debug, Clone)]
pub(super) struct SoftCoupling {
    spec: SoftCouplingSpec,
    twist_rad: f64,
    rate_rad_per_s: f64,
    shaft_rad_per_s: f64,
}

impl SoftCoupling {
    pub fn new(spec: SoftCouplingSpec, shaft_rad_per_s: f64) -> Self {
        Self { spec, twist_rad: 0.0, rate_rad_per_s: 0.0, shaft_rad_per_s }
    }

    /// Advances by `h`; the shaft turns at `shaft_rad_per_s` at the end of the step. Gives the disc's lead over the shaft, rad.
    #[inline]
    pub fn advance(&mut self, h: f64, shaft_rad_per_s: f64) -> f64 {
        let omega = TAU * self.spec.f_hz;
        // Symplectic: the speed first, then the angle with the new speed; ω h is under 0.2.
        self.rate_rad_per_s -= shaft_rad_per_s - self.shaft_rad_per_s;
        self.rate_rad_per_s -= h * omega * omega * self.twist_rad;
        self.rate_rad_per_s /= 1.0 + 2.0 * h * self.spec.zeta * omega;
        self.shaft_rad_per_s = shaft_rad_per_s;
        self.twist_rad += h * self.rate_rad_per_s;
        self.twist_rad
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Amplitude of the twist under q = sin(w t).
    fn response(f_hz: f64, zeta: f64, drive_hz: f64) -> f64 {
        let w = TAU * drive_hz;
        let mut coupling = SoftCoupling::new(SoftCouplingSpec { f_hz, zeta }, w);
        let h = 1e-4;
        let mut largest: f64 = 0.0;
        for n in 1..400_000 {
            let t = f64::from(n) * h;
            let twist = coupling.advance(h, w * (w * t).cos());
            if t > 30.0 {
                largest = largest.max(twist.abs());
            }
        }
        largest
    }

    #[test]
    fn the_twist_is_the_textbooks_relative_motion() {
        for (f, zeta, drive) in [(10.0, 0.05, 0.5), (10.0, 0.1, 10.0), (10.0, 0.1, 30.0)] {
            let r: f64 = drive / f;
            let expected = r * r / ((1.0 - r * r).powi(2) + (2.0 * zeta * r).powi(2)).sqrt();
            let got = response(f, zeta, drive);
            assert!((got / expected - 1.0).abs() < 0.02, "{f} {zeta} {drive}: {got} against {expected}");
        }
    }
}
