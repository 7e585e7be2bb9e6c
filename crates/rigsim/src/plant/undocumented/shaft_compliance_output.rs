//! The shaft between gear 2 and output encoder is softer than documented.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "shaft_compliance_output",
    summary: "output shaft softer by 6e-6 rad/(N·m)",
    usual,
    draw,
    amounts: &[("c_rad_per_nm", 1.0)],
    develops: false,
    apply,
};

/// Adds 6e-6 rad/(N·m).
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("c_rad_per_nm", 6e-6)])
}

/// Nothing but the size varies.
fn draw(spec: &PlantSpec, _: &mut FaultRng) -> Parameters {
    usual(spec)
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.shafts.compliance_output_rad_per_nm += parameters.number("c_rad_per_nm");
}
