//! Bearings, seals, brake and coupling as effects: limits and symmetries.

use super::effects::{mismatch, with};
use super::*;
use std::f64::consts::TAU;

#[test]
fn play_in_the_bearings_is_a_backlash_of_twice_its_size() {
    let play = with("bearing_clearance");
    let mut thin = PlantSpec::default().quiet();
    thin.gears.backlash_mm += 2.0 * play.bearings.clearance_mm / 20f64.to_radians().cos();
    let (play, thin) = (Plant::new(&play, 1e4, 1).unwrap(), Plant::new(&thin, 1e4, 1).unwrap());
    for n in 0..60 {
        let theta = f64::from(n) * TAU / 60.0;
        for flank in [Flank::Ccw, Flank::Cw] {
            let miss = play.rigid_error_rad(theta, flank) - thin.rigid_error_rad(theta, flank);
            // Second order of the eccentric contact: 3 µm over the arm, times 1e-3.
            assert!(miss.abs() < 2e-7, "{miss}");
        }
    }
}

#[test]
fn bearings_that_give_way_act_as_a_softer_mesh() {
    let mut mesh = PlantSpec::default().quiet();
    mesh.mesh.compliance_mm2_rad_per_nm += 0.03;
    let (mut soft, mut mesh) = (turning(&with("bearing_compliance"), 5.0, 0.49), turning(&mesh, 5.0, 0.49));
    for (a, b) in turn_of_truth(&mut soft, 20).iter().zip(turn_of_truth(&mut mesh, 20)) {
        assert!((a.transmission_error_rad - b.transmission_error_rad).abs() < 1e-9);
    }
}

#[test]
fn a_dragging_seal_winds_up_alike_at_every_load_and_flips_with_the_sense() {
    let shape = |plant: &Plant, theta1: f64, flank| {
        let arm_mm = plant.driven_arm_mm(theta1, flank);
        1.5 * (8e-6 + 5e-6 * plant.nominal_ratio(theta1).powi(2) + 1.7e-3 / (arm_mm * arm_mm))
    };
    for (rpm, flank) in [(5.0f64, Flank::Ccw), (-5.0, Flank::Cw)] {
        let lag = |plant: &Plant, theta1: f64| -rpm.signum() * shape(plant, theta1, flank);
        let miss = mismatch("friction_windup", rpm, lag);
        // The input is counted in steps that the ratio doubles.
        assert!(miss < 8e-6, "{miss}");
    }
    for current_a in [0.05, 0.3] {
        let (mut drag, mut free) =
            (turning(&with("friction_windup"), 5.0, current_a), turning(&PlantSpec::default().quiet(), 5.0, current_a));
        let (a, b) = (turn_of_truth(&mut drag, 24), turn_of_truth(&mut free, 24));
        let shift = a.iter().zip(&b).map(|(a, b)| a.transmission_error_rad - b.transmission_error_rad).sum::<f64>();
        let expected = a.iter().map(|truth| -shape(&free, truth.angles_rad[0], Flank::Ccw)).sum::<f64>();
        assert!((shift / expected - 1.0).abs() < 0.05, "{current_a} A: {shift} {expected}");
    }
}

#[test]
fn the_brakes_ripple_loads_the_gears() {
    let mut plant = turning(&with("brake_torque_ripple"), 5.0, 0.4);
    let mut steady = turning(&PlantSpec::default().quiet(), 5.0, 0.4);
    let mean = turn_of_truth(&mut steady, 200).iter().map(|truth| truth.load_torque_nm).sum::<f64>() / 200.0;
    for truth in turn_of_truth(&mut plant, 50) {
        let expected = mean * (1.0 + 0.2 * (3.0 * truth.angles_rad[4] - 0.9).sin());
        assert!((truth.load_torque_nm - expected).abs() < 0.01 * mean, "{} {expected}", truth.load_torque_nm);
    }
}

#[test]
fn a_soft_coupling_lags_with_the_acceleration() {
    // Far below its resonance: −q̈/ω² with q̈ = θ̇1² di21/dθ1.
    for rpm in [5.0f64, 10.0, -10.0] {
        let omega = TAU * 12.0;
        let lag = move |plant: &Plant, theta1: f64| {
            let slope = (plant.nominal_ratio(theta1 + 1e-4) - plant.nominal_ratio(theta1 - 1e-4)) / 2e-4;
            -(rpm * TAU / 60.0).powi(2) * slope / (omega * omega)
        };
        assert!(mismatch("torsional_resonance", rpm, lag) < 0.1 * 5e-6 * rpm * rpm, "{rpm}");
    }
}

#[test]
fn wear_grows_with_revolutions_and_load_and_starts_anew() {
    let gap = |plant: &Plant| plant.rigid_error_rad(1.0, Flank::Cw) - plant.rigid_error_rad(1.0, Flank::Ccw);
    let fresh = gap(&Plant::new(&PlantSpec::default(), 1e4, 1).unwrap());
    for current_a in [0.2, 0.49] {
        let mut plant = turning(&with("wear_drift"), 10.0, current_a);
        plant.renew();
        run(&mut plant, 0.01);
        assert!((gap(&plant) - fresh).abs() < 5e-8);
        run(&mut plant, 60.0);
        let load_nm = plant.truth().load_torque_nm;
        let opened_mm = 0.5 * 5e-5 * 10.0 * load_nm * 20f64.to_radians().cos();
        let expected =
            opened_mm * (1.0 / plant.driven_arm_mm(1.0, Flank::Ccw) + 1.0 / plant.driven_arm_mm(1.0, Flank::Cw));
        assert!(((gap(&plant) - fresh) / expected - 1.0).abs() < 0.03, "{current_a} A");
    }
}
