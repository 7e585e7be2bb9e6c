//! Gear 1 is clocked against the index of its encoder: it stands ahead of what the encoder reads.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "phasing_error",
    summary: "gear 1 clocked 50 µrad ahead of its index",
    usual,
    draw,
    amounts: &[("delta_rad", 1.0)],
    develops: false,
    apply,
};

/// Turns gear 1 by 50 µrad.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("delta_rad", 5e-5)])
}

/// Either sign.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("delta_rad", 5e-5 * rng.sign())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.encoders.input.clocking_rad += parameters.number("delta_rad");
}
