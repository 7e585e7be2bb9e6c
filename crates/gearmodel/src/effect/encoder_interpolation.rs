//! Sub-divisional error: the signals within one line period are not true sine and cosine (offset: order 1 of the line,
//! unequal amplitudes or quadrature: order 2), reading θ + a sin(h·L·θ − φ). Averaging over angle bins hides it; it is found
//! on the samples (`diagnosis::line_phase`). The shape is [order h, lines L].

use super::{
    Carrier, Effect, Estimate, Given, HandTest, OperatingPoint, Parameter, Parity, Rig, Shaft, Shape, Signature,
    StatedError,
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

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::EncoderLine, Parity::Even)
    }

    fn applies(&self, _rig: &Rig) -> bool {
        true
    }

    fn within_lines_of(&self) -> Option<Shaft> {
        Some(self.0)
    }

    /// None before the samples were searched for lines.
    fn shapes(&self, _rig: &Rig, _plan: &super::Plan) -> Vec<Shape> {
        Vec::new()
    }

    fn width(&self, _rig: &Rig, _shape: &Shape) -> usize {
        2
    }

    fn row(&self, _rig: &Rig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        if let [order, lines] = shape[..] {
            at.reading_error(self.0, order * lines, row);
        }
    }

    fn parameters(&self, _rig: &Rig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
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

    fn amplitudes(&self, _rig: &Rig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let order = if given.has("order") { given.number_in("order", 1.0, 100.0)? } else { 1.0 };
        Ok((vec![order, given.number_in("lines", 1.0, 1e9)?], given.polar("a_rad")?))
    }
}
