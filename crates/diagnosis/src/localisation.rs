//! Where the gap lies: its parts by angle, order, tooth, condition and time, each beside what repeatability alone gives, and the
//! signature row.

use std::f64::consts::TAU;

use serde_json::json;

use super::design_matrix::{Candidate, DesignMatrix};
use super::diagnosis::{Curve, Location, Slice};
use super::evidence::Fit;
use super::grid::Grid;
use super::line_errors;
use super::line_phase::LineError;
use super::noise::Noise;
use super::settings::Settings;
use gearmodel::effect::{Accumulates, Carrier, NominalRig, OperatingPoint, Parity, Signature, nearest_level};

/// Sectors of a turn.
const LOCATION_SECTORS: usize = 36;
/// Orders of a shaft.
const ORDERS: usize = 12;
/// Orders of the mesh.
const MESH_ORDERS: usize = 4;
/// Slices of time.
const TIMES: usize = 24;

/// What the localisation looks at.
pub(super) struct Inputs<'a> {
    pub(super) rig: &'a NominalRig,
    pub(super) grid: &'a Grid,
    pub(super) design: &'a DesignMatrix,
    pub(super) noise: &'a Noise,
    pub(super) best: &'a Fit,
    pub(super) lines: &'a [LineError],
}

/// The localisation of the residual before anything is added.
pub(super) fn locate(inputs: &Inputs<'_>) -> Location {
    let Inputs { rig, grid, noise, best, lines, .. } = inputs;
    let zero = best.mean[0];
    let rest: Vec<f64> = grid.rho_rad.iter().map(|y| y - zero).collect();
    let by =
        |key: &dyn Fn(&OperatingPoint) -> Option<usize>, names: &[serde_json::Value]| slices(inputs, &rest, key, names);
    let sectors: Vec<_> =
        (0..LOCATION_SECTORS).map(|n| json!((n as f64 + 0.5) * 360.0 / LOCATION_SECTORS as f64)).collect();
    let sector = |angle_rad: f64| ((angle_rad / TAU).rem_euclid(1.0) * LOCATION_SECTORS as f64) as usize;
    let teeth = rig.pair().teeth().0 as usize;
    let tooth_names: Vec<_> = (0..teeth).map(|n| json!(n)).collect();
    let loads: Vec<_> = grid.plan.loads_nm.iter().map(|x| json!(x)).collect();
    let speeds: Vec<_> = grid.plan.speeds_rad_per_s.iter().map(|x| json!(x * 60.0 / TAU)).collect();
    let revolutions = (grid.plan.revolutions.ceil() as usize).clamp(1, 400);
    let times: Vec<_> = (0..TIMES).map(|n| json!((n as f64 + 0.5) * grid.plan.duration_s / TIMES as f64)).collect();
    let time = |at: &OperatingPoint| ((at.time_s / grid.plan.duration_s.max(1e-9)) * TIMES as f64) as usize;
    let floor_of_order = |n: usize| {
        let runs = grid.revolutions.len().max(1) as f64;
        let low = noise.order_rad2.get(n).copied().unwrap_or(0.0);
        (2.0 * (low + noise.white_rad2 * grid.places.len() as f64 / grid.weight.iter().sum::<f64>() / grid.bins as f64)
            / runs)
            .sqrt()
            * std::f64::consts::SQRT_2
    };
    let orders = |phase: &dyn Fn(&OperatingPoint) -> f64, count: usize, mesh: bool| {
        (1..=count)
            .map(|n| {
                let amplitude = amplitude(grid, &rest, &|at| n as f64 * phase(at));
                Slice { at: json!(n), rad: amplitude, floor_rad: floor_of_order(if mesh { usize::MAX } else { n }) }
            })
            .collect::<Vec<_>>()
    };
    Location {
        signature: signature(inputs),
        input_angle: by(&|at| Some(sector(at.theta1_rad)), &sectors),
        driven_angle: by(&|at| Some(sector(at.theta2_rad)), &sectors),
        tooth: if teeth > 0 {
            by(&|at| Some((at.pitches.round() as i64).rem_euclid(teeth as i64) as usize), &tooth_names)
        } else {
            Vec::new()
        },
        input_order: orders(&|at| at.theta1_rad, ORDERS, false),
        output_order: orders(&|at| at.theta2_rad, ORDERS, false),
        mesh_order: if teeth > 0 { orders(&|at| TAU * at.pitches, MESH_ORDERS, true) } else { Vec::new() },
        line_phase: lines
            .iter()
            .map(|line| {
                let name = format!("encoder {} order {} of the line", line.encoder + 1, line.order);
                let rad = line.amplitudes[0].hypot(line.amplitudes[1]);
                Slice { at: json!(name), rad, floor_rad: (line.covariance[(0, 0)] + line.covariance[(1, 1)]).sqrt() }
            })
            .collect(),
        direction: by(&|at| Some(usize::from(at.sense < 0.0)), &[json!("ccw"), json!("cw")]),
        load: by(&|at| Some(nearest_level(&grid.plan.loads_nm, at.load_nm)), &loads),
        speed: by(&|at| Some(nearest_level(&grid.plan.speeds_rad_per_s, at.speed_rad_per_s.abs())), &speeds),
        revolution: by(&|at| Some(at.way_rev as usize), &(0..revolutions).map(|n| json!(n)).collect::<Vec<_>>()),
        time: by(&|at| Some(time(at)), &times),
    }
}

