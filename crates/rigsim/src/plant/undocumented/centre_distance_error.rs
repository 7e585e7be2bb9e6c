//! The housing was bored, or the slide set, with another centre distance than the pair closes at.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "centre_distance_error",
    summary: "centre distance 30 µm too large",
    usual,
    draw,
    amounts: &[("da_mm", 1.0)],
    develops: false,
    apply,
};

/// Moves the gears 30 µm apart.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("da_mm", 0.03)])
}

/// Either sign.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("da_mm", 0.03 * rng.sign())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.gears.centre_distance_error_mm += parameters.number("da_mm");
}
