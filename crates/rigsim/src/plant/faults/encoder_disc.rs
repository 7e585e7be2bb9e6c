//! Encoder discs that are not centred on their shaft, or were clamped out of round.

use super::fault::{Fault, any_phase};
use super::parameters::Parameters;
use super::signature::{Carrier, Signature};
use crate::plant::encoder::EncoderSpec;

/// The input encoder's disc is off centre by 4e-5 of its track radius (1.6 µm at 40 mm).
pub const INPUT_ECCENTRICITY: Fault = Fault {
    name: "encoder1_eccentricity",
    summary: "input encoder's disc off centre by 4e-5 of its radius",
    usual: |_| Parameters::of(&[("eps", 4e-5), ("phase_rad", 1.1)]),
    vary: any_phase,
    amounts: &[("eps", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_EVEN),
    same_trace_as: None,
    apply: |spec, parameters| off_centre(&mut spec.encoders.input, parameters),
};

/// The same of the output encoder's.
pub const OUTPUT_ECCENTRICITY: Fault = Fault {
    name: "encoder2_eccentricity",
    summary: "output encoder's disc off centre by 4e-5 of its radius",
    usual: |_| Parameters::of(&[("eps", 4e-5), ("phase_rad", 1.2)]),
    vary: any_phase,
    amounts: &[("eps", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_EVEN),
    same_trace_as: Some("encoder1_eccentricity"),
    apply: |spec, parameters| off_centre(&mut spec.encoders.output, parameters),
};

/// The input encoder's disc is squeezed: (b − a)/(b + a) of its half axes is 3e-5.
pub const INPUT_ELLIPTICITY: Fault = Fault {
    name: "encoder1_ellipticity",
    summary: "input encoder's disc out of round by 3e-5",
    usual: |_| Parameters::of(&[("eps", 3e-5), ("phase_rad", 0.8)]),
    vary: any_phase,
    amounts: &[("eps", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_EVEN.over(Carrier::Input)),
    same_trace_as: None,
    apply: |spec, parameters| out_of_round(&mut spec.encoders.input, parameters),
};

/// The same of the output encoder's.
pub const OUTPUT_ELLIPTICITY: Fault = Fault {
    name: "encoder2_ellipticity",
    summary: "output encoder's disc out of round by 3e-5",
    usual: |_| Parameters::of(&[("eps", 3e-5), ("phase_rad", 2.1)]),
    vary: any_phase,
    amounts: &[("eps", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_EVEN.over(Carrier::Output)),
    same_trace_as: None,
    apply: |spec, parameters| out_of_round(&mut spec.encoders.output, parameters),
};

fn off_centre(disc: &mut EncoderSpec, parameters: &Parameters) {
    (disc.eccentricity, disc.eccentricity_phase_rad) = (parameters.number("eps"), parameters.number("phase_rad"));
}

fn out_of_round(disc: &mut EncoderSpec, parameters: &Parameters) {
    (disc.ellipticity, disc.ellipticity_phase_rad) = (parameters.number("eps"), parameters.number("phase_rad"));
}
