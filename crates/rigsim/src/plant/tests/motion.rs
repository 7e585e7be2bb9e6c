//! Motion: energy, irregularity, stability at every rate, reproducibility.

use super::*;
use proptest::prelude::*;
use std::f64::consts::TAU;

/// Kinetic energy of the chain, J.
fn kinetic_j(spec: &PlantSpec, truth: &Truth) -> f64 {
    let inertia = [
        spec.drive.inertia_kg_m2,
        spec.shafts.gear1_inertia_kg_m2,
        spec.shafts.gear2_inertia_kg_m2,
        spec.shafts.disc_inertia_kg_m2,
        spec.brake.rotor_inertia_kg_m2,
    ];
    inertia.iter().zip(truth.speeds_rad_per_s).map(|(j, v)| 0.5 * j * v * v).sum()
}

#[test]
fn a_free_chain_keeps_its_energy() {
    for eccentricity in [0.0, 0.3287] {
        let mut spec = PlantSpec::default().quiet();
        spec.gears = GearSpec { eccentricity, ..spec.gears.ideal() };
        spec.brake.drag_nm = 0.0;
        spec.shafts.bearing_nm_s_per_rad = 0.0;
        spec.drive.friction_nm = 0.0;
        spec.drive.viscous_nm_s_per_rad = 0.0;
        let mut plant = turning(&spec, 20.0, 0.0);
        plant.set_enabled(false);
        run(&mut plant, 0.5);
        let start = kinetic_j(&spec, &plant.truth());
        let mut fastest: f64 = 0.0;
        for _ in 0..300 {
            run(&mut plant, 0.02);
            let truth = plant.truth();
            let energy = kinetic_j(&spec, &truth);
            assert!((energy / start - 1.0).abs() < 2e-3, "k = {eccentricity}: {}", energy / start);
            fastest = fastest.max(truth.speeds_rad_per_s[2] / truth.speeds_rad_per_s[0]);
        }
        assert!((fastest - (1.0 + eccentricity) / (1.0 - eccentricity)).abs() < 0.02);
    }
}

#[test]
fn the_work_of_the_drive_becomes_heat_of_the_brake() {
    let spec = PlantSpec::default().quiet();
    let mut plant = turning(&spec, 5.0, 0.49);
    let (mut work_j, mut heat_j, mut losses_j) = (0.0, 0.0, 0.0);
    let start = kinetic_j(&spec, &plant.truth());
    for _ in 0..120_000 {
        plant.step();
        let truth = plant.truth();
        let [v0, v1, v2, _, v4] = truth.speeds_rad_per_s;
        work_j += truth.input_torque_nm * v0 * 1e-4;
        heat_j += truth.brake_torque_nm * v4 * 1e-4;
        losses_j += spec.shafts.bearing_nm_s_per_rad * (v1 * v1 + v2 * v2) * 1e-4;
    }
    let stored = kinetic_j(&spec, &plant.truth()) - start;
    assert!(heat_j > 60.0);
    assert!((work_j - heat_j - losses_j - stored).abs() < 2e-3 * heat_j, "{work_j} {heat_j} {losses_j} {stored}");
}

/// (relative RMS of the load torque, RMS of the elastic part of TE) at a speed, slow parts taken out.
fn irregularity(driver_rpm: f64) -> (f64, f64) {
    let mut spec = PlantSpec::default().quiet();
    spec.brake.stick_slip_ratio = BrakeSpec::default().stick_slip_ratio;
    // A circular pair keeps the slip constant.
    spec.gears = GearSpec { eccentricity: 0.0, ..spec.gears.ideal() };
    let mut plant = turning(&spec, driver_rpm, 0.49);
    let (torques, errors): (Vec<f64>, Vec<f64>) = (0..100_000)
        .map(|_| {
            plant.step();
            let truth = plant.truth();
            (truth.load_torque_nm, truth.transmission_error_rad)
        })
        .unzip();
    let (rms, mean) = spread(&torques);
    (rms / mean, spread(&errors).0)
}

#[test]
fn stick_slip_grows_below_ten_rpm_and_stays_small_in_te() {
    let (slow, middle, fast) = (irregularity(2.0), irregularity(5.0), irregularity(15.0));
    assert!(slow.0 > 1.3 * middle.0, "{slow:?} {middle:?}");
    assert!((middle.0 - 0.005).abs() < 0.001, "{middle:?}");
    assert!(middle.1 < 1e-6, "{middle:?}");
    assert!(fast.0 < 2e-4, "{fast:?}");
}

#[test]
fn run_out_scatters_revolutions_by_about_a_microradian() {
    let mut spec = PlantSpec::default().quiet();
    spec.noise = NoiseSpec::default();
    let mut plant = turning(&spec, 5.0, 0.3);
    let mut first: Vec<f64> = Vec::new();
    let mut differences = Vec::new();
    for turn in 0..5 {
        for bin in 0..48 {
            let target = TAU * (f64::from(turn) + 2.0 + f64::from(bin) / 48.0);
            while plant.truth().angles_rad[0] < target {
                plant.step();
            }
            let truth = plant.truth();
            let error = truth.transmission_error_rad - plant.rigid_error_rad(truth.angles_rad[0], Flank::Ccw);
            if turn == 0 {
                first.push(error);
            } else {
                differences.push(error - first[bin as usize]);
            }
        }
    }
    let (rms, mean) = spread(&differences);
    let scatter = rms.hypot(mean);
    assert!(scatter > 4e-7 && scatter < 4e-6, "{scatter}");
}

