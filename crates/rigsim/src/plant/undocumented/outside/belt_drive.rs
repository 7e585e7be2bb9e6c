//! A belt in the input encoder's drive goes round less often than the shaft: an order that is no whole number.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use super::wave;
use crate::plant::{Carrier, Weight};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "belt_drive",
    summary: "belt errs at order 0.37 of the driver",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: true,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", 0.6), ("order", 0.37)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", rng.angle()), ("order", rng.between(0.15, 0.85))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(wave(parameters, Carrier::Input, parameters.number("order"), Weight::Constant));
}
