//! The teeth were ground thinner than the drawing says: both flanks recede, whatever the load.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "backlash_error",
    summary: "teeth 20 µm thinner than documented",
    usual,
    draw,
    amounts: &[("dj_mm", 1.0)],
    develops: false,
    apply,
};

/// Thins the teeth by another 20 µm along the pitch curve.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("dj_mm", 0.02)])
}

/// Either sign.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("dj_mm", 0.02 * rng.sign())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.gears.backlash_mm += parameters.number("dj_mm");
}
