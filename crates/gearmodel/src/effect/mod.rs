//! The effects that may stand between the nominal model and the rig, each linearised about the nominal pair.
//!
//! An effect is a block of columns over the samples' [`OperatingPoint`]s: its trace is columns · β, with amplitudes β in the
//! effect's own units and, where the trace is not linear in a parameter, a [`Shape`] that the diagnosis searches on a grid. One
//! effect = one file + one line in [`LIBRARY`]. Equations stand in the files; common symbols:
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | θ1, θ2 = f(θ1), i | driver angle, driven angle, ratio i21 | rad, rad, – |
//! | dir | +1 when driving ccw, −1 cw | – |
//! | A = r2 cos(α ∓ μ) | driven base arm of the driving flank | mm |
//! | u | rolled arc in pitches from tooth 0 of the driving flank | pitches |
//! | T | load on the driven shaft | N·m |

mod backlash_error;
mod bearing_clearance;
mod bearing_compliance;
mod brake_torque_ripple;
mod centre_distance_error;
mod count_loss;
mod coupling_misalignment;
mod documented;
mod encoder_disc;
mod encoder_interpolation;
mod friction_windup;
mod gear_eccentricity;
mod hand_test;
mod mesh_compliance;
mod mesh_stiffness_variation;
mod operating_point;
mod phasing_error;
mod pitch_curve_error;
mod pitch_errors;
mod polar;
pub mod predict;
mod profile_error;
mod rig;
mod shaft_compliance;
mod signature;
mod slip;
mod stated;
mod thermal_drift;
mod time_skew;
mod tooth_damage;
mod torsional_resonance;
mod wear_drift;

pub use documented::{Documented, Fold, Term};
pub use hand_test::HandTest;
pub use operating_point::{Grain, MOST_LOADS, OperatingPoint, Plan, RevolutionsByLoad, nearest_level};
pub use polar::Estimate;
pub use rig::{MeshOrders, Rig};
pub use signature::{Accumulates, Carrier, Parity, Signature};
pub use stated::{Given, Stated, StatedEffect, StatedError};

use encoder_disc::{EncoderDisc, Order};

/// Shaft that an effect sits on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shaft {
    /// The driver's.
    Input,
    /// The driven one.
    Output,
}

impl Shaft {
    /// What repeats with its angle.
    #[must_use]
    pub fn carrier(self) -> Carrier {
        match self {
            Self::Input => Carrier::Input,
            Self::Output => Carrier::Output,
        }
    }
}

/// Values of the parameters in which a trace is not linear; which they are, the effect knows. Empty where there are none.
pub type Shape = Vec<f64>;

/// A parameter as found: a number or, for tooth tables, one a tooth.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// One number a tooth.
    Table(Vec<f64>),
    /// A word, as a flank's name.
    Text(&'static str),
}

/// A parameter with its name and unit as in the contract of the log and the Python package.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name, unit included.
    pub name: &'static str,
    /// What was found.
    pub value: Value,
    /// Standard deviation; `None` for tables, words and grid values.
    pub std: Option<f64>,
    /// Unit as text; empty for a pure number.
    pub unit: &'static str,
}

impl Parameter {
    /// A number with its standard deviation.
    #[must_use]
    pub fn number(name: &'static str, value: f64, std: f64, unit: &'static str) -> Self {
        Self { name, value: Value::Number(value), std: Some(std), unit }
    }

    /// A value that the search found on its grid.
    #[must_use]
    pub fn grid(name: &'static str, value: f64, unit: &'static str) -> Self {
        Self { name, value: Value::Number(value), std: None, unit }
    }
}

/// Writes the row of a station.
pub type Rows<'a> = Box<dyn FnMut(&OperatingPoint, &mut [f64]) + 'a>;

/// An effect of the library.
pub trait Effect: Sync {
    /// Canonical name.
    fn name(&self) -> &'static str;

    /// Where on the rig it sits.
    fn component(&self) -> &'static str;

