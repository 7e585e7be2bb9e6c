//! The pitch curves are not those documented. Shape [0]: the true k of an elliptic or lobed pair differs by dk and still closes,
//! TE = dk ∂f/∂k (`NominalRig::theta2_slope_over_k`). For one lobe, with tan(f/2) = c tan(θ1/2), c = (1+k)/(1−k): ∂f/∂k = 2 sin f/(1 − k²). Shape [1]: the pair closes
//! otherwise (a wrong ratio), TE = dk·θ1, which grows with every revolution and returns when the sense turns.

use super::{
    Accumulates, Carrier, Effect, Estimate, Given, HandTest, MeasurementPlan, NominalRig, OperatingPoint, Parameter,
    Parity, Shape, SharedTrace, Signature, Stated, StatedEffect, StatedError, Words,
};

/// Error of the pitch curves' form or closure.
pub(super) struct PitchCurveError;

impl Effect for PitchCurveError {
    fn name(&self) -> &'static str {
        "pitch_curve_error"
    }

    fn component(&self) -> &'static str {
        "gears"
    }

    fn words(&self) -> Words {
        Words::new("pitch curve off its nominal k", "check the gear's programme: k as cut against k in pair.toml")
    }

    fn shared_trace(&self) -> Option<SharedTrace> {
        Some(SharedTrace::TurnOfAnEllipse)
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Output, Parity::Even)
    }

    fn signature_of(&self, _rig: &NominalRig, shape: &Shape) -> Signature {
        if shape[..] == [1.0] {
            // The parity of what accumulates is that of its growth a revolution, as for slip: ahead ccw, back cw.
            Signature::steady(Carrier::None, Parity::Odd).accumulating(Accumulates::PerRevolution)
        } else {
            self.signature()
        }
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn shapes(&self, rig: &NominalRig, plan: &MeasurementPlan) -> Vec<Shape> {
        let mut shapes = Vec::new();
        if rig.theta2_slope_over_k(0.0).is_some() {
            shapes.push(vec![0.0]);
        }
        if plan.revolutions > 1.0 {
            shapes.push(vec![1.0]);
        }
        shapes
    }

    fn row(&self, rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = if shape[..] == [1.0] { at.theta1_rad } else { rig.theta2_slope_over_k(at.theta2_rad).unwrap_or(0.0) };
    }

    fn evolves(&self, shape: &Shape) -> bool {
        shape[..] == [1.0]
    }

    fn parameters(&self, _rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let unit = if shape[..] == [1.0] { "rad/rad" } else { "" };
        vec![Parameter::number("dk", found.beta[0], found.std(0), unit)]
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        &[HandTest::TurnOutputEncoder, HandTest::TurnInputEncoder]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["dk", "of"]
    }

    fn amplitudes(&self, rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let form_first = rig.eccentricity().is_some();
        let word = given.word("of", if form_first { &["form", "closure"] } else { &["closure"] }, true)?;
        let shape = if form_first && word == 0 { 0.0 } else { 1.0 };
        Ok((vec![shape], vec![given.number("dk")?]))
    }

    fn stated(&self, rig: &NominalRig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        let mut stated = self.reported(rig, shape, beta);
        let word = if shape[..] == [1.0] { "closure" } else { "form" };
        stated.insert("of".to_owned(), Stated::Text(word.to_owned()));
        stated
    }
}
