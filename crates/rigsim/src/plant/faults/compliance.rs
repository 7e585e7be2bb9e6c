//! Shafts, teeth and bearings that give way more than documented.

use super::fault::Fault;
use super::parameters::Parameters;
use super::signature::{Carrier, Signature};

/// The shaft between input encoder and gear 1 is softer than documented, by 4e-6 rad/(N·m): a key that gives, a longer shaft.
pub const INPUT_SHAFT: Fault = Fault {
    name: "shaft_compliance_input",
    summary: "input shaft softer by 4e-6 rad/(N·m)",
    usual: |_| Parameters::of(&[("c_rad_per_nm", 4e-6)]),
    vary: |_, usual, _| usual,
    amounts: &[("c_rad_per_nm", 1.0)],
    develops: false,
    signature: Some(Signature::WINDUP),
    same_trace_as: None,
    apply: |spec, parameters| spec.shafts.compliance_input_rad_per_nm += parameters.number("c_rad_per_nm"),
};

/// The shaft between gear 2 and output encoder is softer than documented, by 6e-6 rad/(N·m).
pub const OUTPUT_SHAFT: Fault = Fault {
    name: "shaft_compliance_output",
    summary: "output shaft softer by 6e-6 rad/(N·m)",
    usual: |_| Parameters::of(&[("c_rad_per_nm", 6e-6)]),
    vary: |_, usual, _| usual,
    amounts: &[("c_rad_per_nm", 1.0)],
    develops: false,
    signature: Some(Signature::WINDUP),
    same_trace_as: None,
    apply: |spec, parameters| spec.shafts.compliance_output_rad_per_nm += parameters.number("c_rad_per_nm"),
};

/// The teeth and gear bodies are softer than documented, by another material or thin webs: 0.03 mm²·rad/(N·m), a mesh of 3.2e4 N/mm
/// in all.
pub const MESH: Fault = Fault {
    name: "mesh_compliance",
    summary: "mesh softer by 0.03 mm²·rad/(N·m)",
    usual: |_| Parameters::of(&[("c_mm2_rad_per_nm", 0.03)]),
    vary: |_, usual, _| usual,
    amounts: &[("c_mm2_rad_per_nm", 1.0)],
    develops: false,
    signature: Some(Signature::WINDUP),
    same_trace_as: None,
    apply: |spec, parameters| spec.mesh.compliance_mm2_rad_per_nm += parameters.number("c_mm2_rad_per_nm"),
};

/// The bearings of the gears give way along the force of the teeth by another 3e-5 mm/N, 4.4 µm at 10 N·m.
pub const BEARING: Fault = Fault {
    name: "bearing_compliance",
    summary: "bearings softer by 3e-5 mm/N",
    usual: |_| Parameters::of(&[("c_mm_per_n", 3e-5)]),
    vary: |_, usual, _| usual,
    amounts: &[("c_mm_per_n", 1.0)],
    develops: false,
    signature: Some(Signature::WINDUP),
    same_trace_as: Some("mesh_compliance"),
    apply: |spec, parameters| spec.bearings.compliance_mm_per_n += parameters.number("c_mm_per_n"),
};

/// One pair of teeth in contact is softer than two, by 2e-3 mm²·rad/(N·m); the mean over a pitch is documented, the difference is
/// not. Two pairs touch over the share `duty` of the pitch, around half a pitch from the pitch point.
pub const MESH_STIFFNESS_VARIATION: Fault = Fault {
    name: "mesh_stiffness_variation",
    summary: "one pair of teeth softer than two by 2e-3 mm²·rad/(N·m)",
    usual: |_| Parameters::of(&[("c_mm2_rad_per_nm", 2e-3), ("duty", 0.6)]),
    vary: |_, usual, rng| usual.with("duty", rng.between(0.35, 0.8)),
    amounts: &[("c_mm2_rad_per_nm", 1.0)],
    develops: false,
    signature: Some(Signature { load_exponent: Some(1.0), ..Signature::STEADY.over(Carrier::Mesh) }),
    same_trace_as: None,
    apply: |spec, parameters| {
        spec.teeth.stiffness_variation_mm2_rad_per_nm = parameters.number("c_mm2_rad_per_nm");
        spec.teeth.double_contact_share = parameters.number("duty");
    },
};
