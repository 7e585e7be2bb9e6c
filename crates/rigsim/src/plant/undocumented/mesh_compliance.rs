//! The teeth and gear bodies are softer than documented: another material, thin webs.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "mesh_compliance",
    summary: "mesh softer by 0.03 mm²·rad/(N·m)",
    usual,
    draw,
    amounts: &[("c_mm2_rad_per_nm", 1.0)],
    develops: false,
    apply,
};

/// Adds 0.03 mm²·rad/(N·m), a mesh of 3.2e4 N/mm in all.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("c_mm2_rad_per_nm", 0.03)])
}

/// Nothing but the size varies.
fn draw(spec: &PlantSpec, _: &mut FaultRng) -> Parameters {
    usual(spec)
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.mesh.compliance_mm2_rad_per_nm += parameters.number("c_mm2_rad_per_nm");
}
