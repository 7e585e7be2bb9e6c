//! A shaft is softer than documented: the load winds it up, TE = −dir·T·C for the output shaft, −dir·T·C i² for the input
//! shaft, whose torque is T i and whose twist is seen through the ratio.

use super::{
    Carrier, Effect, Estimate, Fold, NominalRig, OperatingPoint, Parameter, Parity, Shaft, Shape, Signature, Words,
};

/// Compliance of the input or output shaft beyond the documented one.
pub(super) struct ShaftCompliance(pub(super) Shaft);

impl Effect for ShaftCompliance {
    fn name(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "shaft_compliance_input",
            Shaft::Output => "shaft_compliance_output",
        }
    }

    fn component(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "input shaft",
            Shaft::Output => "output shaft",
        }
    }

    fn words(&self) -> Words {
        let words = match self.0 {
            Shaft::Input => {
                Words::new("wind-up of the input shaft", "stiffen the input side, or enter its compliance in pair.toml")
            }
            Shaft::Output => Words::new(
                "wind-up of the output shaft",
                "stiffen the output side, or enter its compliance in pair.toml",
            ),
        };
        words.of_family("shaft wind-up, input or output")
    }

    fn signature(&self) -> Signature {
        let carrier = if self.0 == Shaft::Input { Carrier::Input } else { Carrier::None };
        Signature::steady(carrier, Parity::Odd).with_load(1.0)
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn one_sided(&self) -> bool {
        true
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let seen = if self.0 == Shaft::Input { at.ratio * at.ratio } else { 1.0 };
        row[0] = -at.sense * at.load_nm * seen;
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("c_rad_per_nm", found.beta[0], found.std(0), "rad/(N.m)")]
    }

    fn folds_into(&self) -> Option<Fold> {
        Some(Fold::ShaftCompliance(self.0))
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["c_rad_per_nm"]
    }
}
