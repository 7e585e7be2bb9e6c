//! A coupling bent by the angle β turns unevenly, twice a turn: tan θ' = tan θ/cos β, to first order θ' = θ + (β²/4) sin(2θ − φ).
//! In the output shaft the encoder reads θ2 + (β²/4) sin(2θ2 − φ); in the input shaft gear 1 stands at θ1 + (β²/4) sin(2θ1 − φ),
//! seen as i times that.

use super::{
    Effect, Estimate, Given, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shaft, Shape, Signature,
    StatedError, Words,
};

/// Misalignment of the coupling in the input or output shaft.
pub(super) struct CouplingMisalignment(pub(super) Shaft);

impl Effect for CouplingMisalignment {
    fn name(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "coupling_misalignment_input",
            Shaft::Output => "coupling_misalignment_output",
        }
    }

    fn component(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "input coupling",
            Shaft::Output => "output coupling",
        }
    }

    fn words(&self) -> Words {
        let words = match self.0 {
            Shaft::Input => Words::new("misalignment of the input coupling", "align the input shaft's coupling"),
            Shaft::Output => Words::new("misalignment of the output coupling", "align the output shaft's coupling"),
        };
        words.of_family("coupling misalignment, input or output")
    }

    fn signature(&self) -> Signature {
        Signature::steady(self.0.carrier(), Parity::Even)
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn width(&self, _rig: &NominalRig, _shape: &Shape) -> usize {
        2
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        at.wave(self.0, 2.0, if self.0 == Shaft::Input { at.ratio } else { 1.0 }, row);
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let polar = found.polar(0);
        // Amplitude β²/4: β = 2 √a, dβ = da/√a.
        let root = polar.amplitude.sqrt().max(f64::MIN_POSITIVE);
        vec![
            Parameter::number("beta_rad", 2.0 * root, polar.amplitude_std / root, "rad"),
            Parameter::phase("phase_rad", polar.phase_rad, polar.phase_std_rad),
        ]
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        match self.0 {
            Shaft::Input => &[HandTest::SwapInputCoupling],
            Shaft::Output => &[HandTest::SwapOutputCoupling],
        }
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["beta_rad", "phase_rad"]
    }

    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        // The amplitude of order 2 is β²/4.
        let (beta_rad, phase_rad) = (given.number_in("beta_rad", 0.0, 1.0)?, given.number("phase_rad")?);
        let amplitude_rad = 0.25 * beta_rad * beta_rad;
        Ok((Shape::new(), vec![amplitude_rad * phase_rad.cos(), -amplitude_rad * phase_rad.sin()]))
    }
}
