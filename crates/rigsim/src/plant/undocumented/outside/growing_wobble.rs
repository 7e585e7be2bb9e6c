//! A hub works loose: an error of six waves a turn grows with time.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use super::wave;
use crate::plant::{Carrier, Weight};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "growing_wobble",
    summary: "hub works loose, six waves a turn growing with time",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: true,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", 0.6)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("a_rad", 4e-5), ("phase_rad", rng.angle())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(wave(parameters, Carrier::Output, 6.0, Weight::Age(300.0)));
}
