//! An encoder's disc sits off its shaft's axis by eps track radii (n = 1), or it or its hub is out of round (n = 2): it reads
//! θ + eps sin(nθ − φ) to first order. Seen in TE as −i eps sin(nθ1 − φ) for the input encoder, eps sin(nθ2 − φ) for the output
//! encoder.

use super::{
    Effect, Estimate, Given, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shaft, Shape, SharedTrace,
    Signature, StatedError, Words,
};

/// Order 1 or 2 of the input or output encoder's disc.
pub(super) struct EncoderDisc {
    pub(super) shaft: Shaft,
    pub(super) order: Order,
}

/// What is wrong with the disc.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Order {
    Eccentricity = 1,
    Ellipticity = 2,
}

impl Effect for EncoderDisc {
    fn name(&self) -> &'static str {
        match (self.shaft, self.order) {
            (Shaft::Input, Order::Eccentricity) => "encoder1_eccentricity",
            (Shaft::Output, Order::Eccentricity) => "encoder2_eccentricity",
            (Shaft::Input, Order::Ellipticity) => "encoder1_ellipticity",
            (Shaft::Output, Order::Ellipticity) => "encoder2_ellipticity",
        }
    }

    fn component(&self) -> &'static str {
        match self.shaft {
            Shaft::Input => "input encoder",
            Shaft::Output => "output encoder",
        }
    }

    fn words(&self) -> Words {
        match (self.shaft, self.order) {
            (Shaft::Input, Order::Eccentricity) => Words::new(
                "eccentricity of the input encoder",
                "re-centre the input encoder's disc, or read it with two heads",
            )
            .of_family("encoder eccentricity, input or output"),
            (Shaft::Output, Order::Eccentricity) => Words::new(
                "eccentricity of the output encoder",
                "re-centre the output encoder's disc, or read it with two heads",
            )
            .of_family("encoder eccentricity, input or output"),
            (Shaft::Input, Order::Ellipticity) => Words::new(
                "ellipticity of the input encoder",
                "loosen the input encoder's disc or hub: a clamped disc goes oval",
            )
            .of_family("encoder ellipticity, input or output"),
            (Shaft::Output, Order::Ellipticity) => Words::new(
                "ellipticity of the output encoder",
                "loosen the output encoder's disc or hub: a clamped disc goes oval",
            )
            .of_family("encoder ellipticity, input or output"),
        }
    }

    fn shared_trace(&self) -> Option<SharedTrace> {
        (self.order == Order::Eccentricity).then_some(SharedTrace::TurnOfAnEllipse)
    }

    fn signature(&self) -> Signature {
        Signature::steady(self.shaft.carrier(), Parity::Even)
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn width(&self, _rig: &NominalRig, _shape: &Shape) -> usize {
        2
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        at.reading_error(self.shaft, f64::from(self.order as u8), row);
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        found.polar(0).parameters("eps", "")
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        match (self.order, self.shaft) {
            (Order::Eccentricity, Shaft::Input) => {
                &[HandTest::TurnOutputEncoder, HandTest::TurnInputEncoder, HandTest::ReindexGear2]
            }
            (Order::Eccentricity, Shaft::Output) => &[HandTest::TurnOutputEncoder, HandTest::ReindexGear2],
            (Order::Ellipticity, Shaft::Input) => &[HandTest::SwapInputCoupling, HandTest::ReindexGear2],
            (Order::Ellipticity, Shaft::Output) => &[HandTest::SwapOutputCoupling, HandTest::ReindexGear2],
        }
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["eps", "phase_rad"]
    }

    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        Ok((Shape::new(), given.polar("eps")?))
    }
}
