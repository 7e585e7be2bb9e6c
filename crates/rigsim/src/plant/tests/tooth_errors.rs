//! Tooth errors on the running rig: what the encoders see is the most advanced pair over its arm.

use super::effects::with;
use super::*;
use std::f64::consts::{PI, TAU};

/// What the teeth add to the true TE at `count` places of a turn, with the pitches passed.
fn added(name: &str, driver_rpm: f64, count: usize) -> Vec<(f64, f64, f64)> {
    let flank = if driver_rpm > 0.0 { Flank::Ccw } else { Flank::Cw };
    let curves = geometry::PitchCurves::new(&GearSpec::default());
    let (mut changed, mut plain) =
        (turning(&with(name), driver_rpm, 0.3), turning(&PlantSpec::default().quiet(), driver_rpm, 0.3));
    let (a, b) = (turn_of_truth(&mut changed, count), turn_of_truth(&mut plain, count));
    a.iter()
        .zip(b)
        .map(|(a, b)| {
            // Gear 1 stands where the teeth decide; both rigs are compared with rigid contact at their own angle.
            let theta1 = a.angles_rad[0];
            let error = a.transmission_error_rad
                - b.transmission_error_rad
                - (plain.rigid_error_rad(theta1, flank) - plain.rigid_error_rad(b.angles_rad[0], flank));
            let within = theta1.rem_euclid(TAU);
            let steps = 200;
            let arc: f64 = (0..steps)
                .map(|n| {
                    curves
                        .arc_mm(within * f64::from(n) / f64::from(steps), within * f64::from(n + 1) / f64::from(steps))
                })
                .sum();
            (arc / (PI * 3.0), error * plain.driven_arm_mm(theta1, flank), theta1)
        })
        .collect()
}

#[test]
fn one_profile_shows_at_every_tooth_and_alike_in_both_senses() {
    for rpm in [5.0f64, -5.0] {
        for (s, normal_mm, _) in added("profile_error", rpm, 61) {
            let expected =
                2e-3 * (TAU * s - 0.7).sin() + 8e-4 * (2.0 * TAU * s - 2.0).sin() + 4e-4 * (3.0 * TAU * s - 4.0).sin();
            assert!((normal_mm - expected).abs() < 1.5e-4, "{rpm} rpm at {s}: {normal_mm} against {expected}");
        }
    }
}

#[test]
fn a_damaged_tooth_lags_in_one_sense() {
    let damaged = |rpm| added("tooth_damage", rpm, 600);
    let deepest =
        damaged(5.0).into_iter().fold((0.0, 0.0), |least, (s, mm, _)| if mm < least.1 { (s, mm) } else { least });
    assert!((deepest.0 - 12.0).abs() < 0.1 && (deepest.1 + 0.015).abs() < 1e-3, "{deepest:?}");
    assert!(damaged(-5.0).iter().all(|(_, mm, _)| mm.abs() < 2e-4));
}

#[test]
fn displaced_teeth_hand_over_to_the_most_advanced() {
    let errors = with("pitch_errors").teeth;
    for (rpm, mm, half, side) in [(5.0, &errors.ccw_mm, 0.0, 1.0), (-5.0, &errors.cw_mm, 0.5, -1.0)] {
        let mut compared = 0;
        for (s, normal_mm, _) in added("pitch_errors", rpm, 150) {
            let at = s - half;
            // Where two pairs touch for sure, the more advanced of them.
            let below = at.floor();
            if (at - below - 0.5).abs() > 0.3 {
                continue;
            }
            let tooth = |n: f64| mm[n.rem_euclid(47.0) as usize];
            let expected = side * (side * tooth(below)).max(side * tooth(below + 1.0));
            assert!((normal_mm - expected).abs() < 2e-4, "{rpm} rpm at {s}: {normal_mm} against {expected}");
            compared += 1;
        }
        assert!(compared > 60);
    }
}

#[test]
fn the_mesh_is_softer_where_one_pair_carries_alone() {
    for rpm in [5.0f64, -5.0] {
        let half = if rpm > 0.0 { 0.0 } else { 0.5 };
        let flank = if rpm > 0.0 { Flank::Ccw } else { Flank::Cw };
        let (mut single, mut double) = (Vec::new(), Vec::new());
        let plain = Plant::new(&PlantSpec::default(), 1e4, 1).unwrap();
        for (s, normal_mm, theta1) in added("mesh_stiffness_variation", rpm, 300) {
            // −dir T C/arm along the normal; the load of 0.3 A is 4.5 N·m and a little more.
            let arm = plain.driven_arm_mm(theta1, flank);
            let compliance = -rpm.signum() * normal_mm * arm;
            let from_pitch_point = (s - half - (s - half).round()).abs();
            if from_pitch_point < 0.18 {
                single.push(compliance);
            } else if from_pitch_point > 0.22 {
                double.push(compliance);
            }
        }
        let load_nm = turning(&PlantSpec::default().quiet(), 5.0, 0.3).truth().load_torque_nm;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64 / load_nm;
        assert!((mean(&single) / (2e-3 * 0.6) - 1.0).abs() < 0.1, "{}", mean(&single));
        assert!((mean(&double) / (-2e-3 * 0.4) - 1.0).abs() < 0.1, "{}", mean(&double));
    }
}
