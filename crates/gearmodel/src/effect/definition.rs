//! What an effect is.

use nalgebra::DMatrix;

use super::{
    Estimate, Grain, HandTest, MeasurementPlan, NominalRig, OperatingPoint, Parameter, Shaft, SharedTrace, Signature,
    Words,
};
use crate::stated::{Given, StatedEffect, StatedError};

/// Values of the parameters in which a trace is not linear; which they are, the effect knows. Empty where there are none.
pub type Shape = Vec<f64>;

/// Documented error that an effect is a change of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fold {
    /// e and φ of a gear.
    Eccentricity(Shaft),
    /// Compliance of a shaft.
    ShaftCompliance(Shaft),
    /// Compliance of the mesh.
    MeshCompliance,
}

/// Writes the row of a station.
pub type Rows<'a> = Box<dyn FnMut(&OperatingPoint, &mut [f64]) + 'a>;

/// An effect of the library.
pub trait Effect: Sync {
    /// Canonical name.
    fn name(&self) -> &'static str;

    /// Where on the rig it sits.
    fn component(&self) -> &'static str;

    /// What it is called at the rig, and what to do about it.
    fn words(&self) -> Words;

    /// The trace that it shares with others, whatever is run.
    fn shared_trace(&self) -> Option<SharedTrace> {
        None
    }

    /// How it shows.
    fn signature(&self) -> Signature;

    /// The same for one shape, with the sector where the trace is local.
    fn signature_of(&self, _rig: &NominalRig, _shape: &Shape) -> Signature {
        self.signature()
    }

    /// Whether this rig can have it.
    fn applies(&self, rig: &NominalRig) -> bool {
        rig.pair().has_teeth()
    }

    /// Grid of shapes to search under a plan; one empty shape where the trace is linear in all parameters.
    fn shapes(&self, _rig: &NominalRig, _plan: &MeasurementPlan) -> Vec<Shape> {
        vec![Vec::new()]
    }

    /// Shapes about one that was found best; `step` is 1 for the grid's own distance and falls as the search closes in.
    fn neighbours(&self, _shape: &Shape, _step: f64) -> Vec<Shape> {
        Vec::new()
    }

    /// A better shape given the amplitudes found, where the trace depends on its own size.
    fn refine(&self, _rig: &NominalRig, _shape: &Shape, _beta: &[f64]) -> Option<Shape> {
        None
    }

    /// Columns of the block.
    fn width(&self, _rig: &NominalRig, _shape: &Shape) -> usize {
        1
    }

    /// Trace per unit amplitude at a station, rad; `row` has `width` entries, all zero on entry.
    fn row(&self, rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]);

    /// [`Effect::row`] for station after station, with what they share worked out once.
    fn rows<'a>(&'a self, rig: &'a NominalRig, shape: &'a Shape) -> Rows<'a> {
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
    fn parameters(&self, rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter>;

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

    /// Shape and amplitudes from stated parameters, by default of an effect that is linear in all of them: the way back from [`Effect::stated`].
    ///
    /// # Errors
    /// [`StatedError`] that names the parameter.
    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let beta = given.names().iter().map(|name| given.number(name)).collect::<Result<_, _>>()?;
        Ok((Shape::new(), beta))
    }

    /// The parameters that fix the trace.
    fn stated(&self, rig: &NominalRig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        self.reported(rig, shape, beta)
    }

    /// The parameters of [`Effect::parameters`], as far as a file may state them.
    fn reported(&self, rig: &NominalRig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        let known = Estimate { beta: beta.to_vec(), covariance: DMatrix::zeros(beta.len(), beta.len()) };
        self.parameters(rig, shape, &known)
            .into_iter()
            .filter(|parameter| self.parameter_names().contains(&parameter.name))
            .map(|parameter| (parameter.name.to_owned(), parameter.value.into()))
            .collect()
    }
}
