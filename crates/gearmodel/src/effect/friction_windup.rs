//! Drag of seals and bearings winds the shafts up beside the load: TE = −dir·M·[C_out + C_in i² + C_mesh/A²] with the
//! documented compliances, or at 1 rad/(N·m) where there are none.

use super::{
    Carrier, Effect, Estimate, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shape, Signature, Words,
};

/// Drag of seals and bearings winds the shafts up beside the load.
pub(super) struct FrictionWindup;

impl Effect for FrictionWindup {
    fn name(&self) -> &'static str {
        "friction_windup"
    }

    fn component(&self) -> &'static str {
        "shafts and seals"
    }

    fn words(&self) -> Words {
        Words::new("wind-up by friction", "free seals and bearings that drag")
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

    fn row(&self, rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = -at.sense * rig.train_compliance_rad_per_nm(at);
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("torque_nm", found.beta[0], found.std(0), "N.m")]
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        &[HandTest::FreeSeals]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["torque_nm"]
    }
}
