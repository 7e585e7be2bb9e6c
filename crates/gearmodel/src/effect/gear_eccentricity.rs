//! A gear sits off its documented centre: the eccentricity vector differs by (dx, dy) = (e cos φ, e sin φ).
//!
//! By the increment along the common normal, with a = dir·(α ∓ μ) (`increment::common_normal`):
//! TE = [dx sin(θ1 + a) + dy cos(θ1 + a)]/A for gear 1, [dx sin(θ2 − a) + dy cos(θ2 − a)]/A for gear 2.

use super::{
    Effect, Estimate, Fold, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shaft, Shape, Signature, Words,
};

/// Eccentricity of gear 1 (input) or gear 2 (output) against the documented one.
pub(super) struct GearEccentricity(pub(super) Shaft);

impl Effect for GearEccentricity {
    fn name(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "gear1_eccentricity",
            Shaft::Output => "gear2_eccentricity",
        }
    }

    fn component(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "gear 1 on its shaft",
            Shaft::Output => "gear 2 on its shaft",
        }
    }

    fn words(&self) -> Words {
        let words = match self.0 {
            Shaft::Input => Words::new(
                "eccentricity of gear 1",
                "measure gear 1's run-out on its shaft and re-centre it, or enter the vector in pair.toml",
            ),
            Shaft::Output => Words::new(
                "eccentricity of gear 2",
                "measure gear 2's run-out on its shaft and re-centre it, or enter the vector in pair.toml",
            ),
        };
        words.of_family("gear eccentricity, gear 1 or gear 2")
    }

    fn signature(&self) -> Signature {
        Signature::steady(self.0.carrier(), Parity::Mixed)
    }

    fn width(&self, _rig: &NominalRig, _shape: &Shape) -> usize {
        2
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let lean = at.sense * at.pressure_rad;
        let angle = match self.0 {
            Shaft::Input => at.theta1_rad + lean,
            Shaft::Output => at.theta2_rad - lean,
        };
        let (sin, cos) = angle.sin_cos();
        row[0] = sin / at.arm_mm;
        row[1] = cos / at.arm_mm;
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![
            Parameter::number("dx_mm", found.beta[0], found.std(0), "mm"),
            Parameter::number("dy_mm", found.beta[1], found.std(1), "mm"),
        ]
    }

    fn folds_into(&self) -> Option<Fold> {
        Some(Fold::Eccentricity(self.0))
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        &[HandTest::ReindexGear2]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["dx_mm", "dy_mm"]
    }
}
