//! The output's interpolator loses its lock for moments: bursts of wrong readings.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use crate::plant::Oddity;

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "glitch_bursts",
    summary: "bursts of wrong readings",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: true,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 3e-4), ("per_minute", 4.0), ("length_s", 0.2)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("a_rad", 3e-4), ("per_minute", rng.spread(2.0, 8.0)), ("length_s", rng.spread(0.05, 0.3))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(Oddity::Bursts {
        per_minute: parameters.number("per_minute"),
        length_s: parameters.number("length_s"),
        size_rad: parameters.number("a_rad"),
    });
}
