//! Material is missing on one flank of one driver tooth: the driven gear lags by depth·cos²(π v/(2 w))/A while that tooth carries,
//! |v| < w, v = u − tooth. The shape is [tooth, flank (+1 ccw, −1 cw), width w].

use std::f64::consts::{FRAC_PI_2, PI};

use super::{
    Carrier, Effect, Estimate, Given, Grain, MeasurementPlan, NominalRig, OperatingPoint, Parameter, Parity, Shape,
    Signature, StatedError, Words,
};

/// One damaged tooth flank.
pub(super) struct ToothDamage;

/// Widths searched first, pitches.
const WIDTHS: [f64; 2] = [0.35, 0.8];

impl Effect for ToothDamage {
    fn name(&self) -> &'static str {
        "tooth_damage"
    }

    fn component(&self) -> &'static str {
        "one tooth of gear 1, or its mate"
    }

    fn words(&self) -> Words {
        Words::new("damage to one tooth", "look at the tooth and flank named")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Input, Parity::OneFlank)
    }

    fn signature_of(&self, rig: &NominalRig, shape: &Shape) -> Signature {
        let [tooth, flank, width] = shape[..] else { return self.signature() };
        let half = if flank > 0.0 { 0.0 } else { 0.5 };
        let at =
            |pitches: f64| rig.pair().theta1_at_arc_length((pitches + half) * PI * rig.pair().module_mm()).to_degrees();
        Signature { sector_deg: Some([at(tooth - width), at(tooth + width)]), ..self.signature() }
    }

    fn shapes(&self, rig: &NominalRig, plan: &MeasurementPlan) -> Vec<Shape> {
        let mut shapes = Vec::new();
        for (flank, seen) in [1.0, -1.0].into_iter().zip(plan.senses) {
            for tooth in (0..rig.pair().teeth().0).filter(|_| seen) {
                shapes.extend(WIDTHS.map(|width| vec![f64::from(tooth), flank, width]));
            }
        }
        shapes
    }

    fn neighbours(&self, shape: &Shape, step: f64) -> Vec<Shape> {
        [-0.6, -0.3, 0.3, 0.6]
            .into_iter()
            .map(|part| vec![shape[0], shape[1], (shape[2] * (1.0 + part * step)).clamp(0.05, 1.5)])
            .collect()
    }

    fn one_sided(&self) -> bool {
        true
    }

    fn grain(&self, _shape: &Shape) -> Grain {
        Grain::Fine
    }

    fn row(&self, rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let [tooth, flank, width] = shape[..] else { return };
        if flank * at.sense < 0.0 {
            return;
        }
        let teeth = f64::from(rig.pair().teeth().0);
        let from_tooth = at.pitches - tooth;
        let v = from_tooth - teeth * (from_tooth / teeth + 0.5).floor();
        if v.abs() < width {
            row[0] = -at.sense * (FRAC_PI_2 * v / width).cos().powi(2) / at.arm_mm;
        }
    }

    fn parameters(&self, _rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let [tooth, flank, width] = shape[..] else { return Vec::new() };
        vec![
            Parameter::grid("tooth", tooth, ""),
            Parameter::number("depth_mm", found.beta[0], found.std(0), "mm"),
            Parameter::grid("width", width, "pitches"),
            Parameter::word("flank", if flank > 0.0 { "ccw" } else { "cw" }),
        ]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["tooth", "depth_mm", "width", "flank"]
    }

    fn amplitudes(&self, rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let last = f64::from(rig.pair().teeth().0) - 1.0;
        let flank = if given.word("flank", &["ccw", "cw"], false)? == 0 { 1.0 } else { -1.0 };
        let shape = vec![given.number_in("tooth", 0.0, last)?.round(), flank, given.number_in("width", 0.01, 2.0)?];
        Ok((shape, vec![given.number("depth_mm")?]))
    }
}