/// RMS of the residual by a key, beside the floor at the same number of samples a place.
fn slices(
    inputs: &Inputs<'_>,
    rest: &[f64],
    key: &dyn Fn(&OperatingPoint) -> Option<usize>,
    names: &[serde_json::Value],
) -> Vec<Slice> {
    let (grid, noise) = (inputs.grid, inputs.noise);
    let mut sums = vec![(0.0, 0.0, 0.0); names.len()];
    for ((at, value), weight) in grid.places.iter().zip(rest).zip(&grid.weight) {
        if let Some(sum) = key(at).and_then(|n| sums.get_mut(n)) {
            sum.0 += weight * value * value;
            sum.1 += weight;
            sum.2 += 1.0;
        }
    }
    names
        .iter()
        .zip(sums)
        .filter(|(_, (_, weight, _))| *weight > 0.0)
        .map(|(name, (square, weight, places))| Slice {
            at: name.clone(),
            rad: (square / weight).sqrt(),
            floor_rad: (noise.white_rad2 * places / weight + noise.floor_rad2()).sqrt(),
        })
        .collect()
}

/// Amplitude of the part of the residual that goes with sin and cos of a phase, by sense and combined, rad.
fn amplitude(grid: &Grid, rest: &[f64], phase: &dyn Fn(&OperatingPoint) -> f64) -> f64 {
    let mut sums = [[0.0; 3]; 2];
    for ((at, value), weight) in grid.places.iter().zip(rest).zip(&grid.weight) {
        let (sin, cos) = phase(at).sin_cos();
        let sum = &mut sums[usize::from(at.sense < 0.0)];
        sum[0] += weight * value * sin;
        sum[1] += weight * value * cos;
        sum[2] += weight;
    }
    let seen: Vec<f64> =
        sums.iter().filter(|s| s[2] > 0.0).map(|s| (2.0 * s[0] / s[2]).powi(2) + (2.0 * s[1] / s[2]).powi(2)).collect();
    (seen.iter().sum::<f64>() / seen.len().max(1) as f64).sqrt()
}

/// The signature: the row of the largest effect or unknown pattern in the best model, freed of what the plan cannot tell; that of
/// nothing where there is none.
fn signature(inputs: &Inputs<'_>) -> Signature {
    let Inputs { rig, grid, design, best, lines, .. } = inputs;
    let mut largest: Option<(f64, Signature)> = None;
    for (n, b) in best.set.iter().enumerate() {
        let size = best.rms_rad(design, n).powi(2);
        let row = match &design.blocks[*b].candidate {
            Candidate::Effect { effect, shape, .. } => effect.signature_of(rig, shape),
            Candidate::Unknown(pattern) => pattern.signature(),
        };
        if largest.as_ref().is_none_or(|(s, _)| size > *s) {
            largest = Some((size, row));
        }
    }
    for line in *lines {
        let size = line.explained_rad2 / grid.samples;
        if let Some(effect) = line_errors::effect_of(line.encoder)
            && largest.as_ref().is_none_or(|(s, _)| size > *s)
        {
            largest = Some((size, effect.signature()));
        }
    }
    let mut row = largest.map_or_else(|| Signature::steady(Carrier::None, Parity::Even), |(_, row)| row);
    let plan = &grid.plan;
    if plan.loads_nm.len() < 2 {
        row.load_exponent = None;
    }
    if plan.speeds_rad_per_s.len() < 2 {
        row.speed_exponent = None;
    }
    if plan.revolutions < 2.0 && row.accumulates != Accumulates::PerTime {
        row.accumulates = Accumulates::No;
    }
    row
}

