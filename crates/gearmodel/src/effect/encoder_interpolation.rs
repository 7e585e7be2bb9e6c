//! Sub-divisional error: the signals within one line period are not true sine and cosine (offset: order 1 of the line,
//! unequal amplitudes or quadrature: order 2), reading θ + a sin(h·L·θ − φ). Averaging over angle bins hides it; it is found
//! on the samples (by the diagnosis). The shape is [order h, lines L].

use super::{
    Carrier, Effect, Estimate, Given, HandTest, NominalRig, OperatingPoint, Parameter, Parity, Shaft, Shape, Signature,
    StatedError, Words,
};

/// Interpolation error of the input or output encoder.
pub(super) struct EncoderInterpolation(pub(super) Shaft);

impl Effect for EncoderInterpolation {
    fn name(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "encoder1_interpolation",
            Shaft::Output => "encoder2_interpolation",
        }
    }

    fn component(&self) -> &'static str {
        match self.0 {
            Shaft::Input => "input encoder",
            Shaft::Output => "output encoder",
        }
    }

    fn words(&self) -> Words {
        let words = match self.0 {
            Shaft::Input => Words::new(
                "interpolation error of the input encoder",
                "adjust offset, gain and phase of the input encoder's sine signals",
            ),
            Shaft::Output => Words::new(
                "interpolation error of the output encoder",
                "adjust offset, gain and phase of the output encoder's sine signals",
            ),
        };
        words.of_family("encoder interpolation, input or output")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::EncoderLine, Parity::Even)
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn within_lines_of(&self) -> Option<Shaft> {
        Some(self.0)
    }

    /// None before the samples were searched for lines.
    fn shapes(&self, _rig: &NominalRig, _plan: &super::MeasurementPlan) -> Vec<Shape> {
        Vec::new()
    }

    fn width(&self, _rig: &NominalRig, _shape: &Shape) -> usize {
        2
    }

    fn row(&self, _rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        if let [order, lines] = shape[..] {
            at.reading_error(self.0, order * lines, row);
        }
    }

    fn parameters(&self, _rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let mut parameters = found.polar(0).parameters("a_rad", "rad");
        if let [order, lines] = shape[..] {
            parameters.insert(1, Parameter::grid("lines", lines, ""));
            parameters.push(Parameter::grid("order", order, ""));
        }
        parameters
    }

    fn told_apart_by(&self) -> &'static [HandTest] {
        &[HandTest::ReindexGear2]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["a_rad", "lines", "phase_rad", "order"]
    }

    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let order = if given.has("order") { given.number_in("order", 1.0, 100.0)? } else { 1.0 };
        Ok((vec![order, given.number_in("lines", 1.0, 1e9)?], given.polar("a_rad")?))
    }
}
