//! Torques that are not the load as it is known: a seal that drags, a brake that ripples.

use super::fault::Fault;
use super::parameters::Parameters;
use super::signature::{Carrier, Signature};

/// The seal at the output encoder drags with 1.5 N·m: its torque twists all shafts before it, flips with the sense, and is no part
/// of the known load.
pub const FRICTION_WINDUP: Fault = Fault {
    name: "friction_windup",
    summary: "output seal drags with 1.5 N·m",
    usual: |_| Parameters::of(&[("torque_nm", 1.5)]),
    vary: |_, usual, _| usual,
    amounts: &[("torque_nm", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_ODD),
    same_trace_as: None,
    apply: |spec, parameters| spec.shafts.seal_drag_nm += parameters.number("torque_nm"),
};

/// The brake's torque ripples over its turn, T (1 + ρ sin(n θ2 − phase)), by 20 % at order 3, and the drive train twists with it.
pub const BRAKE_TORQUE_RIPPLE: Fault = Fault {
    name: "brake_torque_ripple",
    summary: "brake's torque ripples by 20 %, three times a turn",
    usual: |_| Parameters::of(&[("rho", 0.2), ("n", 3.0), ("phase_rad", 0.9)]),
    vary: |_, usual, rng| usual.with("n", 1.0 + rng.below(8) as f64).with("phase_rad", rng.angle()),
    amounts: &[("rho", 1.0)],
    develops: false,
    signature: Some(Signature::WINDUP.over(Carrier::Output)),
    same_trace_as: None,
    apply: |spec, parameters| {
        let brake = &mut spec.brake;
        (brake.ripple_ratio, brake.ripple_order) = (parameters.number("rho"), parameters.number("n") as u32);
        brake.ripple_phase_rad = parameters.number("phase_rad");
    },
};
