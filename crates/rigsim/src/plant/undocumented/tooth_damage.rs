//! Material is missing on one flank of one tooth of the driver: the driven gear lags by depth · cos²(π u/(2 w)) along the normal
//! where the tooth is |u| < w pitches from the pitch point.

use super::{FaultRng, Parameters, PlantSpec, Undocumented, Value};
use crate::plant::{DamageSpec, Flank};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "tooth_damage",
    summary: "tooth 12's ccw flank is pitted 15 µm deep",
    usual,
    draw,
    amounts: &[("depth_mm", 1.0)],
    develops: false,
    apply,
};

/// 15 µm on the ccw flank of tooth 12, 0.6 pitches wide.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("tooth", 12.0), ("depth_mm", 0.015), ("width", 0.6)]).with("flank", Value::Word("ccw".into()))
}

/// Random in all but the size.
fn draw(spec: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    let flank = if rng.sign() > 0.0 { "ccw" } else { "cw" };
    let tooth = rng.below(spec.gears.teeth[0] as usize) as f64;
    Parameters::of(&[("tooth", tooth), ("depth_mm", 0.015), ("width", rng.between(0.4, 1.2))])
        .with("flank", Value::Word(flank.into()))
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.teeth.damage = Some(DamageSpec {
        tooth: parameters.number("tooth") as u32,
        flank: if parameters.word("flank") == "cw" { Flank::Cw } else { Flank::Ccw },
        depth_mm: parameters.number("depth_mm"),
        width: parameters.number("width"),
    });
}
