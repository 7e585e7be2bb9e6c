//! The shaft between input encoder and gear 1 is softer than documented: a key that gives, a longer shaft.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "shaft_compliance_input",
    summary: "input shaft softer by 4e-6 rad/(N·m)",
    usual,
    draw,
    amounts: &[("c_rad_per_nm", 1.0)],
    develops: false,
    apply,
};

/// Adds 4e-6 rad/(N·m).
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("c_rad_per_nm", 4e-6)])
}

/// Nothing but the size varies.
fn draw(spec: &PlantSpec, _: &mut FaultRng) -> Parameters {
    usual(spec)
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.shafts.compliance_input_rad_per_nm += parameters.number("c_rad_per_nm");
}
