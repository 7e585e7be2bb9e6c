//! The seal at the output encoder drags: its torque twists all shafts before it, flips with the sense, and is no part of the known
//! load.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "friction_windup",
    summary: "output seal drags with 1.5 N·m",
    usual,
    draw,
    amounts: &[("torque_nm", 1.0)],
    develops: false,
    apply,
};

/// Drags with 1.5 N·m.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("torque_nm", 1.5)])
}

/// Nothing but the size varies.
fn draw(spec: &PlantSpec, _: &mut FaultRng) -> Parameters {
    usual(spec)
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.shafts.seal_drag_nm += parameters.number("torque_nm");
}
