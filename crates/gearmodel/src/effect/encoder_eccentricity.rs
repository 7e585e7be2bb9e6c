//! An encoder's disc sits off its shaft's axis by eps track radii: it reads θ + eps sin(θ − φ) to first order. Seen in TE as
//! −i eps sin(θ1 − φ) for the input encoder, eps sin(θ2 − φ) for the output encoder.

use super::{Carrier, Effect, Estimate, Given, Parameter, Parity, Rig, Shaft, Shape, Signature, StatedError, Station};

/// Eccentricity of the input or output encoder's disc.
pub(super) struct EncoderEccentricity(pub(super) Shaft);

impl Effect for EncoderEccentricity {
    fn name(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "encoder1_eccentricity",
            Shaft::Output => "encoder2_eccentricity",
        }
    }

    fn component(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "input encoder",
            Shaft::Output => "output encoder",
        }
    }

    fn signature(&self) -> Signature {
        let carrier = if self.0 == Shaft::Input { Carrier::Input } else { Carrier::Output };
        Signature::steady(carrier, Parity::Even)
    }

    fn applies(&self, _rig: &Rig) -> bool {
        true
    }

    fn width(&self, _rig: &Rig, _shape: &Shape) -> usize {
        2
    }

    fn row(&self, _rig: &Rig, _shape: &Shape, at: &Station, row: &mut [f64]) {
        reading_error(self.0, 1.0, at, row);
    }

    fn parameters(&self, _rig: &Rig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        found.polar(0).parameters("eps", "")
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["eps", "phase_rad"]
    }

    fn amplitudes(&self, _rig: &Rig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        Ok((Shape::new(), given.polar("eps")?))
    }
}

/// TE of a reading error sin nθ, cos nθ of one encoder.
pub(super) fn reading_error(shaft: Shaft, order: f64, at: &Station, row: &mut [f64]) {
    let (angle_rad, gain) = match shaft {
        Shaft::Input => (at.theta1_rad, -at.ratio),
        Shaft::Output => (at.theta2_rad, 1.0),
    };
    let (sin, cos) = (order * angle_rad).sin_cos();
    row[0] = gain * sin;
    row[1] = gain * cos;
}
