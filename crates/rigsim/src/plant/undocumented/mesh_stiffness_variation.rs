//! One pair of teeth in contact is softer than two; the mean over a pitch is documented, the difference is not. Two pairs touch
//! over the share `duty` of the pitch, around half a pitch from the pitch point.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "mesh_stiffness_variation",
    summary: "one pair of teeth softer than two by 2e-3 mm²·rad/(N·m)",
    usual,
    draw,
    amounts: &[("c_mm2_rad_per_nm", 1.0)],
    develops: false,
    apply,
};

/// 2e-3 mm²·rad/(N·m) between one pair and two, two of them over 0.6 of the pitch.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("c_mm2_rad_per_nm", 2e-3), ("duty", 0.6)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("c_mm2_rad_per_nm", 2e-3), ("duty", rng.between(0.35, 0.8))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.teeth.stiffness_variation_mm2_rad_per_nm = parameters.number("c_mm2_rad_per_nm");
    spec.teeth.double_contact_share = parameters.number("duty");
}
