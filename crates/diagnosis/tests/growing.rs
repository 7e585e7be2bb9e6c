//! What accumulates, against a book kept by hand.

#![allow(clippy::unwrap_used)] // helpers of tests may

use std::f64::consts::TAU;

use diagnosis::grid::Grid;
use diagnosis::reduce::{Point, ReducedRun};

use gearmodel::effect::{Estimate, NominalRig, OperatingPoint, Value, by_name};
use gearmodel::{Direction, EllipticalSpec, Errors, GearPair};
use nalgebra::DMatrix;

/// (start s, sense, load N·m, revolutions): pauses, and loads that come back.
const RUNS: [(f64, Direction, f64, f64); 5] = [
    (0.0, Direction::Ccw, 15.0, 3.0),
    (60.0, Direction::Cw, 15.0, 2.0),
    (120.0, Direction::Ccw, 5.0, 2.0),
    (180.0, Direction::Ccw, 10.0, 2.0),
    (240.0, Direction::Cw, 10.0, 3.0),
];

fn document_rig() -> NominalRig {
    let pair = GearPair::elliptical(&EllipticalSpec::default()).unwrap();
    NominalRig::new(pair, Errors::default(), [None, None], Some(7.2e6))
}

fn row(rig: &NominalRig, name: &str, shape: &[f64], at: &OperatingPoint) -> Vec<f64> {
    let (effect, shape) = (by_name(name).unwrap(), shape.to_vec());
    let mut row = vec![0.0; effect.width(rig, &shape)];
    effect.row(rig, &shape, at, &mut row);
    row
}

fn estimate(beta: Vec<f64>) -> Estimate {
    let covariance = DMatrix::identity(beta.len(), beta.len()) * 1e-12;
    Estimate { beta, covariance }
}

fn campaign(rig: &NominalRig) -> Grid {
    let speed_rpm = 6.0;
    let runs: Vec<ReducedRun> = RUNS
        .iter()
        .map(|(start_s, direction, load_nm, revolutions)| {
            let points = (0..(720.0 * revolutions) as usize)
                .map(|n| {
                    let theta1_rad = direction.sign() * TAU * n as f64 / 720.0;
                    Point {
                        time_s: start_s + 10.0 * n as f64 / 720.0,
                        theta1_rad,
                        theta2_rad: rig.pair().theta2(theta1_rad),
                        load_nm: *load_nm,
                        samples: 1.0,
                        ..Point::default()
                    }
                })
                .collect();
            ReducedRun { direction: *direction, speed_rpm, points, within_rad2: 0.0, samples: 720.0 }
        })
        .collect();
    Grid::new(rig, &runs, &diagnosis::Settings::default())
}

/// Sum of `amount`(sense, load) over the revolutions driven up to a time.
fn booked(time_s: f64, amount: impl Fn(f64, f64) -> f64) -> f64 {
    RUNS.iter()
        .map(|(start_s, direction, load, revolutions)| {
            amount(direction.sign(), *load) * (0.1 * (time_s - start_s)).clamp(0.0, *revolutions)
        })
        .sum()
}

#[test]
fn what_accumulates_is_booked_over_the_campaign() {
    let rig = document_rig();
    let grid = campaign(&rig);
    assert_eq!(grid.plan.loads_nm, [5.0, 10.0, 15.0]);
    // A lag in the sense of motion that stays, above the threshold only.
    for threshold_nm in [0.0, 7.0, 12.0] {
        let mut largest = 0.0_f64;
        for at in &grid.places {
            let lag = -booked(at.time_s, |sense, load| sense * (load - threshold_nm).max(0.0));
            let trace = row(&rig, "slip", &[threshold_nm], at)[0];
            assert!((trace - lag).abs() < 0.1, "{trace} {lag} at {} s", at.time_s);
            largest = largest.max(lag.abs());
        }
        assert!(largest > 5.0);
    }
    // Wear counts turns of either sense, and is a backlash.
    for at in &grid.places {
        let work = booked(at.time_s, |_, load| load);
        let wear = row(&rig, "wear_drift", &[], at)[0];
        assert!((wear - work * row(&rig, "backlash_error", &[], at)[0]).abs() < 2e-3 * wear.abs().max(1e-3));
    }
    let worn = row(&rig, "wear_drift", &[], &grid.places[grid.places.len() - 1])[0];
    assert!(worn > 0.5, "cw leads the more: {worn}");
    let times = [12.0, 12.0, 130.0, 255.5];
    for at in &grid.places {
        let steps = row(&rig, "count_loss", &times, at)[0];
        assert_eq!(steps, times.iter().filter(|t| **t <= at.time_s).count() as f64);
    }
    // 24 counts lost of 7.2 million: the reading falls.
    let effect = by_name("count_loss").unwrap();
    let found = effect.parameters(&rig, &times.to_vec(), &estimate(vec![-24.0 * TAU / 7.2e6]));
    assert_eq!((found[0].name, &found[0].value), ("counts", &Value::Number(24.0)));
    assert!(found.iter().any(|p| p.name == "steps" && p.value == Value::Number(4.0)));
}
