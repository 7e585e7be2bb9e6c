//! The output encoder's disc was clamped out of round.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "encoder2_ellipticity",
    summary: "output encoder's disc out of round by 3e-5",
    usual,
    draw,
    amounts: &[("eps", 1.0)],
    develops: false,
    apply,
};

/// Squeezes the disc: (b − a)/(b + a) of its half axes becomes 3e-5.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("eps", 3e-5), ("phase_rad", 2.1)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("eps", 3e-5), ("phase_rad", rng.angle())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    let disc = &mut spec.encoders.output;
    (disc.ellipticity, disc.ellipticity_phase_rad) = (parameters.number("eps"), parameters.number("phase_rad"));
}
