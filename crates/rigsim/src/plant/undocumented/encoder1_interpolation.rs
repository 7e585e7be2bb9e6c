//! The input encoder's two signals are off their centre, so that every line is divided unevenly.

use super::{FaultRng, Parameters, PlantSpec, Undocumented, Value};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "encoder1_interpolation",
    summary: "input encoder divides its lines unevenly, 20 µrad",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: false,
    apply,
};

/// Displaces the signals so that the reading gains 20 µrad at the line order.
fn usual(spec: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 2e-5), ("lines", f64::from(spec.encoders.input.lines)), ("phase_rad", 0.4)])
}

/// Random in all but the size.
fn draw(spec: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    usual(spec).with("phase_rad", Value::Number(rng.angle()))
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    let disc = &mut spec.encoders.input;
    // a = o/lines for the offset o in parts of the signal.
    disc.interpolation = parameters.number("a_rad") * f64::from(disc.lines);
    disc.interpolation_phase_rad = parameters.number("phase_rad");
}
