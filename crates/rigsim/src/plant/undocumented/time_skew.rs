//! The output encoder is latched later than the input: two readers with a clock each, or a filter in one of them.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "time_skew",
    summary: "output latched 60 µs late",
    usual,
    draw,
    amounts: &[("dt_s", 1.0)],
    develops: false,
    apply,
};

/// Latches the output 60 µs late, 31 µrad at 5 rpm and a ratio of 1.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("dt_s", 60e-6)])
}

/// Either sign.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("dt_s", 60e-6 * rng.sign())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.encoders.time_skew_s += parameters.number("dt_s");
}
