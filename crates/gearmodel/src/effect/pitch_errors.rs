//! Each driver tooth's flank stands off its place by d_j along the normal (+ = driven gear moved ahead). Of the pairs in
//! contact the most advanced in the sense of motion carries: TE = max_j d_j/A driving ccw, min_j d_j/A driving cw. A
//! displaced tooth shows alike in both senses, a thicker one with opposite signs; the mean over a flank is a backlash. Where
//! Z1 = Z2 a driver tooth always meets the same driven one, and d_j is the sum of both.
//!
//! The trace is linear in d once it is known which pair carries. The shape holds the table that decides it (empty: all pairs
//! in contact share alike) and how far the tips reach, which decides when; `refine` moves the table to the one found. Tips as cut
//! are chamfered, relieved or a little long: their reach is found from the data, 0 for the nominal tips, 1 for those of a rack.

use std::f64::consts::TAU;

use super::{
    Carrier, Effect, Estimate, Given, Grain, NominalRig, OperatingPoint, Parameter, Parity, Shape, Signature,
    StatedError, Words,
};

/// Pitch errors of the driver's teeth, flank by flank.
pub(super) struct PitchErrors;

fn teeth(rig: &NominalRig) -> usize {
    rig.pair().teeth().0 as usize
}

/// Zero-mean waves over the teeth, orthonormal: value of wave `n` (of Z − 1) at tooth `j`.
fn wave(n: usize, j: usize, teeth: usize) -> f64 {
    let order = n / 2 + 1;
    let angle_rad = TAU * (order * j % teeth) as f64 / teeth as f64;
    if 2 * order == teeth {
        return angle_rad.cos() / (teeth as f64).sqrt();
    }
    let scale = (2.0 / teeth as f64).sqrt();
    if n.is_multiple_of(2) { scale * angle_rad.cos() } else { scale * angle_rad.sin() }
}

/// Furthest reach tried on either side of the nominal tips', and first step on the way there.
const FURTHEST: f64 = 1.5;
const REACH_STEP: f64 = 0.5;
/// Steps of the search at which the reach is moved too.
const REACH_FROM: f64 = 0.1;

/// Reach of a shape.
fn reach(shape: &Shape, teeth: usize) -> f64 {
    shape.get(2 * teeth).copied().unwrap_or(0.0)
}

/// Displacements by tooth, ccw flanks then cw flanks, from the waves' amplitudes.
fn table(beta: &[f64], teeth: usize) -> Vec<f64> {
    let waves = teeth - 1;
    (0..2 * teeth)
        .map(|place| {
            let (side, j) = (place / teeth, place % teeth);
            (0..waves).map(|n| beta[side * waves + n] * wave(n, j, teeth)).sum()
        })
        .collect()
}

impl Effect for PitchErrors {
    fn name(&self) -> &'static str {
        "pitch_errors"
    }

    fn component(&self) -> &'static str {
        "gear teeth"
    }

    fn words(&self) -> Words {
        Words::new(
            "pitch errors of the teeth",
            "measure the pitch of the worst teeth named and regrind or replace the gear",
        )
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Input, Parity::Mixed)
    }

    fn applies(&self, rig: &NominalRig) -> bool {
        teeth(rig) > 2
    }

    fn width(&self, rig: &NominalRig, _shape: &Shape) -> usize {
        2 * (teeth(rig) - 1)
    }

    fn neighbours(&self, shape: &Shape, step: f64) -> Vec<Shape> {
        // Before a table is known all pairs share alike.
        let Some((reach, table)) = shape.split_last().filter(|_| step > REACH_FROM) else { return Vec::new() };
        [-1.0, 1.0]
            .map(|side: f64| (reach + side * step * REACH_STEP).clamp(-FURTHEST, FURTHEST))
            .map(|other| table.iter().copied().chain([other]).collect())
            .into()
    }

    fn refine(&self, rig: &NominalRig, shape: &Shape, beta: &[f64]) -> Option<Shape> {
        let mut refined = table(beta, teeth(rig));
        refined.push(reach(shape, teeth(rig)));
        Some(refined)
    }

    fn grain(&self, _shape: &Shape) -> Grain {
        Grain::Sharp
    }

    /// A mean over the flanks is a backlash, and which teeth carry how long, hence the mean of those that do, is known roughly.
    fn leaves(&self) -> (&'static [&'static str], f64) {
        (&["backlash_error", "bearing_clearance", "centre_distance_error"], 0.4)
    }

    fn row(&self, rig: &NominalRig, shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        let teeth = teeth(rig);
        let side = usize::from(at.sense < 0.0);
        let waves = teeth - 1;
        let scale = (2.0 / teeth as f64).sqrt() / at.arm_mm;
        let mut add = |tooth: usize, share: f64| {
            // `wave` for all n, each order turned on from the one before.
            let (sin, cos) = (TAU * tooth as f64 / teeth as f64).sin_cos();
            let (mut s, mut c) = (share * scale * sin, share * scale * cos);
            let mut orders = row[side * waves..(side + 1) * waves].chunks_exact_mut(2);
            for order in &mut orders {
                order[0] += c;
                order[1] += s;
                (s, c) = (s * cos + c * sin, c * cos - s * sin);
            }
            if let [last] = orders.into_remainder() {
                *last += c * std::f64::consts::FRAC_1_SQRT_2;
            }
        };
        if shape.is_empty() {
            let pairs = rig.teeth_in_contact(at, 0.0).count().max(1) as f64;
            rig.teeth_in_contact(at, 0.0).for_each(|tooth| add(tooth, 1.0 / pairs));
        } else {
            let lead = |tooth: &usize| at.sense * shape[side * teeth + tooth];
            if let Some(tooth) =
                rig.teeth_in_contact(at, reach(shape, teeth)).max_by(|a, b| lead(a).total_cmp(&lead(b)))
            {
                add(tooth, 1.0);
            }
        }
    }

    fn parameters(&self, rig: &NominalRig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let teeth = teeth(rig);
        let mut ccw = table(&found.beta, teeth);
        let cw = ccw.split_off(teeth);
        vec![
            Parameter::table("ccw_mm", ccw, "mm"),
            Parameter::table("cw_mm", cw, "mm"),
            Parameter::grid("tip_reach", reach(shape, teeth), ""),
        ]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["ccw_mm", "cw_mm", "tip_reach"]
    }

    fn amplitudes(&self, rig: &NominalRig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let teeth = teeth(rig);
        let mut beta = Vec::with_capacity(2 * (teeth - 1));
        for name in ["ccw_mm", "cw_mm"] {
            // The waves have no mean: a mean is a backlash, and stands there.
            let errors_mm = given.table(name, Some(teeth))?;
            beta.extend(
                (0..teeth - 1).map(|n| errors_mm.iter().enumerate().map(|(j, x)| x * wave(n, j, teeth)).sum::<f64>()),
            );
        }
        let mut shape = table(&beta, teeth);
        shape.push(given.number_or("tip_reach", 0.0)?);
        Ok((shape, beta))
    }
}
