//! The output encoder's mount creeps steadily, turning or not.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use crate::plant::Oddity;

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "mount_creep",
    summary: "output encoder's mount creeps 0.2 µrad a second",
    usual,
    draw,
    amounts: &[("rad_per_s", 1.0)],
    develops: true,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("rad_per_s", 2e-7)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("rad_per_s", 2e-7 * rng.sign())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(Oddity::Drift { rad_per_s: parameters.number("rad_per_s") });
}
