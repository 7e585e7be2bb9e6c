//! The teeth wear: the backlash grows with revolutions and load.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "wear_drift",
    summary: "teeth wear by 0.05 µm per revolution and N·m",
    usual,
    draw,
    amounts: &[("dj_mm_per_rev_nm", 1.0)],
    develops: true,
    apply,
};

/// Thins the teeth by 0.05 µm per driver revolution and N·m.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("dj_mm_per_rev_nm", 5e-5)])
}

/// Nothing but the size varies.
fn draw(spec: &PlantSpec, _: &mut FaultRng) -> Parameters {
    usual(spec)
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.teeth.wear_mm_per_rev_nm += parameters.number("dj_mm_per_rev_nm");
}
