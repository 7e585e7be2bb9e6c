//! The brake's torque ripples with order n of the driven shaft, T (1 + ρ sin(nθ2 − φ)), and winds the train up:
//! TE = −dir·T·C(θ1)·ρ sin(nθ2 − φ), C the documented compliance of the train. The shape is [n].

use super::{
    Carrier, Effect, Estimate, Given, MeasurementPlan, NominalRig, OperatingPoint, Parameter, Parity, Shaft, Shape,
    Signature, StatedError, Words,
};

/// Torque ripple of the brake.
pub(super) struct BrakeTorqueRipple;

impl Effect for BrakeTorqueRipple {
    fn name(&self) -> &'static str {
        "brake_torque_ripple"
    }

    fn component(&self) -> &'static str {
        "brake"
    }

    fn words(&self) -> Words {
        Words::new("torque ripple of the brake", "record the torque beside the angle, or use a smoother brake")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Output, Parity::Odd).with_load(1.0)
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn shapes(&self, _rig: &NominalRig, plan: &MeasurementPlan) -> Vec<Shape> {
        if plan.loads_nm.last().is_none_or(|load| *load <= 0.0) {
            return Vec::new();
        }
        (1..=12).map(|order| vec![f64::from(order)]).collect()
    }

    fn width(&self, _rig: &NominalRig, _shape: &Shape) -> usize {
        2
    }

    fn order(&self, shape: &Shape) -> Option<(Shaft, f64)> {
        Some((Shaft::Output, *shape.first()?))
    }

    fn row(&self, rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let [order] = shape[..] else { return };
        let windup_rad = -at.sense * at.load_nm * rig.train_compliance_rad_per_nm(at);
        let (sin, cos) = (order * at.theta2_rad).sin_cos();
        row[0] = windup_rad * sin;
        row[1] = windup_rad * cos;
    }

    fn parameters(&self, _rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let mut parameters = found.polar(0).parameters("rho", "");
        parameters.insert(1, Parameter::grid("n", shape[0], ""));
        parameters
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["rho", "n", "phase_rad"]
    }

    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        Ok((vec![given.number_in("n", 1.0, 1e4)?], given.polar("rho")?))
    }
}
