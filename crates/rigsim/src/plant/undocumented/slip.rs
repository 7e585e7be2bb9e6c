//! The clamp between gear 2 and the output encoder creeps under load: it holds up to a torque, and above it gives way in small
//! events, a little every revolution, so the lag accumulates.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "slip",
    summary: "output clamp creeps 4 µrad per revolution and N·m above 4 N·m",
    usual,
    draw,
    amounts: &[("k_rad_per_rev_nm", 1.0)],
    develops: true,
    apply,
};

/// 4 µrad per driver revolution and N·m above 4 N·m.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("k_rad_per_rev_nm", 4e-6), ("t0_nm", 4.0)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("k_rad_per_rev_nm", 4e-6), ("t0_nm", rng.between(2.0, 8.0))])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    let clamp = &mut spec.clamp;
    clamp.creep_rad_per_rev_nm = parameters.number("k_rad_per_rev_nm");
    clamp.threshold_nm = parameters.number("t0_nm");
    // It gives way in events of half a microradian per µrad/(rev·N·m).
    clamp.event_rad = (0.5 * clamp.creep_rad_per_rev_nm).max(1e-9);
}
