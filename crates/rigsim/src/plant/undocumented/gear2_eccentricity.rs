//! Gear 2 sits on its shaft with another eccentricity than documented: the mounting was disturbed.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "gear2_eccentricity",
    summary: "gear 2 sits 11 µm off the documented centre",
    usual,
    draw,
    amounts: &[("dx_mm", 1.0), ("dy_mm", 1.0)],
    develops: false,
    apply,
};

/// Adds (-5, +10) µm to the documented vector.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("dx_mm", -0.005), ("dy_mm", 0.01)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    let angle = rng.angle();
    Parameters::of(&[("dx_mm", 0.011 * angle.cos()), ("dy_mm", 0.011 * angle.sin())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.gears.displace_gear2(parameters.number("dx_mm"), parameters.number("dy_mm"));
}
