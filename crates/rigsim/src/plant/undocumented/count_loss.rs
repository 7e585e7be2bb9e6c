//! The output's counter misses edges now and then, always to the same side.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "count_loss",
    summary: "output counter loses 24 counts about every 1.4 revolutions",
    usual,
    draw,
    amounts: &[("counts", 1.0)],
    develops: true,
    apply,
};

/// Loses 24 counts (21 µrad) at random, 0.7 times a driver revolution.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("counts", 24.0), ("per_rev", 0.7)])
}

/// Either sign, at a random rate.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("counts", 24.0 * rng.sign()), ("per_rev", rng.spread(0.1, 1.0))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    let loss = &mut spec.encoders.output_count_loss;
    loss.losses_per_rev = parameters.number("per_rev");
    // A counter loses whole counts.
    let counts = parameters.number("counts");
    loss.counts = counts.abs().max(1.0).round().copysign(counts) as i64;
}
