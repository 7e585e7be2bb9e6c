//! The bearings have play: the force of the teeth pushes the gears apart until it is used up, whatever its size.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "bearing_clearance",
    summary: "bearings with 3 µm of play",
    usual,
    draw,
    amounts: &[("c_mm", 1.0)],
    develops: false,
    apply,
};

/// Gives 3 µm along the normal.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("c_mm", 3e-3)])
}

/// Nothing but the size varies.
fn draw(spec: &PlantSpec, _: &mut FaultRng) -> Parameters {
    usual(spec)
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.bearings.clearance_mm += parameters.number("c_mm");
}
