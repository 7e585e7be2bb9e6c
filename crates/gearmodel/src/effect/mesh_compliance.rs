//! The teeth give way along the common normal: TE = −dir·T·C/A².

use super::{
    Carrier, Effect, Estimate, Fold, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shape, Signature, Words,
};

/// The teeth give way along the common normal.
pub(super) struct MeshCompliance;

impl Effect for MeshCompliance {
    fn name(&self) -> &'static str {
        "mesh_compliance"
    }

    fn component(&self) -> &'static str {
        "gear teeth"
    }

    fn words(&self) -> Words {
        Words::new("compliance of the mesh", "enter the compliance in pair.toml: teeth do give way")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Input, Parity::Odd).with_load(1.0)
    }

    fn one_sided(&self) -> bool {
        true
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = -at.sense * at.load_nm / (at.arm_mm * at.arm_mm);
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("c_mm2_rad_per_nm", found.beta[0], found.std(0), "mm2.rad/(N.m)")]
    }

    fn folds_into(&self) -> Option<Fold> {
        Some(Fold::MeshCompliance)
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        &[HandTest::WatchDrivenShaft]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["c_mm2_rad_per_nm"]
    }
}
