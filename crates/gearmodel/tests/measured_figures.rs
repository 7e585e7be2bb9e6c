//! The figures of synthetic runs whose answers are known.

#![allow(clippy::unwrap_used)] // helpers of tests may

use std::f64::consts::TAU;

use gearmodel::measure::{AngleGrid, BacklashCurve, RunConditions, RunFigures, RunTe, common_zero};
use gearmodel::{Direction, EllipticalSpec, Errors, GearPair, NominalModel, ToothSpec};

const LOAD_NM: f64 = 10.0;

fn model() -> NominalModel {
    let pair = GearPair::elliptical(&EllipticalSpec {
        teeth: ToothSpec { backlash_mm: 0.08, ..Default::default() },
        ..Default::default()
    })
    .unwrap();
    let errors = Errors {
        e1_mm: 0.05,
        phi1_rad: 0.3,
        e2_mm: 0.03,
        phi2_rad: 1.1,
        shaft_compliance_output_rad_per_nm: 2e-5,
        shaft_compliance_input_rad_per_nm: 1e-5,
        mesh_compliance_mm2_rad_per_nm: 5e-3,
    };
    NominalModel::new(pair, errors).unwrap()
}

/// A repeatable sequence of numbers, uniform in -1..1 with variance 1/3.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A run at the model's TE plus `extra`(θ1, revolutions since the start), with a free zero of 0.25 rad.
fn run(model: &NominalModel, direction: Direction, revolutions: f64, mut extra: impl FnMut(f64, f64) -> f64) -> RunTe {
    let conditions = RunConditions { direction, load_nm: LOAD_NM, speed_rpm: 5.0 };
    let mut run = RunTe::new(AngleGrid::default(), conditions);
    let per_turn = 24_000;
    for n in 0..=(revolutions * f64::from(per_turn)) as u32 {
        let turns = f64::from(n) / f64::from(per_turn);
        let theta1 = 0.4 + direction.sign() * TAU * turns;
        let te = 0.25 + model.te_rad(theta1, direction, LOAD_NM) + extra(theta1, turns);
        run.push(&model.pair, theta1, model.pair.theta2(theta1) + te);
    }
    run
}

#[test]
fn a_run_of_the_model_itself_leaves_no_residual() {
    let model = model();
    let runs: Vec<RunTe> = Direction::BOTH.map(|direction| run(&model, direction, 3.0, |_, _| 0.0)).into();
    let zero = common_zero(&[&runs[0], &runs[1]], &model);
    assert!((zero - 0.25).abs() < 1e-8);
    for run in &runs {
        let figures = RunFigures::of(run, &model, Some(zero));
        assert_eq!((figures.revolutions, figures.coverage), (3, 1.0));
        assert!(figures.residual_rms_rad < 2e-8, "{figures:?}");
        assert!(figures.floor_rms_rad < 2e-8 && figures.offset_per_rev_rad.abs() < 1e-9, "{figures:?}");
        assert!((figures.pp_rad / figures.predicted_pp_rad - 1.0).abs() < 1e-4);
        assert!((figures.mean_rad - 0.25 - figures.predicted_mean_rad).abs() < 1e-8);
        assert!(figures.f_is_tooth_rad > 0.0 && figures.f_is_tooth_rad < figures.f_is_total_rad);
        for (measured, predicted) in figures.orders.iter().zip(&figures.predicted_orders) {
            assert!((measured.amplitude_rad - predicted.amplitude_rad).abs() < 1e-8);
        }
    }
    let backlash = BacklashCurve::of(&runs[0].mean_curve(), &runs[1].mean_curve()).unwrap();
    let predicted = BacklashCurve::predicted(&model, AngleGrid::default(), LOAD_NM);
    for (measured, expected) in [
        (backlash.min_rad, predicted.min_rad),
        (backlash.mean_rad, predicted.mean_rad),
        (backlash.max_rad, predicted.max_rad),
    ] {
        assert!((measured - expected).abs() < 5e-8, "{measured} {expected}");
    }
}

