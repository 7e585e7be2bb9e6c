//! Tooth thinning differs from the designed backlash by dj along the pitch curve:
//! TE = −dir·(dj/2) cos α/A.

use super::{
    Carrier, Effect, Estimate, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shape, SharedTrace, Signature,
    Words,
};

/// Tooth thinning differs from the designed backlash by dj along the pitch curve.
pub(super) struct BacklashError;

impl Effect for BacklashError {
    fn name(&self) -> &'static str {
        "backlash_error"
    }

    fn component(&self) -> &'static str {
        "gear teeth"
    }

    fn words(&self) -> Words {
        Words::new(
            "backlash off its documented value",
            "check tooth thickness with a feeler or over pins and correct backlash_mm in pair.toml",
        )
    }

    fn shared_trace(&self) -> Option<SharedTrace> {
        Some(SharedTrace::Play)
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Input, Parity::Odd)
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn row(&self, rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = -at.sense * 0.5 * rig.pair().pressure_angle_rad().cos() / at.arm_mm;
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("dj_mm", found.beta[0], found.std(0), "mm")]
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        &[HandTest::PressDrivenShaft, HandTest::FreeSeals]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["dj_mm"]
    }
}