/// What this data does not allow one to conclude.
pub(super) fn warnings(grid: &Grid, noise: &Noise, settings: &Settings) -> Vec<String> {
    let plan = &grid.plan;
    let mut warnings = Vec::new();
    if plan.senses != [true, true] {
        let seen = if plan.senses[0] { "ccw" } else { "cw" };
        warnings.push(format!(
            "only {seen} was recorded: what is alike in both senses (encoders, clocking, eccentricity) cannot be told from what \
             turns its sign (backlash, friction, wind-up, time skew); record the other sense too"
        ));
    }
    if plan.loads_nm.len() < 2 {
        warnings.push(
            "only one load was recorded: what grows with the load (compliances, slip, ripple) cannot be told from what does \
             not (backlash, clearance, friction); record a second load"
                .to_owned(),
        );
    }
    if plan.speeds_rad_per_s.len() < 2 {
        warnings.push(
            "only one speed was recorded: a time skew or a resonance cannot be told from what does not change with speed; \
             record a second speed"
                .to_owned(),
        );
    }
    if noise.freedom == 0.0 {
        warnings.push(
            "no run holds two whole revolutions: how well the rig repeats is not known but assumed, and probabilities are rough; \
             record at least 3 revolutions a run"
                .to_owned(),
        );
    } else if noise.freedom < settings.report.few_differences {
        warnings.push(
            "few revolutions were recorded: repeatability is known roughly, and so are the probabilities".to_owned(),
        );
    }
    if grid.revolutions.iter().all(|r| r.coverage < settings.noise.full_coverage) {
        warnings.push("no revolution is complete: orders of the shafts cannot be told apart well".to_owned());
    }
    warnings
}

/// Residual over the turn before and after, run by run.
pub(super) fn curves(grid: &Grid, design: &DesignMatrix, best: &Fit) -> Vec<Curve> {
    let zero = best.mean[0];
    let trace = design.trace(grid, &best.amplitudes());
    let mut curves = Vec::new();
    for (run, direction) in grid.directions.iter().enumerate() {
        let mut sums = vec![(0.0, 0.0, 0.0); grid.bins];
        let mut map_rad = Vec::new();
        let mut label = String::new();
        let (mut load_nm, mut speed_rpm) = (0.0, 0.0);
        for revolution in grid.revolutions.iter().filter(|r| r.run == run) {
            let mut row = vec![f64::NAN; grid.bins];
            for place in revolution.places.clone() {
                let at = &grid.places[place];
                let bin = ((at.theta1_rad / TAU).rem_euclid(1.0) * grid.bins as f64) as usize % grid.bins;
                let weight = grid.weight[place];
                sums[bin].0 += weight * (grid.rho_rad[place] - zero);
                sums[bin].1 += weight * (grid.rho_rad[place] - trace[place]);
                sums[bin].2 += weight;
                row[bin] = grid.rho_rad[place] - zero;
                if label.is_empty() {
                    load_nm = at.load_nm;
                    speed_rpm = at.speed_rad_per_s.abs() * 60.0 / TAU;
                    label = format!("{direction} {load_nm:.3} N·m {speed_rpm:.3} rpm");
                }
            }
            map_rad.push(row);
        }
        let seen: Vec<usize> = (0..grid.bins).filter(|n| sums[*n].2 > 0.0).collect();
        curves.push(Curve {
            label,
            direction: *direction,
            load_nm,
            speed_rpm,
            theta1_rad: seen.iter().map(|n| (*n as f64 + 0.5) * TAU / grid.bins as f64).collect(),
            before_rad: seen.iter().map(|n| sums[*n].0 / sums[*n].2).collect(),
            after_rad: seen.iter().map(|n| sums[*n].1 / sums[*n].2).collect(),
            map_rad,
        });
    }
    curves
}
