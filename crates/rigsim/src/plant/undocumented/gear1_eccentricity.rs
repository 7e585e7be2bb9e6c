//! Gear 1 sits on its shaft with another eccentricity than documented: the mounting was disturbed.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "gear1_eccentricity",
    summary: "gear 1 sits 11 µm off the documented centre",
    usual,
    draw,
    amounts: &[("dx_mm", 1.0), ("dy_mm", 1.0)],
    develops: false,
    apply,
};

/// Adds (+9, -6) µm to the documented vector.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("dx_mm", 0.009), ("dy_mm", -0.006)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    let angle = rng.angle();
    Parameters::of(&[("dx_mm", 0.011 * angle.cos()), ("dy_mm", 0.011 * angle.sin())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.gears.displace_gear1(parameters.number("dx_mm"), parameters.number("dy_mm"));
}
