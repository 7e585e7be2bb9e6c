//! The housing warms up after the start and moves the gears apart, as 1 − exp(−t/τ).

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "thermal_drift",
    summary: "centre distance grows 20 µm within minutes",
    usual,
    draw,
    amounts: &[("da_mm", 1.0)],
    develops: true,
    apply,
};

/// Grows the centre distance by 20 µm with a time constant of 60 s.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("da_mm", 0.02), ("tau_s", 60.0)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("da_mm", 0.02), ("tau_s", rng.spread(60.0, 600.0))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.housing.growth_mm = parameters.number("da_mm");
    spec.housing.time_constant_s = parameters.number("tau_s");
}
