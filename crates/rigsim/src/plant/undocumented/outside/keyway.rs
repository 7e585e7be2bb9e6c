//! A worn keyway gives in one sense only, seven times a turn of the driver.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use super::wave;
use crate::plant::{Carrier, Weight};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "keyway",
    summary: "keyway gives seven times a turn in one sense",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: false,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", 0.6), ("sense", 1.0)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", rng.angle()), ("sense", rng.sign())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(wave(parameters, Carrier::Input, 7.0, Weight::Sense(parameters.number("sense"))));
}
