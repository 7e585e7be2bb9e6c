//! The coupling between the input encoder and gear 1 runs at an angle and turns unevenly, as Cardan's joint does: tan q_out = tan
//! q_in/cos β.

use super::{FaultRng, Parameters, PlantSpec, Undocumented};

/// The effect.
pub const EFFECT: Undocumented = Undocumented {
    name: "coupling_misalignment_input",
    summary: "input coupling bent by 0.8°",
    usual,
    draw,
    amounts: &[("beta_rad", 0.5)],
    develops: false,
    apply,
};

/// Bends the joint by 0.8°: ± 49 µrad, twice a turn.
fn usual(_: &PlantSpec) -> Parameters {
    Parameters::of(&[("beta_rad", 0.014), ("phase_rad", 1.7)])
}

/// Random in all but the size; tan²(β/2) grows with the square of β.
fn draw(_: &PlantSpec, rng: &mut FaultRng) -> Parameters {
    Parameters::of(&[("beta_rad", 0.014), ("phase_rad", rng.angle())])
}

fn apply(spec: &mut PlantSpec, parameters: &Parameters) {
    spec.shafts.input_cardan_angle_rad = parameters.number("beta_rad");
    spec.shafts.input_cardan_phase_rad = parameters.number("phase_rad");
}
