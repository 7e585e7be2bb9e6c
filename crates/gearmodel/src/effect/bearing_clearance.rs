//! Bearings with play: the load pushes the gear aside by c along the common normal, TE = −dir·c/A, whatever its size.
//! The same trace as a backlash error of 2c/cos α.

use super::{
    Carrier, Effect, Estimate, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shape, SharedTrace, Signature,
    Words,
};

/// Bearings with play.
pub(super) struct BearingClearance;

impl Effect for BearingClearance {
    fn name(&self) -> &'static str {
        "bearing_clearance"
    }

    fn component(&self) -> &'static str {
        "bearings"
    }

    fn words(&self) -> Words {
        Words::new("clearance in the bearings", "preload or replace the bearings")
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

    fn one_sided(&self) -> bool {
        true
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = -at.sense / at.arm_mm;
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("c_mm", found.beta[0], found.std(0), "mm")]
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        &[HandTest::PressDrivenShaft, HandTest::FreeSeals]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["c_mm"]
    }
}
