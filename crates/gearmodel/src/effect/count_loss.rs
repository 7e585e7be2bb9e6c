//! A counter loses (or wins) counts at the output: steps of n counts, always the same way, that stay. TE = Σ steps so far ·
//! 2π n/(counts a revolution). The shape lists the times of the steps, s (`gap::events` finds them); the amplitude is one
//! step, positive where the reading grows. The parameter `counts` is what is lost: positive where the reading falls.

use std::f64::consts::TAU;

use super::{
    Accumulates, Carrier, Effect, Estimate, Given, Parameter, Parity, Plan, Rig, Shape, Signature, Stated,
    StatedEffect, StatedError, Station,
};

/// Lost counts of the output encoder.
pub(super) struct CountLoss;

impl Effect for CountLoss {
    fn name(&self) -> &'static str {
        "count_loss"
    }

    fn component(&self) -> &'static str {
        "acquisition"
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::None, Parity::Even).accumulating(Accumulates::PerRevolution)
    }

    fn applies(&self, _rig: &Rig) -> bool {
        true
    }

    /// None before the residual was searched for steps.
    fn shapes(&self, _rig: &Rig, _plan: &Plan) -> Vec<Shape> {
        Vec::new()
    }

    fn row(&self, _rig: &Rig, shape: &Shape, at: &Station, row: &mut [f64]) {
        row[0] = shape.partition_point(|time_s| *time_s <= at.time_s) as f64;
    }

    fn evolves(&self) -> bool {
        true
    }

    fn parameters(&self, rig: &Rig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let step_rad = found.beta[0];
        let steps = shape.len() as f64;
        let mut parameters = Vec::new();
        if let Some(counts_per_rev) = rig.output_counts_per_rev {
            let counts = -step_rad * counts_per_rev / TAU;
            let std = found.std(0) * counts_per_rev / TAU;
            // A count is whole: a step known to a third of one is exactly that many.
            let whole = if std < 0.34 { counts.round() } else { counts };
            parameters.push(Parameter::number("counts", whole, std, "counts"));
        }
        parameters.push(Parameter::number("step_rad", step_rad, found.std(0), "rad"));
        parameters.push(Parameter::number("steps", steps, 0.0, ""));
        parameters
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["counts", "step_rad", "steps", "per_rev", "times_s"]
    }

    fn amplitudes(&self, rig: &Rig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let step_rad = match rig.output_counts_per_rev {
            Some(counts_per_rev) if given.has("counts") && !given.has("step_rad") => {
                -given.number("counts")? * TAU / counts_per_rev
            }
            _ => given.number("step_rad")?,
        };
        let mut times_s = given.table("times_s", None)?.to_vec();
        times_s.sort_by(f64::total_cmp);
        Ok((times_s, vec![step_rad]))
    }

    fn stated(&self, _rig: &Rig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        [("step_rad", Stated::Number(beta[0])), ("times_s", Stated::Table(shape.clone()))]
            .map(|(name, value)| (name.to_owned(), value))
            .into()
    }
}