#[test]
fn an_added_order_is_the_residual() {
    let model = model();
    let amplitude = 2e-4;
    for direction in Direction::BOTH {
        let run = run(&model, direction, 2.0, |theta1, _| amplitude * (2.0 * theta1 - 0.7).cos());
        let figures = RunFigures::of(&run, &model, None);
        assert!((figures.residual_rms_rad / (amplitude / 2.0_f64.sqrt()) - 1.0).abs() < 1e-3, "{figures:?}");
        let (measured, predicted) = (figures.orders[1], figures.predicted_orders[1]);
        let difference = |cos: fn(f64) -> f64| {
            measured.amplitude_rad * cos(measured.phase_rad) - predicted.amplitude_rad * cos(predicted.phase_rad)
        };
        let (x, y) = (difference(f64::cos), difference(f64::sin));
        assert!((x.hypot(y) / amplitude - 1.0).abs() < 1e-3 && (y.atan2(x) - 0.7).abs() < 1e-3);
    }
}

#[test]
fn an_offset_that_accumulates_is_a_slope_and_not_scatter() {
    let model = model();
    let step = 3e-5;
    for direction in Direction::BOTH {
        let run = run(&model, direction, 4.0, |_, turns| step * turns.floor());
        let figures = RunFigures::of(&run, &model, None);
        assert!((figures.offset_per_rev_rad / step - 1.0).abs() < 1e-2, "{figures:?}");
        assert!(figures.floor_rms_rad < 0.05 * step, "{figures:?}");
    }
}

#[test]
fn the_floor_is_the_scatter_of_the_mean_curve() {
    let model = model();
    let mut noise = Noise(1);
    let amplitude = 1e-4;
    let run = run(&model, Direction::Ccw, 8.0, |_, _| amplitude * noise.next());
    let figures = RunFigures::of(&run, &model, None);
    // 24 000 samples a turn in 720 bins, 8 revolutions
    let expected = amplitude / 3.0_f64.sqrt() / (8.0_f64 * 24_000.0 / 720.0).sqrt();
    assert!((figures.floor_rms_rad / expected - 1.0).abs() < 0.1, "{} {expected}", figures.floor_rms_rad);
    // The residual of a complete model is the floor.
    assert!((figures.residual_rms_rad / expected - 1.0).abs() < 0.15, "{} {expected}", figures.residual_rms_rad);
}

#[test]
fn short_and_empty_runs_say_what_they_cannot_tell() {
    let model = model();
    let figures = RunFigures::of(&run(&model, Direction::Cw, 0.5, |_, _| 0.0), &model, None);
    assert_eq!(figures.revolutions, 0);
    assert!((figures.coverage - 0.5).abs() < 0.01 && figures.residual_rms_rad < 2e-8);
    assert!(figures.floor_rms_rad.is_nan() && figures.offset_per_rev_rad.is_nan());
    let conditions = RunConditions { direction: Direction::Ccw, load_nm: 0.0, speed_rpm: 5.0 };
    let empty = RunTe::new(AngleGrid::default(), conditions);
    let figures = RunFigures::of(&empty, &model, None);
    assert!(figures.mean_rad.is_nan() && figures.pp_rad.is_nan() && figures.orders.is_empty());
    assert!(common_zero(&[&empty], &model).is_nan());
    let pair = GearPair::constant(81.0).unwrap();
    let constant = NominalModel::new(pair, Errors::default()).unwrap();
    assert!(RunFigures::of(&empty, &constant, None).f_is_tooth_rad.is_nan());
}

#[test]
fn a_tooth_long_wave_is_seen_by_the_tooth_to_tooth_value() {
    let pair = GearPair::elliptical(&EllipticalSpec::default()).unwrap();
    let model = NominalModel::new(pair.clone(), Errors::default()).unwrap();
    let amplitude = 1e-5;
    let wave = |theta1: f64| amplitude * (TAU * pair.tooth_phase(theta1).unwrap()).sin();
    let figures = RunFigures::of(&run(&model, Direction::Ccw, 1.0, |theta1, _| wave(theta1)), &model, None);
    assert!((figures.f_is_tooth_rad / (2.0 * amplitude) - 1.0).abs() < 0.03, "{}", figures.f_is_tooth_rad);
}

#[test]
fn equal_samples_hash_alike_and_others_do_not() {
    let model = model();
    let values = |extra: f64| {
        let mut values = Vec::new();
        run(&model, Direction::Ccw, 2.0, |_, _| extra).for_each_hashed_value(&mut |value| values.push(value.to_bits()));
        values
    };
    assert_eq!(values(0.0), values(0.0));
    assert!(values(0.0).len() >= 4 * 720);
    assert_ne!(values(0.0), values(1e-9));
}
