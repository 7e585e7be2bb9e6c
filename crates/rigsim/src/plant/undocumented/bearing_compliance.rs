//! The bearings of the gears give way along the force of the teeth.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "bearing_compliance",
    summary: "bearings softer by 3e-5 mm/N",
    usual,
    draw,
    amounts: &[("c_mm_per_n", 1.0)],
    develops: false,
    apply,
};

/// Adds 3e-5 mm/N, 4.4 µm at 10 N·m.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("c_mm_per_n", 3e-5)])
}

/// Nothing but the size varies.
fn draw(spec: &PlantSpec, _: &mut FaultRng) -> Parameters {
    usual(spec)
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.bearings.compliance_mm_per_n += parameters.number("c_mm_per_n");
}
