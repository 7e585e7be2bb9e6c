//! With two tooth pairs in contact the mesh is stiffer than with one: TE = −dir·T·C·w(u)/A² with w = 1 − duty where one pair
//! carries and −duty elsewhere, zero in the mean over a pitch. `duty` is the share of a pitch on one pair. Shape [duty, start]:
//! the segment on one pair begins at u = start. The empty shape takes the segments from the tips of the documented teeth.

use super::{
    Carrier, Effect, Estimate, Given, Grain, MeasurementPlan, NominalRig, OperatingPoint, Parameter, Parity, Shape,
    Signature, Stated, StatedEffect, StatedError, Words,
};

/// Variation of the mesh compliance over the pitch.
pub(super) struct MeshStiffnessVariation;

const DUTIES: [f64; 5] = [0.15, 0.3, 0.45, 0.6, 0.8];

impl Effect for MeshStiffnessVariation {
    fn name(&self) -> &'static str {
        "mesh_stiffness_variation"
    }

    fn component(&self) -> &'static str {
        "gear teeth"
    }

    fn words(&self) -> Words {
        Words::new(
            "stiffness varying with the tooth mesh",
            "nothing is loose: enter it in the model, or raise the contact ratio",
        )
    }

    fn signature(&self) -> Signature {
        // The wind-up turns its sign with the sense, but the cw flanks mesh half a pitch later: odd mesh orders turn it twice.
        Signature::steady(Carrier::Mesh, Parity::Mixed).with_load(1.0)
    }

    fn shapes(&self, _rig: &NominalRig, plan: &MeasurementPlan) -> Vec<Shape> {
        if plan.loads_nm.last().is_none_or(|load| *load <= 0.0) {
            return Vec::new();
        }
        let mut shapes = vec![Vec::new()];
        for duty in DUTIES {
            // About the pitch point, from it on, and in steps of an eighth of a pitch.
            shapes.push(vec![duty, 0.0]);
            shapes.extend((0..8).map(|n| vec![duty, 0.125 * f64::from(n) - 0.5 * duty]));
        }
        shapes
    }

    fn neighbours(&self, shape: &Shape, step: f64) -> Vec<Shape> {
        let [duty, start] = shape[..] else { return Vec::new() };
        let mut shapes = Vec::new();
        for wider in [-0.07, 0.0, 0.07] {
            for later in [-0.05, 0.0, 0.05] {
                if wider != 0.0 || later != 0.0 {
                    shapes.push(vec![(duty + step * wider).clamp(0.02, 0.98), start + step * later]);
                }
            }
        }
        shapes
    }

    fn grain(&self, _shape: &Shape) -> Grain {
        Grain::Sharp
    }

    fn row(&self, rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let weight = if let [duty, start] = shape[..] {
            let from_start = at.pitches - start;
            if from_start - from_start.floor() < duty { 1.0 - duty } else { -duty }
        } else {
            f64::from(u8::from(rig.teeth_in_contact(at, 0.0).count() < 2)) - rig.single_pair_duty(at)
        };
        row[0] = -at.sense * at.load_nm * weight / (at.arm_mm * at.arm_mm);
    }

    fn parameters(&self, rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let duty = match shape.first() {
            Some(duty) => Parameter::grid("duty", *duty, ""),
            None => Parameter::derived("duty", rig.mean_single_pair_duty(), ""),
        };
        vec![Parameter::number("c_mm2_rad_per_nm", found.beta[0], found.std(0), "mm2.rad/(N.m)"), duty]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["c_mm2_rad_per_nm", "duty", "start_pitches"]
    }

    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let shape = if given.has("duty") {
            let duty = given.number_in("duty", 0.0, 1.0)?;
            // Where nothing else is said the segment on one pair lies about the pitch point.
            vec![duty, given.number_or("start_pitches", -0.5 * duty)?]
        } else {
            Shape::new()
        };
        Ok((shape, vec![given.number("c_mm2_rad_per_nm")?]))
    }

    fn stated(&self, rig: &NominalRig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        let mut stated = self.reported(rig, shape, beta);
        match shape[..] {
            [_, start] => stated.insert("start_pitches".to_owned(), Stated::Number(start)),
            // The tips of the teeth say where one pair carries.
            _ => stated.remove("duty"),
        };
        stated
    }
}
