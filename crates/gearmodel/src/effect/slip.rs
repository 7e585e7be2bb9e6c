//! A clamp creeps above a torque: a lag of k·max(0, T − t0) a driver revolution, in the sense of motion, that stays.
//! TE = −k Σ dir·max(0, T − t0)·revolutions. The shape is [t0].

use super::{
    Accumulates, Carrier, Effect, Estimate, Given, MeasurementPlan, NominalRig, OperatingPoint, Parameter, Parity,
    Shape, Signature, StatedError, Words,
};

/// Slip of a clamp or coupling.
pub(super) struct Slip;

impl Effect for Slip {
    fn name(&self) -> &'static str {
        "slip"
    }

    fn component(&self) -> &'static str {
        "clamp or coupling"
    }

    fn words(&self) -> Words {
        Words::new(
            "slip under load",
            "tighten the clamp or coupling that slips: mark both sides with a line and load it",
        )
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::None, Parity::Odd).with_load(1.0).accumulating(Accumulates::PerRevolution)
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    /// Thresholds from none to just under the largest load. Between two loads the trace is not linear in t0 only above
    /// the lower one.
    fn shapes(&self, _rig: &NominalRig, plan: &MeasurementPlan) -> Vec<Shape> {
        let largest = plan.loads_nm.last().copied().unwrap_or(0.0);
        if largest <= 0.0 {
            return Vec::new();
        }
        (0..10).map(|n| vec![0.1 * f64::from(n) * largest]).collect()
    }

    fn neighbours(&self, shape: &Shape, step: f64) -> Vec<Shape> {
        [-0.8, -0.4, 0.4, 0.8]
            .into_iter()
            .map(|part| vec![(shape[0] + part * step * shape[0].max(1.5)).max(0.0)])
            .collect()
    }

    fn evolves(&self, _shape: &Shape) -> bool {
        true
    }

    fn one_sided(&self) -> bool {
        true
    }

    fn row(&self, _rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let [threshold_nm] = shape[..] else { return };
        let revolutions_by_load = &at.revolutions_by_load;
        row[0] = -revolutions_by_load
            .load_nm
            .iter()
            .zip(&revolutions_by_load.signed_rev)
            .map(|(load, rev)| (load - threshold_nm).max(0.0) * rev)
            .sum::<f64>();
    }

    fn parameters(&self, _rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![
            Parameter::number("k_rad_per_rev_nm", found.beta[0], found.std(0), "rad/(rev.N.m)"),
            Parameter::grid("t0_nm", shape[0], "N.m"),
        ]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["k_rad_per_rev_nm", "t0_nm"]
    }

    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        Ok((vec![given.number_in("t0_nm", 0.0, 1e9)?], vec![given.number("k_rad_per_rev_nm")?]))
    }
}
