//! A cable picks up a tone: the reading swings at a fixed frequency, whatever the shaft does.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use super::wave;
use crate::plant::{Carrier, Weight};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "pickup",
    summary: "reading picks up a tone of 13.7 Hz",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: true,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", 0.6), ("f_hz", 13.7)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", rng.angle()), ("f_hz", rng.spread(2.0, 60.0))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(wave(parameters, Carrier::Time, parameters.number("f_hz"), Weight::Constant));
}
