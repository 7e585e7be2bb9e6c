//! Couplings and clamps between gears and encoders that are bent, soft or loose.

use super::fault::{Fault, any_phase};
use super::parameters::Parameters;
use super::signature::{Accumulation, Carrier, Signature};
use crate::plant::resonance::SoftCouplingSpec;

/// The coupling between the input encoder and gear 1 runs at an angle of 0.8° and turns unevenly, as Cardan's joint does,
/// tan q_out = tan q_in/cos β: ± 49 µrad, twice a turn.
pub const INPUT_MISALIGNMENT: Fault = Fault {
    name: "coupling_misalignment_input",
    summary: "input coupling bent by 0.8°",
    usual: |_| Parameters::of(&[("beta_rad", 0.014), ("phase_rad", 1.7)]),
    vary: any_phase,
    // tan²(β/2) grows with the square of β.
    amounts: &[("beta_rad", 0.5)],
    develops: false,
    signature: Some(Signature::STEADY_EVEN.over(Carrier::Input)),
    same_trace_as: Some("encoder1_ellipticity"),
    apply: |spec, parameters| {
        spec.shafts.input_cardan_angle_rad = parameters.number("beta_rad");
        spec.shafts.input_cardan_phase_rad = parameters.number("phase_rad");
    },
};

/// The same of the coupling between gear 2 and the output encoder.
pub const OUTPUT_MISALIGNMENT: Fault = Fault {
    name: "coupling_misalignment_output",
    summary: "output coupling bent by 0.8°",
    usual: |_| Parameters::of(&[("beta_rad", 0.014), ("phase_rad", 0.5)]),
    vary: any_phase,
    amounts: &[("beta_rad", 0.5)],
    develops: false,
    signature: Some(Signature::STEADY_EVEN.over(Carrier::Output)),
    same_trace_as: Some("encoder2_ellipticity"),
    apply: |spec, parameters| {
        spec.shafts.output_cardan_angle_rad = parameters.number("beta_rad");
        spec.shafts.output_cardan_phase_rad = parameters.number("phase_rad");
    },
};

/// The output encoder hangs on a soft coupling, 12 Hz with a damping ratio of 0.05: its disc swings under the shaft's uneven
/// motion, ẍ + 2ζω ẋ + ω² x = −q̈.
pub const TORSIONAL_RESONANCE: Fault = Fault {
    name: "torsional_resonance",
    summary: "output encoder swings on its coupling at 12 Hz",
    usual: |_| Parameters::of(&[("f_hz", 12.0), ("zeta", 0.05)]),
    vary: |_, usual, rng| usual.with("zeta", rng.spread(0.02, 0.2)),
    // Far below the resonance the twist grows with 1/f².
    amounts: &[("f_hz", -0.5)],
    develops: false,
    signature: Some(Signature { speed_exponent: Some(2.0), ..Signature::STEADY_EVEN }),
    same_trace_as: None,
    apply: |spec, parameters| {
        spec.encoders.output_coupling =
            Some(SoftCouplingSpec { f_hz: parameters.number("f_hz"), zeta: parameters.number("zeta") });
    },
};

/// The clamp between gear 2 and the output encoder creeps under load: it holds up to 4 N·m, and above it gives way in small events,
/// 4 µrad per driver revolution and N·m, so the lag accumulates.
pub const SLIP: Fault = Fault {
    name: "slip",
    summary: "output clamp creeps 4 µrad per revolution and N·m above 4 N·m",
    usual: |_| Parameters::of(&[("k_rad_per_rev_nm", 4e-6), ("t0_nm", 4.0)]),
    vary: |_, usual, rng| usual.with("t0_nm", rng.between(2.0, 8.0)),
    amounts: &[("k_rad_per_rev_nm", 1.0)],
    develops: true,
    signature: Some(Signature { accumulation: Some(Accumulation::PerRevolution), ..Signature::OPEN }),
    same_trace_as: None,
    apply: |spec, parameters| {
        let clamp = &mut spec.clamp;
        clamp.creep_rad_per_rev_nm = parameters.number("k_rad_per_rev_nm");
        clamp.threshold_nm = parameters.number("t0_nm");
        // It gives way in events of half a microradian per µrad/(rev·N·m).
        clamp.event_rad = (0.5 * clamp.creep_rad_per_rev_nm).max(1e-9);
    },
};
