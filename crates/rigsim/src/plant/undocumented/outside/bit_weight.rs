//! A converter weighs one bit wrongly: a square wave over the turn of the output encoder.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use crate::plant::{Carrier, Oddity, Weight};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "bit_weight",
    summary: "a bit of the output's converter weighs wrongly",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: false,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", 0.6), ("order", 32.0)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", rng.angle()), ("order", 2f64.powi(4 + rng.below(4) as i32))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(Oddity::Wave {
        carrier: Carrier::Output,
        order: parameters.number("order"),
        amplitude_rad: parameters.number("a_rad"),
        phase_rad: parameters.number("phase_rad"),
        weight: Weight::Constant,
        square: true,
    });
}
