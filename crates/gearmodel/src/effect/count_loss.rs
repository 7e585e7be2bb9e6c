//! A counter loses (or wins) counts at the output: steps of n counts, always the same way, that stay. TE = Σ steps so far ·
//! 2π n/(counts a revolution). The shape lists the times of the steps, s (the diagnosis finds them); the amplitude is one
//! step, positive where the reading grows. The parameter `counts` is what is lost: positive where the reading falls.
//!
//! Steps too small to be seen one by one, or too many, look like a ramp over the way of the driver: the shape [−1] is that, and its
//! amplitude what is lost a revolution.

use std::f64::consts::TAU;

use super::{
    Accumulates, Carrier, Effect, Estimate, Given, MeasurementPlan, NominalRig, OperatingPoint, Parameter, Parity,
    Shape, Signature, Stated, StatedEffect, StatedError, Value, Words,
};

/// Stands for steps spread evenly over the way; times are not negative.
const RAMP: f64 = -1.0;
/// Revolutions from which a ramp over the way is looked for.
const LEAST_WAY_REV: f64 = 3.0;

fn steps_so_far(times_s: &[f64], time_s: f64) -> f64 {
    times_s.partition_point(|at_s| *at_s <= time_s) as f64
}

/// Lost counts of the output encoder.
pub(super) struct CountLoss;

impl Effect for CountLoss {
    fn name(&self) -> &'static str {
        "count_loss"
    }

    fn component(&self) -> &'static str {
        "acquisition"
    }

    fn words(&self) -> Words {
        Words::new(
            "lost counts at the output encoder",
            "check cable, screen, supply and edge rate of the output encoder",
        )
    }

    fn steps(&self) -> bool {
        true
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::None, Parity::Even).accumulating(Accumulates::PerRevolution)
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    /// Only the ramp before the residual was searched for steps.
    fn shapes(&self, _rig: &NominalRig, plan: &MeasurementPlan) -> Vec<Shape> {
        if plan.revolutions > LEAST_WAY_REV { vec![vec![RAMP]] } else { Vec::new() }
    }

    fn row(&self, _rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = if shape[..] == [RAMP] { at.way_rev } else { steps_so_far(shape, at.time_s) };
    }

    fn evolves(&self, _shape: &Shape) -> bool {
        true
    }

    fn parameters(&self, rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let mut parameters = Vec::new();
        if shape[..] == [RAMP] {
            let (rate_rad, std_rad) = (found.beta[0], found.std(0));
            if let Some(counts_per_rev) = rig.output_counts_per_rev {
                // Counts are lost at least one at a time.
                let count_rad = TAU / counts_per_rev;
                parameters.push(Parameter::derived("counts", -rate_rad.signum(), "counts"));
                parameters.push(Parameter::number("per_rev", rate_rad.abs() / count_rad, std_rad / count_rad, "1/rev"));
            }
            parameters.push(Parameter::number("rate_rad_per_rev", rate_rad, std_rad, "rad/rev"));
            return parameters;
        }
        let step_rad = found.beta[0];
        let steps = shape.len() as f64;
        if let Some(counts_per_rev) = rig.output_counts_per_rev {
            let counts = -step_rad * counts_per_rev / TAU;
            let std = found.std(0) * counts_per_rev / TAU;
            // A count is whole: a step known to a third of one is exactly that many.
            let whole = if std < 0.34 { counts.round() } else { counts };
            parameters.push(Parameter::number("counts", whole, std, "counts"));
        }
        parameters.push(Parameter::number("step_rad", step_rad, found.std(0), "rad"));
        // What lies between the places found may be one step or two.
        parameters.push(Parameter::grid("steps", steps, ""));
        parameters
    }

    /// Steps and their rate: one follows from the other.
    fn over_a_campaign(&self, found: &[Parameter], revolutions: f64) -> Option<Parameter> {
        let number = |name: &str| match found.iter().find(|p| p.name == name)?.value {
            Value::Number(x) => Some(x),
            _ => None,
        };
        match (number("steps"), number("per_rev")) {
            (Some(steps), _) => Some(Parameter::grid("per_rev", steps / revolutions, "1/rev")),
            (None, Some(per_rev)) => Some(Parameter::grid("steps", (per_rev * revolutions).round(), "")),
            (None, None) => None,
        }
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["counts", "step_rad", "steps", "per_rev", "times_s", "rate_rad_per_rev"]
    }

    fn amplitudes(&self, rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        if given.has("rate_rad_per_rev") {
            return Ok((vec![RAMP], vec![given.number("rate_rad_per_rev")?]));
        }
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

    fn stated(&self, _rig: &NominalRig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        if shape[..] == [RAMP] {
            return [("rate_rad_per_rev".to_owned(), Stated::Number(beta[0]))].into();
        }
        [("step_rad", Stated::Number(beta[0])), ("times_s", Stated::Table(shape.clone()))]
            .map(|(name, value)| (name.to_owned(), value))
            .into()
    }
}
