//! The same deviation of form on every tooth: a lead Σ a_h sin(2π h u − φ_h) along the normal for h = 1, 2, 3, TE = lead/A.
//!
//! Shape [0]: alike in both senses over the rolled arc, u counted from tooth 0's ccw flank in both; shape [1]: a deviation a flank,
//! the parameters being the ccw flank's; shape [2]: one deviation for both flanks, u counted from each flank's own tooth 0, so that
//! odd orders turn their sign with the sense at equal θ1. Waves by cosine (`contact::Profile`) have their phase φ + π/2.

use std::f64::consts::TAU;

use super::{
    Carrier, Effect, Estimate, Given, Grain, MeasurementPlan, NominalRig, OperatingPoint, Parameter, Parity, Shape,
    Signature, Stated, StatedEffect, StatedError, Words,
};

/// Profile deviation by mesh orders.
pub(super) struct ProfileError;

/// Alike in both senses over the rolled arc.
const ALIKE: f64 = 0.0;
/// A deviation a flank.
const A_FLANK: f64 = 1.0;
/// One deviation, counted from each flank's own tooth 0.
const OWN_ZERO: f64 = 2.0;
const ORDERS: usize = 3;
/// Parameters that a file may state: both flanks, or those driving ccw, then those driving cw.
const STATED: [&str; 4 * ORDERS] = [
    "a1_mm",
    "ph1_rad",
    "a2_mm",
    "ph2_rad",
    "a3_mm",
    "ph3_rad",
    "a1_cw_mm",
    "ph1_cw_rad",
    "a2_cw_mm",
    "ph2_cw_rad",
    "a3_cw_mm",
    "ph3_cw_rad",
];
const NAMES: [[&str; 2]; ORDERS] = [["a1_mm", "ph1_rad"], ["a2_mm", "ph2_rad"], ["a3_mm", "ph3_rad"]];

impl Effect for ProfileError {
    fn name(&self) -> &'static str {
        "profile_error"
    }

    fn component(&self) -> &'static str {
        "gear teeth"
    }

    fn words(&self) -> Words {
        Words::new(
            "profile error of the flanks",
            "measure the flank profile; the same form at every tooth points to the tool",
        )
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Mesh, Parity::Even)
    }

    fn signature_of(&self, _rig: &NominalRig, shape: &Shape) -> Signature {
        if shape[..] == [ALIKE] { self.signature() } else { Signature { parity: Parity::Mixed, ..self.signature() } }
    }

    fn shapes(&self, _rig: &NominalRig, plan: &MeasurementPlan) -> Vec<Shape> {
        if plan.senses == [true, true] { vec![vec![ALIKE], vec![A_FLANK], vec![OWN_ZERO]] } else { vec![vec![ALIKE]] }
    }

    fn width(&self, _rig: &NominalRig, shape: &Shape) -> usize {
        if shape[..] == [A_FLANK] { 4 * ORDERS } else { 2 * ORDERS }
    }

    fn grain(&self, _shape: &Shape) -> Grain {
        Grain::Fine
    }

    fn row(&self, _rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let first = if shape[..] == [A_FLANK] && at.sense < 0.0 { 2 * ORDERS } else { 0 };
        // `pitches` counts from each flank's own tooth 0: the cw flank's passes half a pitch later.
        let from_ccw = if shape[..] == [OWN_ZERO] || at.sense > 0.0 { 0.0 } else { 0.5 };
        for h in 0..ORDERS {
            let (sin, cos) = (TAU * (h + 1) as f64 * (at.pitches + from_ccw)).sin_cos();
            row[first + 2 * h] = sin / at.arm_mm;
            row[first + 2 * h + 1] = cos / at.arm_mm;
        }
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        (0..ORDERS)
            .flat_map(|h| {
                let polar = found.polar(2 * h);
                [
                    Parameter::number(NAMES[h][0], polar.amplitude, polar.amplitude_std, "mm"),
                    Parameter::phase(NAMES[h][1], polar.phase_rad, polar.phase_std_rad),
                ]
            })
            .collect()
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &STATED
    }

    fn amplitudes(&self, _rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let both = !STATED[2 * ORDERS..].iter().any(|name| given.has(name));
        let waves = if both { ORDERS } else { 2 * ORDERS };
        let mut beta = Vec::with_capacity(2 * waves);
        for pair in STATED[..2 * waves].chunks_exact(2) {
            // a sin(x − φ) = a cos φ sin x − a sin φ cos x.
            let (a_mm, phase_rad) = (given.number_or(pair[0], 0.0)?, given.number_or(pair[1], 0.0)?);
            beta.extend([a_mm * phase_rad.cos(), -a_mm * phase_rad.sin()]);
        }
        Ok((vec![if both { ALIKE } else { A_FLANK }], beta))
    }

    fn stated(&self, _rig: &NominalRig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        let mut stated = StatedEffect::new();
        let mut beta = beta.to_vec();
        if shape[..] == [OWN_ZERO] {
            // As a deviation a flank: half a pitch later odd orders have the other sign.
            let other: Vec<f64> = beta.iter().enumerate().map(|(n, b)| if n / 2 % 2 == 0 { -b } else { *b }).collect();
            beta.extend(other);
        }
        for (pair, wave) in STATED.chunks_exact(2).zip(beta.chunks_exact(2)) {
            stated.insert(pair[0].to_owned(), Stated::Number(wave[0].hypot(wave[1])));
            stated.insert(pair[1].to_owned(), Stated::Number((-wave[1]).atan2(wave[0])));
        }
        stated
    }
}
