//! The same deviation of form on every tooth: lead Σ a_h cos(2π h u − φ_h) along the normal for h = 1, 2, 3, TE = lead/A. Shape
//! [0]: one deviation for both flanks, counted from each flank's own tooth 0; shape [1]: a deviation a flank.

use std::f64::consts::TAU;

use super::{
    Carrier, Effect, Estimate, Given, Parameter, Parity, Plan, Rig, Shape, Signature, Stated, StatedEffect,
    StatedError, Station,
};

/// Profile deviation by mesh orders.
pub(super) struct ProfileError;

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

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Mesh, Parity::Mixed)
    }

    fn shapes(&self, _rig: &Rig, plan: &Plan) -> Vec<Shape> {
        if plan.senses == [true, true] { vec![vec![0.0], vec![1.0]] } else { vec![vec![0.0]] }
    }

    fn width(&self, _rig: &Rig, shape: &Shape) -> usize {
        if shape[..] == [1.0] { 4 * ORDERS } else { 2 * ORDERS }
    }

    fn row(&self, _rig: &Rig, shape: &Shape, at: &Station, row: &mut [f64]) {
        let first = if shape[..] == [1.0] && at.sense < 0.0 { 2 * ORDERS } else { 0 };
        for h in 0..ORDERS {
            let (sin, cos) = (TAU * (h + 1) as f64 * at.pitches).sin_cos();
            // a cos(x − φ) = a sin(x − (φ − π/2)): columns sin, cos.
            row[first + 2 * h] = sin / at.arm_mm;
            row[first + 2 * h + 1] = cos / at.arm_mm;
        }
    }

    fn parameters(&self, _rig: &Rig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        (0..ORDERS)
            .flat_map(|h| {
                let polar = found.polar(2 * h);
                let phase_rad = (polar.phase_rad + 0.25 * TAU + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
                [
                    Parameter::number(NAMES[h][0], polar.amplitude, polar.amplitude_std, "mm"),
                    Parameter::number(NAMES[h][1], phase_rad, polar.phase_std_rad, "rad"),
                ]
            })
            .collect()
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &STATED
    }

    fn amplitudes(&self, _rig: &Rig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let both = !STATED[2 * ORDERS..].iter().any(|name| given.has(name));
        let waves = if both { ORDERS } else { 2 * ORDERS };
        let mut beta = Vec::with_capacity(2 * waves);
        for pair in STATED[..2 * waves].chunks_exact(2) {
            // a cos(x − φ) = a sin φ sin x + a cos φ cos x.
            let (a_mm, phase_rad) = (given.number_or(pair[0], 0.0)?, given.number_or(pair[1], 0.0)?);
            beta.extend([a_mm * phase_rad.sin(), a_mm * phase_rad.cos()]);
        }
        Ok((vec![if both { 0.0 } else { 1.0 }], beta))
    }

    fn stated(&self, _rig: &Rig, _shape: &Shape, beta: &[f64]) -> StatedEffect {
        let mut stated = StatedEffect::new();
        for (pair, wave) in STATED.chunks_exact(2).zip(beta.chunks_exact(2)) {
            stated.insert(pair[0].to_owned(), Stated::Number(wave[0].hypot(wave[1])));
            stated.insert(pair[1].to_owned(), Stated::Number(wave[0].atan2(wave[1])));
        }
        stated
    }
}
