//! Teeth wear, so that backlash grows with revolutions × load: dj = w Σ T·revolutions, TE = −dir·(dj/2) cos α/A.

use super::{
    Accumulates, Carrier, Effect, Estimate, NominalRig, OperatingPoint, Parameter, Parity, Shape, Signature, Words,
};

/// Teeth wear, so that backlash grows with revolutions × load.
pub(super) struct WearDrift;

impl Effect for WearDrift {
    fn name(&self) -> &'static str {
        "wear_drift"
    }

    fn component(&self) -> &'static str {
        "gear teeth"
    }

    fn words(&self) -> Words {
        Words::new("wear growing with revolutions", "check lubrication and the flanks; repeat an early run to see it")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::None, Parity::Odd).with_load(1.0).accumulating(Accumulates::PerRevolution)
    }

    fn one_sided(&self) -> bool {
        true
    }

    fn evolves(&self, _shape: &Shape) -> bool {
        true
    }

    fn row(&self, rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let work_rev_nm: f64 = at
            .revolutions_by_load
            .load_nm
            .iter()
            .zip(&at.revolutions_by_load.way_rev)
            .map(|(load, way)| load * way)
            .sum();
        row[0] = -at.sense * 0.5 * rig.pair().pressure_angle_rad().cos() * work_rev_nm / at.arm_mm;
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("dj_mm_per_rev_nm", found.beta[0], found.std(0), "mm/(rev.N.m)")]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["dj_mm_per_rev_nm"]
    }
}
