//! The brake's torque ripples over its turn, T (1 + ρ sin(n θ2 − phase)), and the drive train twists with it.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "brake_torque_ripple",
    summary: "brake's torque ripples by 20 %, three times a turn",
    usual,
    draw,
    amounts: &[("rho", 1.0)],
    develops: false,
    apply,
};

/// 20 % at order 3.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("rho", 0.2), ("n", 3.0), ("phase_rad", 0.9)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("rho", 0.2), ("n", 1.0 + rng.below(8) as f64), ("phase_rad", rng.angle())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    let brake = &mut spec.brake;
    (brake.ripple_ratio, brake.ripple_order) = (parameters.number("rho"), parameters.number("n") as u32);
    brake.ripple_phase_rad = parameters.number("phase_rad");
}
