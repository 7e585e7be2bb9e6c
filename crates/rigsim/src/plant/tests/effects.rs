//! What each fault leaves in the measurement, to first order and in sign.

use super::*;
use std::f64::consts::TAU;

/// A quiet rig with the effect `name`.
pub(super) fn with(name: &str) -> PlantSpec {
    let mut spec = PlantSpec::default().quiet();
    faults::find(name).unwrap().apply_usual(&mut spec);
    spec
}

/// Mean measured TE over one driver turn at each of `bins` angles, driven angle less f(driver angle), from scale
/// counts.
fn measured_curve(spec: &PlantSpec, driver_rpm: f64, current_a: f64) -> Vec<(f64, f64)> {
    let mut plant = turning(spec, driver_rpm, current_a);
    while plant.input_index_counts().is_none() || plant.output_index_counts().is_none() {
        plant.step();
    }
    let (input, output) = (plant.input_index_counts().unwrap(), plant.output_index_counts().unwrap());
    let nominal = geometry::PitchCurves::new(&GearSpec::default());
    (0..240)
        .map(|_| {
            run(&mut plant, 0.25 / driver_rpm.abs());
            let sample = plant.step();
            let theta1 = TAU * (sample.input_counts - input) as f64 / 7.2e6;
            let theta2 = TAU * (sample.output_counts - output) as f64 / 7.2e6;
            let error = theta2 - nominal.driven_angle(theta1);
            (theta1, error - TAU * (error / TAU).round())
        })
        .collect()
}

/// Largest difference between what the effect adds and `expected(θ1)`, with the same drive on both rigs.
pub(super) fn mismatch(name: &str, driver_rpm: f64, expected: impl Fn(&Plant, f64) -> f64) -> f64 {
    let spec = with(name);
    let nominal = PlantSpec::default().quiet();
    let plant = Plant::new(&nominal, 10_000.0, 11).unwrap();
    measured_curve(&spec, driver_rpm, 0.4)
        .iter()
        .zip(measured_curve(&nominal, driver_rpm, 0.4))
        .map(|(&(theta1, changed), (_, before))| (changed - before - expected(&plant, theta1)).abs())
        .fold(0.0, f64::max)
}

#[test]
fn encoder_errors_read_sines_of_their_order() {
    let output = |n: f64, eps: f64, phase: f64| {
        move |plant: &Plant, theta1: f64| eps * (n * plant.nominal_driven_rad(theta1) - phase).sin()
    };
    let input = |n: f64, eps: f64, phase: f64| {
        move |plant: &Plant, theta1: f64| -plant.nominal_ratio(theta1) * eps * (n * theta1 - phase).sin()
    };
    // Counting leaves up to two steps of each encoder, 0.9 µrad each.
    assert!(mismatch("encoder2_eccentricity", 5.0, output(1.0, 4e-5, 1.2)) < 4e-6);
    assert!(mismatch("encoder1_eccentricity", 5.0, input(1.0, 4e-5, 1.1)) < 4e-6);
    assert!(mismatch("encoder2_ellipticity", 5.0, output(2.0, 3e-5, 2.1)) < 4e-6);
    assert!(mismatch("encoder1_ellipticity", 5.0, input(2.0, 3e-5, 0.8)) < 4e-6);
    let cardan = 0.007f64.tan().powi(2);
    assert!(mismatch("coupling_misalignment_output", 5.0, output(2.0, cardan, 0.5)) < 4e-6);
    assert!(mismatch("coupling_misalignment_input", 5.0, input(2.0, -cardan, 1.7)) < 4e-6);
}

#[test]
fn gear_one_ahead_of_its_index_leads_with_the_ratio() {
    for rpm in [5.0, -5.0] {
        assert!(mismatch("phasing_error", rpm, |plant, theta1| 5e-5 * plant.nominal_ratio(theta1)) < 4e-6);
    }
}

#[test]
fn another_pitch_curve_is_another_transmission_function() {
    // ∂f/∂k = 2 sin θ1/(1 − 2k cos θ1 + k²), from f = θ1 + 2 atan(k sin θ1/(1 − k cos θ1)).
    let k = GearSpec::default().eccentricity;
    let shift = |_: &Plant, theta1: f64| 3e-5 * 2.0 * theta1.sin() / (1.0 - 2.0 * k * theta1.cos() + k * k);
    for rpm in [5.0, -5.0] {
        assert!(mismatch("pitch_curve_error", rpm, shift) < 4e-6);
    }
}

#[test]
fn a_late_output_leads_with_the_speed() {
    for rpm in [5.0, -5.0, 10.0] {
        let lead = move |plant: &Plant, theta1: f64| 60e-6 * rpm * TAU / 60.0 * plant.nominal_ratio(theta1);
        assert!(mismatch("time_skew", rpm, lead) < 4e-6);
    }
    // The other way round: the input is late.
    let mut spec = PlantSpec::default().quiet();
    spec.encoders.time_skew_s = -250e-6;
    let mut plant = turning(&spec, 10.0, 0.4);
    let before = plant.truth().angles_rad;
    let start = plant.step();
    let speed = (plant.truth().angles_rad[3] - before[3]) * 1e4;
    let mut clear = turning(&PlantSpec::default().quiet(), 10.0, 0.4);
    let lag = TAU * (clear.step().output_counts - start.output_counts) as f64 / 7.2e6;
    assert!((lag - 250e-6 * speed).abs() < 4e-6, "{lag}");
}

