//! The effects that may stand between the nominal model and the rig, each linearised about the nominal pair.
//!
//! An effect is a block of columns over the samples' [`OperatingPoint`]s: its trace is columns · β, with amplitudes β in the
//! effect's own units and, where the trace is not linear in a parameter, a [`Shape`] that the diagnosis searches on a grid. All
//! that is known of one, its words for people included, stands in its own file; this one lists it, as a module and in [`LIBRARY`].
//! Equations stand in the files; common symbols:
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | θ1, θ2 = f(θ1), i | driver angle, driven angle, ratio i21 | rad, rad, – |
//! | dir | +1 when driving ccw, −1 cw | – |
//! | A = r2 cos(α ∓ μ) | driven base arm of the driving flank | mm |
//! | u | rolled arc in pitches from tooth 0 of the driving flank | pitches |
//! | T | load on the driven shaft | N·m |

// What effects have in common.
mod definition;
mod documented;
mod hand_test;
mod nominal_rig;
mod operating_point;
mod parameter;
mod polar;
pub mod predict;
mod shaft;
mod signature;
mod words;

// The effects.
mod backlash_error;
mod bearing_clearance;
mod bearing_compliance;
mod brake_torque_ripple;
mod centre_distance_error;
mod count_loss;
mod coupling_misalignment;
mod encoder_disc;
mod encoder_interpolation;
mod friction_windup;
mod gear_eccentricity;
mod mesh_compliance;
mod mesh_stiffness_variation;
mod phasing_error;
mod pitch_curve_error;
mod pitch_errors;
mod profile_error;
mod shaft_compliance;
mod slip;
mod thermal_drift;
mod time_skew;
mod tooth_damage;
mod torsional_resonance;
mod wear_drift;

pub use crate::stated::{Given, Stated, StatedEffect, StatedError};
pub use definition::{Effect, Fold, Rows, Shape};
pub use documented::{Documented, Term};
pub use hand_test::HandTest;
pub use nominal_rig::{MeshOrders, NominalRig};
pub use operating_point::{Grain, MOST_LOADS, MeasurementPlan, OperatingPoint, RevolutionsByLoad, nearest_level};
pub use parameter::{Parameter, ParameterKind, Value};
pub use polar::Estimate;
pub use shaft::Shaft;
pub use signature::{Accumulates, Carrier, Parity, Signature};
pub use words::{SharedTrace, Words};

use encoder_disc::{EncoderDisc, Order};

/// All effects, in the order of the rig from the input encoder to the brake.
pub static LIBRARY: &[&dyn Effect] = &[
    &gear_eccentricity::GearEccentricity(Shaft::Input),
    &gear_eccentricity::GearEccentricity(Shaft::Output),
    &centre_distance_error::CentreDistanceError,
    &backlash_error::BacklashError,
    &pitch_curve_error::PitchCurveError,
    &phasing_error::PhasingError,
    &pitch_errors::PitchErrors,
    &profile_error::ProfileError,
    &tooth_damage::ToothDamage,
    &EncoderDisc { shaft: Shaft::Input, order: Order::Eccentricity },
    &EncoderDisc { shaft: Shaft::Output, order: Order::Eccentricity },
    &EncoderDisc { shaft: Shaft::Input, order: Order::Ellipticity },
    &EncoderDisc { shaft: Shaft::Output, order: Order::Ellipticity },
    &encoder_interpolation::EncoderInterpolation(Shaft::Input),
    &encoder_interpolation::EncoderInterpolation(Shaft::Output),
    &coupling_misalignment::CouplingMisalignment(Shaft::Input),
    &coupling_misalignment::CouplingMisalignment(Shaft::Output),
    &time_skew::TimeSkew,
    &count_loss::CountLoss,
    &shaft_compliance::ShaftCompliance(Shaft::Input),
    &shaft_compliance::ShaftCompliance(Shaft::Output),
    &mesh_compliance::MeshCompliance,
    &bearing_compliance::BearingCompliance,
    &mesh_stiffness_variation::MeshStiffnessVariation,
    &bearing_clearance::BearingClearance,
    &friction_windup::FrictionWindup,
    &slip::Slip,
    &brake_torque_ripple::BrakeTorqueRipple,
    &torsional_resonance::TorsionalResonance,
    &thermal_drift::ThermalDrift,
    &wear_drift::WearDrift,
];

/// The effect of a canonical name.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static dyn Effect> {
    LIBRARY.iter().copied().find(|effect| effect.name() == name)
}
