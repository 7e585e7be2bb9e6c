//! The room's temperature swings and turns the encoder's mount slowly to and fro.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use super::wave;
use crate::plant::{Carrier, Weight};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "air_conditioning",
    summary: "encoder's mount swings once in 45 s",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: true,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", 0.6), ("period_s", 45.0)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", rng.angle()), ("period_s", rng.spread(15.0, 90.0))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(wave(
        parameters,
        Carrier::Time,
        1.0 / parameters.number("period_s").max(1e-3),
        Weight::Constant,
    ));
}
