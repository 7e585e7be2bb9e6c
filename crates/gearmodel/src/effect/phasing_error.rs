//! Gear 1 is clocked by δ against its encoder's index: it stands at θ1 + δ, TE = f(θ1 + δ) − f(θ1) = i δ.

use super::{
    Carrier, Effect, Estimate, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shape, SharedTrace, Signature,
    Words,
};

/// Gear 1 is clocked by δ against its encoder's index.
pub(super) struct PhasingError;

impl Effect for PhasingError {
    fn name(&self) -> &'static str {
        "phasing_error"
    }

    fn component(&self) -> &'static str {
        "gear 1 on its shaft, or the index"
    }

    fn words(&self) -> Words {
        Words::new(
            "clocking of gear 1 against the index",
            "clock gear 1 to the encoder's index again, or enter the angle",
        )
    }

    fn shared_trace(&self) -> Option<SharedTrace> {
        Some(SharedTrace::TurnOfAnEllipse)
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Input, Parity::Even)
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = at.ratio;
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("delta_rad", found.beta[0], found.std(0), "rad")]
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        &[HandTest::TurnOutputEncoder, HandTest::TurnInputEncoder]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["delta_rad"]
    }
}
