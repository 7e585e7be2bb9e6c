//! The drive train rings: an excitation at the mesh (kind 1) or once a turn (kind 0) comes through amplified by
//! H(ν) = 1/(1 − (ν/f)² + 2jζ ν/f) at its frequency ν. Its part beyond the quasi-static one is the trace:
//! TE = Re[(H(ν) − 1)·a e^{jx}], x = 2π u or θ1. The shape is [kind, f, ζ].

use std::f64::consts::TAU;

use super::{Carrier, Effect, Estimate, Parameter, Parity, Plan, Rig, Shape, Signature, Station};

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

    fn neighbours(&self, shape: &Shape, step: f64) -> Vec<Shape> {
        let [kind, f_hz, zeta] = shape[..] else { return Vec::new() };
        let mut shapes = Vec::new();
        for higher in [-0.16, -0.08, 0.0, 0.08, 0.16] {
            for softer in [-0.8, 0.0, 0.8] {
                if higher != 0.0 || softer != 0.0 {
                    let damping = (zeta * f64::exp(softer * step.sqrt())).clamp(0.005, 0.5);
                    shapes.push(vec![kind, f_hz * f64::exp(higher * step), damping]);
                }
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
}
