//! Effects injected by formulas of their own are named by the diagnosis, with their parameters: those whose trace has several shapes.

#![allow(clippy::unwrap_used)] // helpers of tests may

use std::f64::consts::TAU;

use diagnosis::diagnosis::Verdict;
use diagnosis::{Diagnosis, Options, diagnose};
use gearmodel::recording::{Columns, Recording};
use gearmodel::{Direction, EllipticalSpec, Errors, GearPair, NominalModel};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const SAMPLES_PER_REV: usize = 1500;
const REVOLUTIONS: usize = 3;
const FLOOR_RAD: f64 = 15e-6;

/// Diagnosis of a campaign in which `te`(θ1, sense, ω) is added to the document's pair.
fn diagnosed(te: impl Fn(&GearPair, f64, f64, f64) -> f64) -> Diagnosis {
    let pair = GearPair::elliptical(&EllipticalSpec::default()).unwrap();
    let mut random = Pcg64Mcg::seed_from_u64(11);
    // Uniform noise of the floor's RMS, and a level that wanders a little from turn to turn.
    let mut noise = move |rms: f64| rms * 3.0_f64.sqrt() * (2.0 * random.random::<f64>() - 1.0);
    let mut start_s = 0.0;
    let mut recordings = Vec::new();
    for (load_nm, rpm) in [(0.5, 5.0), (10.0, 5.0), (10.0, 2.5), (10.0, 10.0)] {
        for direction in Direction::BOTH {
            let omega = direction.sign() * rpm * TAU / 60.0;
            let (mut time_s, mut theta1_rad, mut theta2_rad) = (Vec::new(), Vec::new(), Vec::new());
            for revolution in 0..REVOLUTIONS {
                let level = noise(2e-6);
                for n in 0..SAMPLES_PER_REV {
                    let turned = TAU * (revolution as f64 + n as f64 / SAMPLES_PER_REV as f64);
                    let theta = direction.sign() * turned;
                    time_s.push(start_s + turned / omega.abs());
                    theta1_rad.push(theta);
                    let error = te(&pair, theta, direction.sign(), omega) + level + noise(FLOOR_RAD);
                    theta2_rad.push(pair.theta2(theta) + error);
                }
            }
            start_s = time_s[time_s.len() - 1] + 20.0;
            recordings.push(
                Recording::new(Columns {
                    time_s: time_s.into(),
                    theta1_rad: theta1_rad.into(),
                    theta2_rad: theta2_rad.into(),
                    load_nm: load_nm.into(),
                    speed_rpm: rpm.into(),
                    direction: Some(direction),
                    input_lines: None,
                    output_lines: None,
                })
                .unwrap(),
            );
        }
    }
    let model = NominalModel::new(pair, Errors::default()).unwrap();
    diagnose(&recordings, &model, &Options::default()).unwrap()
}

/// The only name of the verdict.
fn only(found: &Diagnosis) -> &str {
    match &found.verdict[..] {
        [Verdict::Name(name)] => name,
        other => panic!("{other:?}"),
    }
}

fn value(found: &Diagnosis, effect: &str, parameter: &str) -> f64 {
    let effect = found.effects.iter().find(|e| e.name == effect).unwrap();
    serde_json::to_value(&effect.parameters).unwrap()[parameter]["value"].as_f64().unwrap()
}

#[test]
fn an_encoder_on_a_soft_coupling_is_named_with_its_frequency() {
    let f_hz = 16.0;
    let found = diagnosed(|pair, theta, _, omega| {
        let slope = (pair.ratio(theta + 1e-5) - pair.ratio(theta - 1e-5)) / 2e-5;
        -(omega / (TAU * f_hz)).powi(2) * slope
    });
    assert_eq!(only(&found), "torsional_resonance");
    let f = value(&found, "torsional_resonance", "f_hz");
    assert!((f / f_hz - 1.0).abs() < 0.03, "{f} Hz");
    let signature = serde_json::to_value(found.location.signature).unwrap();
    assert_eq!((&signature["parity"], signature["speed_exponent"].as_f64()), (&"even".into(), Some(2.0)));
}

#[test]
fn a_profile_alike_in_both_senses_is_named_with_its_phase() {
    let found = diagnosed(|pair, theta, sense, _| {
        let at = pair.at(theta);
        let arm_mm = at.r2_mm * (pair.pressure_angle_rad() - sense * at.mu_rad).cos();
        2e-3 * (TAU * pair.tooth_phase(theta).unwrap() - 0.9).sin() / arm_mm
    });
    assert_eq!(only(&found), "profile_error");
    assert!((value(&found, "profile_error", "a1_mm") / 2e-3 - 1.0).abs() < 0.05);
    assert!((value(&found, "profile_error", "ph1_rad") - 0.9).abs() < 0.05);
    assert_eq!(serde_json::to_value(found.location.signature).unwrap()["parity"], "even");
}
