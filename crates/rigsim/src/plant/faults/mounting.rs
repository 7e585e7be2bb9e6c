//! Gears that sit elsewhere than documented: on their shafts, against each other, against the encoder's index.

use super::fault::Fault;
use super::fault_rng::FaultRng;
use super::parameters::Parameters;
use super::signature::Signature;
use crate::plant::spec::PlantSpec;

/// Gear 1 sits on its shaft with another eccentricity than documented, as after its mounting was disturbed: (+9, −6) µm on top
/// of the documented vector.
pub const GEAR1_ECCENTRICITY: Fault = Fault {
    name: "gear1_eccentricity",
    summary: "gear 1 sits 11 µm off the documented centre",
    usual: |_| Parameters::of(&[("dx_mm", 0.009), ("dy_mm", -0.006)]),
    vary: displaced_anywhere,
    amounts: &[("dx_mm", 1.0), ("dy_mm", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY),
    same_trace_as: None,
    apply: |spec, parameters| spec.gears.displace_gear1(parameters.number("dx_mm"), parameters.number("dy_mm")),
};

/// The same of gear 2, by (−5, +10) µm.
pub const GEAR2_ECCENTRICITY: Fault = Fault {
    name: "gear2_eccentricity",
    summary: "gear 2 sits 11 µm off the documented centre",
    usual: |_| Parameters::of(&[("dx_mm", -0.005), ("dy_mm", 0.01)]),
    vary: displaced_anywhere,
    amounts: &[("dx_mm", 1.0), ("dy_mm", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY),
    same_trace_as: None,
    apply: |spec, parameters| spec.gears.displace_gear2(parameters.number("dx_mm"), parameters.number("dy_mm")),
};

/// The housing was bored, or the slide set, with another centre distance than the pair closes at: 30 µm too large.
pub const CENTRE_DISTANCE_ERROR: Fault = Fault {
    name: "centre_distance_error",
    summary: "centre distance 30 µm too large",
    usual: |_| Parameters::of(&[("da_mm", 0.03)]),
    vary: |_, usual, rng| usual.times("da_mm", rng.sign()),
    amounts: &[("da_mm", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY),
    same_trace_as: None,
    apply: |spec, parameters| spec.gears.centre_distance_error_mm += parameters.number("da_mm"),
};

/// Gear 1 is clocked against the index of its encoder: it stands 50 µrad ahead of what the encoder reads.
pub const PHASING_ERROR: Fault = Fault {
    name: "phasing_error",
    summary: "gear 1 clocked 50 µrad ahead of its index",
    usual: |_| Parameters::of(&[("delta_rad", 5e-5)]),
    vary: |_, usual, rng| usual.times("delta_rad", rng.sign()),
    amounts: &[("delta_rad", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_EVEN),
    same_trace_as: Some("encoder1_eccentricity"),
    apply: |spec, parameters| spec.encoders.input.clocking_rad += parameters.number("delta_rad"),
};

/// The bearings have play, 3 µm along the normal: the force of the teeth pushes the gears apart until it is used up, whatever
/// its size.
pub const BEARING_CLEARANCE: Fault = Fault {
    name: "bearing_clearance",
    summary: "bearings with 3 µm of play",
    usual: |_| Parameters::of(&[("c_mm", 3e-3)]),
    vary: |_, usual, _| usual,
    amounts: &[("c_mm", 1.0)],
    develops: false,
    signature: Some(Signature::STEADY_ODD),
    same_trace_as: Some("backlash_error"),
    apply: |spec, parameters| spec.bearings.clearance_mm += parameters.number("c_mm"),
};

/// 11 µm in any direction.
fn displaced_anywhere(_: &PlantSpec, _: Parameters, rng: &mut FaultRng) -> Parameters {
    let angle = rng.angle();
    Parameters::of(&[("dx_mm", 0.011 * angle.cos()), ("dy_mm", 0.011 * angle.sin())])
}
