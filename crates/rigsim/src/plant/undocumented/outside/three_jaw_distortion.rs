//! A three-jaw chuck holds the output encoder's hub: the reading errs three times a turn.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use super::wave;
use crate::plant::{Carrier, Weight};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "three_jaw_distortion",
    summary: "output encoder's hub squeezed by a three-jaw chuck",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: false,
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
    spec.oddities.push(wave(parameters, Carrier::Output, 3.0, Weight::Constant));
}
