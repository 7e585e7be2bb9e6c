//! Every tooth has the same error of profile: the driven gear moves ahead by Σ a_n sin(n 2π s − ph_n) along the normal, s the pitch
//! arc from θ1 = 0 in pitches, in both senses alike.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};
use crate::plant::ProfileOrder;

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "profile_error",
    summary: "all profiles off by 2 µm at the mesh order",
    usual,
    draw,
    amounts: &[("a1_mm", 1.0), ("a2_mm", 1.0), ("a3_mm", 1.0)],
    develops: false,
    apply,
};

/// 2 µm at order 1, 0.8 and 0.4 µm at orders 2 and 3.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[
        ("a1_mm", 2e-3),
        ("ph1_rad", 0.7),
        ("a2_mm", 8e-4),
        ("ph2_rad", 2.0),
        ("a3_mm", 4e-4),
        ("ph3_rad", 4.0),
    ])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[
        ("a1_mm", 2e-3),
        ("ph1_rad", rng.angle()),
        ("a2_mm", 1e-3 * rng.between(0.0, 1.0)),
        ("ph2_rad", rng.angle()),
        ("a3_mm", 5e-4 * rng.between(0.0, 1.0)),
        ("ph3_rad", rng.angle()),
    ])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.teeth.profile = [(1, "a1_mm", "ph1_rad"), (2, "a2_mm", "ph2_rad"), (3, "a3_mm", "ph3_rad")]
        .map(|(order, amplitude, phase)| ProfileOrder {
            order,
            amplitude_mm: parameters.number(amplitude),
            phase_rad: parameters.number(phase),
        })
        .to_vec();
}
