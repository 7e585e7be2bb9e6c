//! Slow motion: exact geometry, wind-up, backlash, standstill.

use super::*;
use std::f64::consts::TAU;

/// −dir·T·[C_out + C_in i² + C_mesh/(r2 cos(α ∓ μ))²], from the nominal pitch curves.
fn wind_up(spec: &PlantSpec, theta1: f64, direction: f64, load_nm: f64) -> f64 {
    let curves = geometry::PitchCurves::new(&spec.gears);
    let mu = curves.radius(theta1).inclination();
    let alpha = spec.gears.pressure_angle_deg.to_radians();
    let arm_mm = curves.driven_radius(theta1) * (alpha - direction * mu).cos();
    let ratio = curves.ratio(theta1);
    -direction
        * load_nm
        * (spec.shafts.compliance_output_rad_per_nm
            + spec.shafts.compliance_input_rad_per_nm * ratio * ratio
            + spec.mesh.compliance_mm2_rad_per_nm / (arm_mm * arm_mm))
}

#[test]
fn a_loaded_rig_winds_up_as_its_compliances_say() {
    let mut soft_teeth = PlantSpec::default().quiet();
    soft_teeth.mesh.compliance_mm2_rad_per_nm = 0.03;
    for spec in [PlantSpec::default().quiet(), soft_teeth] {
        for (direction, flank) in [(1.0, Flank::Ccw), (-1.0, Flank::Cw)] {
            let mut plant = turning(&spec, 5.0 * direction, 0.49);
            for truth in turn_of_truth(&mut plant, 97) {
                assert_eq!(truth.contact, Some(flank));
                let load_nm = truth.load_torque_nm.abs();
                assert!((load_nm - 10.0).abs() < 0.5, "{load_nm}");
                let theta1 = truth.angles_rad[0];
                let elastic = truth.transmission_error_rad - plant.rigid_error_rad(theta1, flank);
                let expected = wind_up(&spec, theta1, direction, load_nm);
                assert!((elastic / expected - 1.0).abs() < 0.01, "at {theta1}: {elastic} against {expected}");
            }
        }
    }
}

#[test]
fn without_errors_load_and_noise_there_is_no_transmission_error() {
    for eccentricity in [0.0, 0.3287, 0.6] {
        let mut spec = PlantSpec::default().quiet();
        spec.gears = GearSpec { eccentricity, ..spec.gears.ideal() };
        spec.brake.drag_nm = 0.0;
        spec.shafts.bearing_nm_s_per_rad = 0.0;
        let mut plant = turning(&spec, 2.0, 0.0);
        for _ in 0..200 {
            run(&mut plant, 0.15);
            // What is left is the inertia of gear 2 and the brake: some mN·m over some 1e-5 rad/(N·m).
            let error = plant.truth().transmission_error_rad;
            assert!(error.abs() < 3e-7, "k = {eccentricity}: {error}");
        }
    }
}

#[test]
fn noise_of_the_samples_is_that_of_the_encoders() {
    let mut spec = PlantSpec::default();
    spec.gears = GearSpec { eccentricity: 0.0, ..spec.gears.ideal() };
    spec.noise.run_out_rms_mm = 0.0;
    let mut plant = turning(&spec, 5.0, 0.3);
    let per_count = TAU / 7.2e6;
    let errors: Vec<f64> = (0..50_000)
        .map(|_| {
            let sample = plant.step();
            let truth = plant.truth();
            let read = (sample.output_counts - sample.input_counts) as f64 * per_count;
            read - (truth.angles_rad[3] - truth.angles_rad[0])
        })
        .collect();
    let quantum = per_count * per_count / 12.0;
    let expected = (3e-6f64.powi(2) + 4e-6f64.powi(2) + 2.0 * quantum).sqrt();
    assert!((spread(&errors).0 / expected - 1.0).abs() < 0.03, "{}", spread(&errors).0);
}

