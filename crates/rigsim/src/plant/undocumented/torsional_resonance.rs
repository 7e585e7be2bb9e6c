//! The output encoder hangs on a soft coupling: its disc swings under the shaft's uneven motion, ẍ + 2ζω ẋ + ω² x = −q̈.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};
use crate::plant::SoftCouplingSpec;

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "torsional_resonance",
    summary: "output encoder swings on its coupling at 12 Hz",
    usual,
    draw,
    amounts: &[("f_hz", -0.5)],
    develops: false,
    apply,
};

/// 12 Hz, a damping ratio of 0.05.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("f_hz", 12.0), ("zeta", 0.05)])
}

/// Random in all but the size; far below the resonance the twist grows with 1/f².
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("f_hz", 12.0), ("zeta", rng.spread(0.02, 0.2))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.encoders.output_coupling =
        Some(SoftCouplingSpec { f_hz: parameters.number("f_hz"), zeta: parameters.number("zeta") });
}
