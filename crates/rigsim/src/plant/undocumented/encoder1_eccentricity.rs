//! The input encoder's disc is not centred on the shaft.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "encoder1_eccentricity",
    summary: "input encoder's disc off centre by 4e-5 of its radius",
    usual,
    draw,
    amounts: &[("eps", 1.0)],
    develops: false,
    apply,
};

/// Displaces the disc by 4e-5 of its track radius (1.6 µm at 40 mm).
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("eps", 4e-5), ("phase_rad", 1.1)])
}

/// Random in all but the size.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("eps", 4e-5), ("phase_rad", rng.angle())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    let disc = &mut spec.encoders.input;
    (disc.eccentricity, disc.eccentricity_phase_rad) = (parameters.number("eps"), parameters.number("phase_rad"));
}
