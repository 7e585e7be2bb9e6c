//! Bearings give way along the common normal, c mm a newton: with the tooth force F = 1000 T/A (T in N·m, A in mm),
//! TE = −dir·1000 T c/A².

use super::{
    Carrier, Effect, Estimate, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shape, Signature, Words,
};

/// Bearings give way along the common normal, c mm a newton.
pub(super) struct BearingCompliance;

impl Effect for BearingCompliance {
    fn name(&self) -> &'static str {
        "bearing_compliance"
    }

    fn component(&self) -> &'static str {
        "bearings"
    }

    fn words(&self) -> Words {
        Words::new("compliance of the bearings", "preload or stiffen the bearings, or enter their compliance")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Input, Parity::Odd).with_load(1.0)
    }

    fn one_sided(&self) -> bool {
        true
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = -at.sense * 1000.0 * at.load_nm / (at.arm_mm * at.arm_mm);
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("c_mm_per_n", found.beta[0], found.std(0), "mm/N")]
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        &[HandTest::WatchDrivenShaft]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["c_mm_per_n"]
    }
}
