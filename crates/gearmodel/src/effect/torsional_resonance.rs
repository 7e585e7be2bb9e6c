//! The drive train rings: an excitation at the mesh (kind 1) or once a turn (kind 0) comes through amplified by
//! H(ν) = 1/(1 − (ν/f)² + 2jζ ν/f) at its frequency ν. Its part beyond the quasi-static one is the trace:
//! TE = Re[(H(ν) − 1)·a e^{jx}], x = 2π u or θ1. The shape is [kind, f, ζ].

use std::f64::consts::TAU;

use super::{
    Carrier, Effect, Estimate, Given, Parameter, Parity, Plan, Rig, Shape, Signature, Stated, StatedEffect,
    StatedError, Station, stated,
};

/// What excites it, as a file states it: kind 1, then kind 0.
const EXCITED_BY: [&str; 2] = ["mesh", "turn"];

/// Torsional resonance of the drive train.
pub(super) struct TorsionalResonance;

impl Effect for TorsionalResonance {
    fn name(&self) -> &'static str {
        "torsional_resonance"
    }

    fn component(&self) -> &'static str {
        "drive train"
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Mesh, Parity::Mixed).with_speed(Some(2.0))
    }

    fn applies(&self, _rig: &Rig) -> bool {
        true
    }

    fn shapes(&self, rig: &Rig, plan: &Plan) -> Vec<Shape> {
        let (Some(low), Some(high)) = (plan.speeds_rad_per_s.first(), plan.speeds_rad_per_s.last()) else {
            return Vec::new();
        };
        // At one speed nothing tells a resonance from its excitation.
        if *high < 1.2 * low {
            return Vec::new();
        }
        let mut shapes = Vec::new();
        for (kind, per_turn) in [(0.0, 1.0), (1.0, f64::from(rig.pair().teeth().0))] {
            if per_turn == 0.0 {
                continue;
            }
            for n in 0..8 {
                let f_hz = per_turn * high / TAU * 0.4 * 1.35_f64.powi(n);
                shapes.extend([0.02, 0.1].map(|zeta| vec![kind, f_hz, zeta]));
            }
        }
        shapes
    }

    fn neighbours(&self, shape: &Shape) -> Vec<Shape> {
        let [kind, f_hz, zeta] = shape[..] else { return Vec::new() };
        let mut shapes = Vec::new();
        for factor in [0.85, 0.92, 0.96, 0.98, 1.0, 1.02, 1.04, 1.08, 1.16] {
            for damping in [0.6, 1.0, 1.6] {
                shapes.push(vec![kind, f_hz * factor, (zeta * damping).clamp(0.005, 0.5)]);
            }
        }
        shapes
    }

    fn width(&self, _rig: &Rig, _shape: &Shape) -> usize {
        2
    }

    fn row(&self, rig: &Rig, shape: &Shape, at: &Station, row: &mut [f64]) {
        let [kind, f_hz, zeta] = shape[..] else { return };
        let (phase_rad, frequency_hz) = if kind == 1.0 {
            // u advances by Z/perimeter·ds/dθ1 a radian: with ds = r1/cos μ dθ1 the mesh frequency follows the local radius.
            let lean_rad = at.sense * (rig.pair().pressure_angle_rad() - at.pressure_rad);
            let pitches_per_rad =
                at.r2_mm * at.ratio / lean_rad.cos() * f64::from(rig.pair().teeth().0) / rig.pair().perimeter_mm();
            (TAU * at.pitches, pitches_per_rad * at.speed_rad_per_s.abs())
        } else {
            (at.theta1_rad, at.speed_rad_per_s.abs() / TAU)
        };
        let x = frequency_hz / f_hz;
        let (re, im) = (1.0 - x * x, 2.0 * zeta * x);
        let size = re * re + im * im;
        // H − 1, and the sense in which the phase runs.
        let (gain, turn) = (re / size - 1.0, -im / size * at.sense);
        let (sin, cos) = phase_rad.sin_cos();
        row[0] = gain * sin + turn * cos;
        row[1] = gain * cos - turn * sin;
    }

    fn parameters(&self, _rig: &Rig, shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        let mut parameters = vec![Parameter::grid("f_hz", shape[1], "Hz"), Parameter::grid("zeta", shape[2], "")];
        parameters.extend(found.polar(0).parameters("excitation_rad", "rad"));
        parameters
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["f_hz", "zeta", "excitation_rad", "phase_rad", "excited_by"]
    }

    fn amplitudes(&self, _rig: &Rig, given: &Given<'_>) -> Result<(Shape, Vec<f64>), StatedError> {
        let kind = if given.word("excited_by", &EXCITED_BY, true)? == 0 { 1.0 } else { 0.0 };
        let shape = vec![kind, given.number_in("f_hz", 1e-6, 1e9)?, given.number_in("zeta", 1e-6, 10.0)?];
        Ok((shape, given.polar("excitation_rad")?))
    }

    fn stated(&self, rig: &Rig, shape: &Shape, beta: &[f64]) -> StatedEffect {
        let mut stated = stated::by_parameters(self, rig, shape, beta);
        let word = EXCITED_BY[usize::from(shape.first() != Some(&1.0))];
        stated.insert("excited_by".to_owned(), Stated::Text(word.to_owned()));
        stated
    }
}
