//! The housing warms and the centre distance grows, Δa(t) = da (1 − exp(−t/τ)) since the campaign's first sample:
//! TE = −dir·Δa(t) tan(α ∓ μ)/r2. The shape is [τ].

use super::{
    Accumulates, Carrier, Effect, Estimate, Given, MeasurementPlan, NominalRig, OperatingPoint, Parameter, Parity,
    Shape, Signature, StatedError, Words,
};

/// Thermal growth of the centre distance.
pub(super) struct ThermalDrift;

impl Effect for ThermalDrift {
    fn name(&self) -> &'static str {
        "thermal_drift"
    }

    fn component(&self) -> &'static str {
        "housing and gears"
    }

    fn words(&self) -> Words {
        Words::new("thermal drift of the centre distance", "warm up before measuring, or hold the temperature")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Time, Parity::Mixed).accumulating(Accumulates::PerTime)
    }

    /// Where μ = 0 everywhere the two flanks lean alike, and nothing is left in common to both senses.
    fn signature_of(&self, rig: &NominalRig, _shape: &Shape) -> Signature {
        if rig.ratio_orders().is_empty() {
            Signature { parity: Parity::Odd, ..self.signature() }
        } else {
            self.signature()
        }
    }

    /// From a twelfth of the campaign (faster than that it is a constant) to thrice its length (a straight line).
    fn shapes(&self, _rig: &NominalRig, plan: &MeasurementPlan) -> Vec<Shape> {
        [0.08, 0.16, 0.3, 0.6, 1.2, 3.0].into_iter().map(|part| vec![part * plan.duration_s.max(1e-3)]).collect()
    }

    fn neighbours(&self, shape: &Shape, step: f64) -> Vec<Shape> {
        [-0.6, -0.3, 0.3, 0.6].into_iter().map(|part| vec![shape[0] * (part * step).exp()]).collect()
    }

    fn evolves(&self, _shape: &Shape) -> bool {
        true
    }

    fn row(&self, _rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let [tau_s] = shape[..] else { return };
        row[0] = at.sense * at.pressure_rad.tan() / at.r2_mm * (-at.time_s / tau_s).exp_m1();
    }

    fn parameters(&self, _rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("da_mm", found.beta[0], found.std(0), "mm"), Parameter::grid("tau_s", shape[0], "s")]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["da_mm", "tau_s"]
    }

    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        Ok((vec![given.number_in("tau_s", 1e-9, 1e12)?], vec![given.number("da_mm")?]))
    }
}
