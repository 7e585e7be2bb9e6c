//! Somebody knocks against the rig now and then; the mount of the output encoder rings out.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use crate::plant::Oddity;

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "knocks",
    summary: "knocks against the rig, ringing out",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: true,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 4e-4), ("per_minute", 4.0), ("decay_s", 0.2), ("ring_hz", 6.0)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[
        ("a_rad", 4e-4),
        ("per_minute", rng.spread(2.0, 8.0)),
        ("decay_s", rng.spread(0.1, 0.5)),
        ("ring_hz", rng.spread(2.0, 12.0)),
    ])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(Oddity::Knocks {
        per_minute: parameters.number("per_minute"),
        size_rad: parameters.number("a_rad"),
        decay_s: parameters.number("decay_s"),
        ring_hz: parameters.number("ring_hz"),
    });
}
