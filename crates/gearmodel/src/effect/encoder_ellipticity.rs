//! An encoder's disc or hub is out of round: order 2 of the shaft, reading θ + eps sin(2θ − φ). Seen in TE as
//! −i eps sin(2θ1 − φ) or eps sin(2θ2 − φ).

use super::encoder_eccentricity::reading_error;
use super::{Carrier, Effect, Estimate, Given, Parameter, Parity, Rig, Shaft, Shape, Signature, StatedError, Station};

/// Order 2 of the input or output encoder.
pub(super) struct EncoderEllipticity(pub(super) Shaft);

impl Effect for EncoderEllipticity {
    fn name(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "encoder1_ellipticity",
            Shaft::Output => "encoder2_ellipticity",
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
        reading_error(self.0, 2.0, at, row);
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