#[test]
fn gear_errors_change_the_rigid_contact() {
    for name in ["gear1_eccentricity", "gear2_eccentricity", "centre_distance_error", "backlash_error"] {
        let changed = Plant::new(&with(name), 10_000.0, 1).unwrap();
        let nominal = Plant::new(&PlantSpec::default(), 10_000.0, 1).unwrap();
        let shift = |theta: f64, flank| changed.rigid_error_rad(theta, flank) - nominal.rigid_error_rad(theta, flank);
        let angles: Vec<f64> = (0..60).map(|n| f64::from(n) * TAU / 60.0).collect();
        let size = angles.iter().map(|theta| shift(*theta, Flank::Ccw).abs()).fold(0.0, f64::max);
        assert!(size > 2e-5 && size < 5e-4, "{name}: {size}");
        if name.ends_with("error") {
            // Both only open the gap.
            assert!(angles.iter().all(|theta| shift(*theta, Flank::Ccw) < 0.0 && shift(*theta, Flank::Cw) > 0.0));
        }
    }
}

#[test]
fn softer_parts_wind_up_further_in_their_own_shapes() {
    let nominal = turning(&PlantSpec::default().quiet(), 5.0, 0.49);
    for (name, shape) in [
        ("shaft_compliance_output", (|_, _| 6e-6) as fn(f64, f64) -> f64),
        ("shaft_compliance_input", |ratio, _| 4e-6 * ratio * ratio),
        ("mesh_compliance", |_, arm| 0.03 / (arm * arm)),
    ] {
        let mut plant = turning(&with(name), 5.0, 0.49);
        for truth in turn_of_truth(&mut plant, 40) {
            let theta1 = truth.angles_rad[0];
            let (ratio, arm) = (nominal.nominal_ratio(theta1), nominal.driven_arm_mm(theta1, Flank::Ccw));
            let known = 8e-6 + 5e-6 * ratio * ratio + 1.7e-3 / (arm * arm);
            let elastic = truth.transmission_error_rad - plant.rigid_error_rad(theta1, Flank::Ccw);
            let extra = -elastic / truth.load_torque_nm - known;
            assert!((extra / shape(ratio, arm) - 1.0).abs() < 0.03, "{name} at {theta1}: {extra}");
        }
    }
}

#[test]
fn the_clamp_slips_with_load_and_revolutions_only() {
    let mut light = turning(&with("slip"), 5.0, 0.2);
    run(&mut light, 24.0);
    assert_eq!(light.truth().clamp_slip_rad, 0.0);
    let mut heavy = turning(&with("slip"), 5.0, 0.49);
    let before = heavy.truth();
    run(&mut heavy, 60.0);
    let after = heavy.truth();
    let lag = after.clamp_slip_rad - before.clamp_slip_rad;
    let load_nm = after.load_torque_nm;
    assert!((lag - 5.0 * 4e-6 * (load_nm - 4.0)).abs() < 8e-6, "{lag}");
    // The encoder lags: TE falls by the slip.
    let elastic = |truth: &Truth| truth.transmission_error_rad - heavy.rigid_error_rad(truth.angles_rad[0], Flank::Ccw);
    assert!((elastic(&before) - elastic(&after) - lag).abs() < 5e-6);
}

#[test]
fn lost_counts_add_up() {
    let mut plant = turning(&with("count_loss"), 10.0, 0.3);
    let mut deficit = Vec::new();
    for _ in 0..20 {
        run(&mut plant, 6.0);
        let sample = plant.step();
        let shaft = plant.truth().angles_rad[3] / TAU * 7.2e6;
        deficit.push(shaft - sample.output_counts as f64);
    }
    let steps: Vec<f64> = deficit.windows(2).map(|pair| ((pair[1] - pair[0]) / 24.0).round()).collect();
    assert!(steps.iter().all(|count| *count >= 0.0));
    let total: f64 = steps.iter().sum();
    assert!(total > 5.0 && total < 30.0, "{total}");
}

#[test]
fn a_warming_housing_saturates() {
    let mut plant = turning(&with("thermal_drift"), 5.0, 0.3);
    let gap = |plant: &Plant| plant.rigid_error_rad(1.0, Flank::Cw) - plant.rigid_error_rad(1.0, Flank::Ccw);
    let cold = gap(&Plant::new(&PlantSpec::default(), 10_000.0, 1).unwrap());
    run(&mut plant, 56.0);
    let at_tau = gap(&plant) - cold;
    run(&mut plant, 540.0);
    let warm = gap(&plant) - cold;
    assert!(warm > 5e-5);
    assert!((at_tau / warm - (1.0 - (-1.0f64).exp())).abs() < 0.01, "{}", at_tau / warm);
}