    /// How it shows.
    fn signature(&self) -> Signature;

    /// The same for one shape, with the sector where the trace is local.
    fn signature_of(&self, _rig: &Rig, _shape: &Shape) -> Signature {
        self.signature()
    }

    /// Whether this rig can have it.
    fn applies(&self, rig: &Rig) -> bool {
        rig.pair().has_teeth()
    }

    /// Grid of shapes to search under a plan; one empty shape where the trace is linear in all parameters.
    fn shapes(&self, _rig: &Rig, _plan: &Plan) -> Vec<Shape> {
        vec![Vec::new()]
    }

    /// Shapes about one that was found best; `step` is 1 for the grid's own distance and falls as the search closes in.
    fn neighbours(&self, _shape: &Shape, _step: f64) -> Vec<Shape> {
        Vec::new()
    }

    /// A better shape given the amplitudes found, where the trace depends on its own size.
    fn refine(&self, _rig: &Rig, _shape: &Shape, _beta: &[f64]) -> Option<Shape> {
        None
    }

    /// Columns of the block.
    fn width(&self, _rig: &Rig, _shape: &Shape) -> usize {
        1
    }

    /// Trace per unit amplitude at a station, rad; `row` has `width` entries, all zero on entry.
    fn row(&self, rig: &Rig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]);

    /// [`Effect::row`] for station after station, with what they share worked out once.
    fn rows<'a>(&'a self, rig: &'a Rig, shape: &'a Shape) -> Rows<'a> {
        Box::new(move |at, row| self.row(rig, shape, at, row))
    }

    /// True where the trace differs between revolutions of one condition.
    fn evolves(&self, _shape: &Shape) -> bool {
        false
    }

    /// Frequency at which it rings on by itself, Hz, where it does.
    fn rings_hz(&self, _shape: &Shape, _found: &Estimate) -> Option<f64> {
        None
    }

    /// The one order of a shaft that the trace is made of, where its order is open.
    fn order(&self, _shape: &Shape) -> Option<(Shaft, f64)> {
        None
    }

    /// Effects whose trace it may leave a part of, because it is known to no better than that, and that part of its RMS.
    fn leaves(&self) -> (&'static [&'static str], f64) {
        (&[], 0.0)
    }

    /// Encoder within whose lines the trace lies: it is found on the samples, for means over angle do not show it.
    fn within_lines_of(&self) -> Option<Shaft> {
        None
    }

    /// Tests by hand that tell it from others which take part in them.
    fn told_apart_by(&self) -> &'static [HandTest] {
        &[]
    }

    /// True where a shape is a list of times at which the level steps.
    fn steps(&self) -> bool {
        false
    }

    /// How fine the trace is: it is averaged over an angle bin as the samples are.
    fn grain(&self, _shape: &Shape) -> Grain {
        Grain::Smooth
    }

    /// True where a negative amplitude has no meaning.
    fn one_sided(&self) -> bool {
        false
    }

    /// Parameters in the contract's names and units.
    fn parameters(&self, rig: &Rig, shape: &Shape, found: &Estimate) -> Vec<Parameter>;

    /// The parameter that only follows from those found with the revolutions of a campaign.
    fn over_a_campaign(&self, _found: &[Parameter], _revolutions: f64) -> Option<Parameter> {
        None
    }

    /// The documented error that this effect is a change of.
    fn folds_into(&self) -> Option<Fold> {
        None
    }

    /// Names of the parameters that a file may state; one alone is that in which the trace is linear.
    fn parameter_names(&self) -> &'static [&'static str];

    /// Shape and amplitudes from stated parameters: the way back from [`Effect::stated`].
    ///
    /// # Errors
    /// [`StatedError`] that names the parameter.
    fn amplitudes(&self, _rig: &Rig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        stated::linear(given)
    }

    /// The parameters that fix the trace.
    fn stated(&self, rig: &Rig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        stated::by_parameters(self, rig, shape, beta)
    }
}

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