#[test]
fn the_same_rig_at_every_sample_rate() {
    let spec = PlantSpec::default().quiet();
    for rate_hz in [1e3, 2.5e3, 10e3, 37e3, 100e3] {
        let mut plant = turning(&spec, 5.0, 0.49);
        plant.set_sample_rate_hz(rate_hz).unwrap();
        run(&mut plant, 2.0);
        for _ in 0..20 {
            run(&mut plant, 0.3);
            let truth = plant.truth();
            let theta1 = truth.angles_rad[0];
            let elastic = truth.transmission_error_rad - plant.rigid_error_rad(theta1, Flank::Ccw);
            let arm_mm = plant.driven_arm_mm(theta1, Flank::Ccw);
            let expected = -truth.load_torque_nm
                * (8e-6 + 5e-6 * plant.nominal_ratio(theta1).powi(2) + 1.7e-3 / (arm_mm * arm_mm));
            assert!((elastic / expected - 1.0).abs() < 0.005, "{rate_hz} Hz: {elastic} {expected}");
        }
    }
}

#[test]
fn the_step_is_short_enough() {
    // The same drive with a tenth of the step: the shafts agree in time, TE in the angle.
    let spec = PlantSpec::default().quiet();
    for driver_rpm in [5.0, 20.0, 60.0] {
        let (mut coarse, mut fine) = (turning(&spec, driver_rpm, 0.4), turning(&spec, driver_rpm, 0.4));
        fine.set_sample_rate_hz(100e3).unwrap();
        for _ in 0..50 {
            (0..400).for_each(|_| _ = coarse.step());
            (0..4000).for_each(|_| _ = fine.step());
            let (a, b) = (coarse.truth(), fine.truth());
            let elastic = |plant: &Plant, truth: &Truth| {
                truth.transmission_error_rad - plant.rigid_error_rad(truth.angles_rad[0], Flank::Ccw)
            };
            let (te, finer) = (elastic(&coarse, &a), elastic(&fine, &b));
            assert!((te - finer).abs() < 1e-7 + 1e-3 * te.abs(), "{driver_rpm} rpm: {te} {finer}");
            assert!((a.angles_rad[0] - b.angles_rad[0]).abs() < 1e-4, "{driver_rpm} rpm");
        }
    }
}

#[test]
fn the_clock_counts_samples_exactly() {
    let mut plant = Plant::new(&PlantSpec::default(), 10_000.0, 1).unwrap();
    for _ in 0..30_000 {
        plant.step();
    }
    assert_eq!(plant.time_s(), 3.0);
    plant.set_sample_rate_hz(1000.0).unwrap();
    plant.step();
    assert!((plant.time_s() - 3.001).abs() < 1e-12);
    assert!(plant.set_sample_rate_hz(f64::NAN).is_err());
    assert!(plant.set_sample_rate_hz(0.0).is_err());
}

#[test]
fn the_same_seed_gives_the_same_samples() {
    let record = |seed: u64| {
        let mut plant = Plant::new(&PlantSpec::default(), 10_000.0, seed).unwrap();
        let mut samples = Vec::new();
        plant.set_enabled(true);
        plant.set_drive(true, 0.4, 60.0);
        for rpm in [100.0, 200.0, -150.0] {
            plant.set_speed_reference_rpm(rpm);
            samples.extend((0..20_000).map(|_| plant.step()));
        }
        samples
    };
    assert_eq!(record(42), record(42));
    assert_ne!(record(42), record(43));
}

#[test]
fn the_start_lies_anywhere_in_the_turn() {
    let starts: Vec<f64> =
        (0..64).map(|seed| Plant::new(&PlantSpec::default(), 10_000.0, seed).unwrap().truth().angles_rad[0]).collect();
    assert!(starts.iter().all(|angle| *angle > 0.0 && *angle < TAU));
    for quarter in 0..4 {
        let (from, to) = (f64::from(quarter) * TAU / 4.0, f64::from(quarter + 1) * TAU / 4.0);
        assert!(starts.iter().any(|angle| (from..to).contains(angle)));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever is asked of the rig, at whatever rate, it stays finite and its teeth in their gap.
    #[test]
    fn no_command_breaks_the_rig(
        rate_hz in prop::sample::select(vec![1e3, 5e3, 10e3, 48e3, 100e3]),
        eccentricity in 0.0..0.6f64,
        backlash_mm in 0.15..0.5f64,
        compliance in prop::sample::select(vec![0.0, 1e-6, 1e-4]),
        orders in prop::collection::vec((-3000.0..3000.0f64, 0.0..1.5f64, any::<bool>()), 1..6),
        seed in any::<u64>(),
    ) {
        let mut spec = PlantSpec::default();
        spec.gears.eccentricity = eccentricity;
        spec.gears.backlash_mm = backlash_mm;
        spec.shafts.compliance_input_rad_per_nm = compliance;
        spec.shafts.compliance_output_rad_per_nm = compliance;
        let mut plant = Plant::new(&spec, rate_hz, seed).unwrap();
        for (rpm, current_a, enabled) in orders {
            plant.set_enabled(enabled);
            plant.set_speed_reference_rpm(rpm);
            plant.set_drive(true, current_a, 60.0);
            run(&mut plant, 0.4);
            let truth = plant.truth();
            prop_assert!(truth.angles_rad.iter().chain(&truth.speeds_rad_per_s).all(|x| x.is_finite()));
            prop_assert!(truth.speeds_rad_per_s.iter().all(|v| v.abs() < 100.0), "{truth:?}");
            let theta1 = truth.angles_rad[1];
            let error = truth.angles_rad[2] - plant.nominal_driven_rad(theta1);
            // Full motor torque, 143 N·m, presses the teeth by at most 1e-4 rad.
            prop_assert!(error > plant.rigid_error_rad(theta1, Flank::Ccw) - 5e-4);
            prop_assert!(error < plant.rigid_error_rad(theta1, Flank::Cw) + 5e-4);
        }
    }
}
