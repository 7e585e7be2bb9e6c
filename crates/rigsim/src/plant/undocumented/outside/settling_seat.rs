//! After a reversal into one sense the output encoder's seat settles over a turn or two; after the other it does not.

use super::super::{FaultRng, Parameters, PlantSpec, Undocumented};
use crate::plant::Oddity;

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "settling_seat",
    summary: "encoder's seat settles after reversals to cw",
    usual,
    draw,
    amounts: &[("a_rad", 1.0)],
    develops: true,
    apply,
};

/// A size that shows.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("a_rad", 1e-4), ("travel_rad", 9.0), ("sense", -1.0)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("a_rad", 1e-4 * rng.sign()), ("travel_rad", rng.spread(5.0, 15.0)), ("sense", rng.sign())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.oddities.push(Oddity::Settling {
        sense: parameters.number("sense"),
        size_rad: parameters.number("a_rad"),
        travel_rad: parameters.number("travel_rad"),
    });
}