#[test]
fn a_reversal_takes_up_exactly_the_backlash() {
    let mut spec = PlantSpec::default().quiet();
    spec.brake.drag_nm = 0.01;
    let mut plant = turning(&spec, 2.0, 0.0);
    let before = plant.truth();
    assert_eq!(before.contact, Some(Flank::Ccw));
    plant.set_speed_reference_rpm(-2.0 * 20.0);
    let mut apart = false;
    while plant.truth().angles_rad[0] > before.angles_rad[0] - 0.2 {
        plant.step();
        apart |= plant.truth().contact.is_none();
    }
    assert!(apart, "the teeth must cross the gap");
    for _ in 0..50 {
        run(&mut plant, 0.5);
        let truth = plant.truth();
        assert_eq!(truth.contact, Some(Flank::Cw));
        let theta1 = truth.angles_rad[0];
        // 0.01 N·m winds the rig up by 0.1 to 0.3 µrad.
        let lead = truth.transmission_error_rad - plant.rigid_error_rad(theta1, Flank::Ccw);
        let backlash = plant.rigid_error_rad(theta1, Flank::Cw) - plant.rigid_error_rad(theta1, Flank::Ccw);
        assert!((lead - backlash).abs() < 1e-6, "{lead} against {backlash}");
    }
}

#[test]
fn at_standstill_the_brake_holds_without_chatter() {
    let spec = PlantSpec::default().quiet();
    let mut plant = turning(&spec, 5.0, 0.49);
    plant.set_speed_reference_rpm(0.0);
    run(&mut plant, 3.0);
    let still = plant.truth();
    for _ in 0..50_000 {
        plant.step();
        let truth = plant.truth();
        assert_eq!(truth.speeds_rad_per_s[4], 0.0);
        assert_eq!(truth.angles_rad[4], still.angles_rad[4]);
        assert!(truth.brake_torque_nm.abs() < 10.5);
        assert!((truth.transmission_error_rad - still.transmission_error_rad).abs() < 1e-6);
    }
    // The servo off, the wound-up shafts unwind through the drive's friction, the brake still holds its rotor.
    plant.set_enabled(false);
    run(&mut plant, 5.0);
    let off = plant.truth();
    assert_eq!(off.angles_rad[4], still.angles_rad[4]);
    assert!(off.speeds_rad_per_s.iter().all(|v| v.abs() < 1e-4), "{off:?}");
}

#[test]
fn a_servo_switched_off_coasts_to_rest() {
    let mut plant = turning(&PlantSpec::default(), 20.0, 0.0);
    plant.set_enabled(false);
    run(&mut plant, 2.0);
    assert!(plant.truth().speeds_rad_per_s[0].abs() < 1e-3);
    assert_eq!(plant.torque_percent().round(), 0.0);
}

#[test]
fn measured_angles_need_only_counts_and_indices() {
    let mut plant = turning(&PlantSpec::default(), 10.0, 0.3);
    run(&mut plant, 10.0);
    let (input_index, output_index) = (plant.input_index_counts().unwrap(), plant.output_index_counts().unwrap());
    for _ in 0..100 {
        run(&mut plant, 0.05);
        let sample = plant.step();
        let truth = plant.truth();
        let angle = |counts: i64, index: i64| TAU * (counts - index) as f64 / 7.2e6;
        let turns = |measured: f64, shaft: f64| ((shaft - measured) / TAU).round() * TAU;
        let theta1 = angle(sample.input_counts, input_index);
        let theta2 = angle(sample.output_counts, output_index);
        assert!((theta1 + turns(theta1, truth.angles_rad[0]) - truth.angles_rad[0]).abs() < 3e-5);
        assert!((theta2 + turns(theta2, truth.angles_rad[3]) - truth.angles_rad[3]).abs() < 3e-5);
    }
}

#[test]
fn a_rig_documented_as_rigid_is_rigid() {
    let mut spec = PlantSpec::default().quiet();
    spec.shafts.compliance_input_rad_per_nm = 0.0;
    spec.shafts.compliance_output_rad_per_nm = 0.0;
    spec.mesh.compliance_mm2_rad_per_nm = 0.0;
    let mut plant = turning(&spec, 5.0, 0.49);
    for truth in turn_of_truth(&mut plant, 50) {
        let elastic = truth.transmission_error_rad - plant.rigid_error_rad(truth.angles_rad[0], Flank::Ccw);
        // 1e-8 rad/(N·m) in either shaft and 1e-4 mm²·rad/(N·m) at the teeth stand in for none.
        assert!(elastic.abs() < 1.5e-6, "{elastic}");
    }
}
