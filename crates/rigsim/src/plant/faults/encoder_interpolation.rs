//! Encoders whose two signals are off their centre, so that every line is divided unevenly: the reading gains 20 µrad at the line
//! order.

use super::fault::{Fault, any_phase};
use super::parameters::Parameters;
use super::signature::{Accumulation, Carrier, Signature};
use crate::plant::encoder::EncoderSpec;

/// It repeats with the lines; the rest is open, for samples may be rarer than lines.
const PER_LINE: Signature =
    Signature { carrier: Some(Carrier::EncoderLine), accumulation: Some(Accumulation::None), ..Signature::OPEN };

/// The input encoder's signals.
pub const INPUT: Fault = Fault {
    name: "encoder1_interpolation",
    summary: "input encoder divides its lines unevenly, 20 µrad",
    usual: |spec| uneven(&spec.encoders.input, 0.4),
    vary: any_phase,
    amounts: &[("a_rad", 1.0)],
    develops: false,
    signature: Some(PER_LINE),
    same_trace_as: None,
    apply: |spec, parameters| divide(&mut spec.encoders.input, parameters),
};

/// The output encoder's signals.
pub const OUTPUT: Fault = Fault {
    name: "encoder2_interpolation",
    summary: "output encoder divides its lines unevenly, 20 µrad",
    usual: |spec| uneven(&spec.encoders.output, 2.6),
    vary: any_phase,
    amounts: &[("a_rad", 1.0)],
    develops: false,
    signature: Some(PER_LINE),
    same_trace_as: None,
    apply: |spec, parameters| divide(&mut spec.encoders.output, parameters),
};

fn uneven(disc: &EncoderSpec, phase_rad: f64) -> Parameters {
    Parameters::of(&[("a_rad", 2e-5), ("lines", f64::from(disc.lines)), ("phase_rad", phase_rad)])
}

fn divide(disc: &mut EncoderSpec, parameters: &Parameters) {
    // a = o/lines for the offset o in parts of the signal.
    disc.interpolation = parameters.number("a_rad") * f64::from(disc.lines);
    disc.interpolation_phase_rad = parameters.number("phase_rad");
}
