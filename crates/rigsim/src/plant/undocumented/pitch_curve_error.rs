//! The pitch curve was cut to another eccentricity k; the pair is mounted at the distance at which it closes.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "pitch_curve_error",
    summary: "pitch curve cut to k + 3e-5",
    usual,
    draw,
    amounts: &[("dk", 1.0)],
    develops: false,
    apply,
};

/// Adds 3e-5 to k.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("dk", 3e-5)])
}

/// Either sign.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("dk", 3e-5 * rng.sign())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.gears.eccentricity += parameters.number("dk");
}
