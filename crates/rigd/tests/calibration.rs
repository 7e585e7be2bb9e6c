//! What a calibration finds on the simulated rig is the plant's own truth, within the uncertainty that it states; and a wrong statement is found
//! out.

mod support;

use rigd::calibration::Calibration;
use rigd::profile::Profile;
use rigsim::plant::{BrakeSpec, PlantSpec};
use support::desk::Desk;

/// (rising, falling) torque of the plant at a current, N·m, by the points of its own curve.
fn truth(current_a: f64) -> (f64, f64) {
    let curve = BrakeSpec::default().nominal_curve();
    let above = curve.iter().position(|point| point.current_a >= current_a).expect("within the curve").max(1);
    let (low, high) = (curve[above - 1], curve[above]);
    let part = (current_a - low.current_a) / (high.current_a - low.current_a);
    let between = |a: f64, b: f64| a + part * (b - a);
    (between(low.rising_nm, high.rising_nm), between(low.falling_nm, high.falling_nm))
}

#[test]
fn the_brakes_curve_is_the_plants_within_its_uncertainty() {
    let desk = Desk::new();
    // The stated torque constant and drag are the plant's; what is left is what the measurement itself scatters.
    let line =
        "calibrate brake --drag 0.3Nm --drag-uncertainty 0.02Nm --torque-uncertainty 0.5 --logs @/runs --json --out";
    desk.json(0, &format!("{line} @/calibration.toml --rated-torque 2.39Nm"));
    let found = Calibration::load(&desk.at("calibration.toml")).expect("a calibration").0.brake.expect("a brake");
    let highest = found.rising.last().expect("points")[0];
    let mut worst = 0.0f64;
    for (branch, rising) in [(&found.rising, true), (&found.falling, false)] {
        for [current_a, torque_nm, uncertainty_nm] in branch {
            // Near the reversal the torque is on its way from one branch to the other.
            if !rising && *current_a > 0.8 * highest {
                continue;
            }
            let (up, down) = truth(*current_a);
            let miss = torque_nm - if rising { up } else { down };
            println!(
                "{current_a:.3} A {}: {torque_nm:.3} ± {uncertainty_nm:.3} N·m, off by {miss:+.3}",
                if rising { "up" } else { "down" }
            );
            assert!(*uncertainty_nm < 0.25 + 0.02 * torque_nm, "an uncertainty that says something: {uncertainty_nm}");
            worst = worst.max(miss.abs() / uncertainty_nm);
        }
    }
    println!("largest miss: {worst:.2} of its uncertainty");
    assert!(worst <= 1.0, "{worst}");
    // The branches are told apart, by more than both uncertainties.
    let middle = found.rising.len() / 2;
    assert!(found.falling[middle][1] - found.rising[middle][1] > found.falling[middle][2] + found.rising[middle][2]);

    // A name plate that is read 5 % wrong gives a curve that the plant does not have.
    desk.json(0, &format!("{line} @/wrong.toml --rated-torque 2.51Nm"));
    let wrong = Calibration::load(&desk.at("wrong.toml")).expect("a calibration").0.brake.expect("a brake");
    assert!(wrong.rising.iter().any(|point| (point[1] - truth(point[0]).0).abs() > point[2]));

    // A run takes the curve over, and its log carries the calibration.
    let ran = desk.json(
        0,
        "run --load 8Nm --rpm 20 --revs 1 --direction ccw --rate 1kHz --calibration @/calibration.toml --out @/runs --json",
    );
    let info = riglog::info(ran["log"][0].as_str().expect("a log")).expect("a readable log");
    let attached = |name: &str| {
        let found = info.attachments.iter().find(|attachment| attachment.name == name).expect("an attachment");
        String::from_utf8(found.data.clone().expect("kept")).expect("text")
    };
    assert_eq!(attached("calibration.toml"), std::fs::read_to_string(desk.at("calibration.toml")).expect("a file"));
    let profile = Profile::parse(&attached("rig.toml"), "rig.toml".as_ref()).expect("a profile");
    assert_eq!(profile.brake.rising.len(), found.rising.len());
    let current = profile.brake.current_a(8.0).expect("within");
    assert!((truth(current).0 - 8.0).abs() < 0.15, "{current} A load the plant with {} N·m", truth(current).0);
}

#[test]
fn limits_hold_for_calibrations_too() {
    let desk = Desk::new();
    for (line, needles) in [
        ("--rated-torque 2.39Nm --max-current 5", &["--max-current", "brake.current_limit_a"][..]),
        ("--rated-torque 2.39Nm --rpm 500", &["--rpm", "limits.speed_rpm"]),
        ("--rated-torque 2.39Nm --rpm 60", &["W", "limits.slip_power_w"]),
        ("--rated-torque 0Nm", &["--rated-torque"]),
    ] {
        let output = desk.run(&format!("calibrate brake --logs @/runs --out @/c.toml {line}"));
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(needles.iter().all(|needle| said.contains(needle)), "{line}: {said}");
        assert!(!desk.at("c.toml").exists());
    }
}

/// Logs of the same run with the disc at these places, each on another day of the rig.
fn mounted(desk: &Desk, which: &str, effect: &str, degrees: &[f64]) -> Vec<String> {
    degrees
        .iter()
        .enumerate()
        .map(|(number, degrees)| {
            let mut profile = Profile::simulated();
            match which {
                "input" => profile.counter.input_mounted_deg = *degrees,
                _ => profile.counter.output_mounted_deg = *degrees,
            }
            let name = format!("{which}{degrees}.toml");
            std::fs::write(desk.at(&name), profile.to_toml()).expect("a file");
            let ran = desk.json(
                0,
                &format!(
                    "run --load 5Nm --rpm 20 --revs 4 --direction both --rate 2kHz --profile @/{name} --seed {} --undocumented {effect} --out @/{which} --json",
                    number + 1
                ),
            );
            ran["log"][0].as_str().expect("a log").to_owned()
        })
        .collect()
}

#[test]
fn a_disc_turned_on_its_shaft_tells_its_own_errors_from_everything_elses() {
    for which in ["input", "output"] {
        let desk = Desk::new();
        let (effect, key) = match which {
            "input" => ("encoder1_eccentricity", "encoder_input"),
            _ => ("encoder2_eccentricity", "encoder_output"),
        };
        let logs = mounted(&desk, which, effect, &[0.0, 120.0, 240.0]).join(" ");
        let told = desk.json(0, &format!("calibrate encoder {which} {logs} --out @/calibration.toml --json"));
        // The plant's own disc.
        let mut spec = PlantSpec::default();
        rigsim::plant::faults::find(effect).expect("an effect").apply_usual(&mut spec);
        let disc = if which == "input" { &spec.encoders.input } else { &spec.encoders.output };
        let orders = told["disc"]["orders"].as_array().expect("orders");
        let order = |wanted: f64| {
            let found = orders.iter().find(|order| order[0].as_f64() == Some(wanted)).expect("told");
            [1, 2, 3].map(|n| found[n].as_f64().expect("a number"))
        };
        let [eps, phase, uncertainty] = order(1.0);
        println!(
            "{which}: eps {eps:.4e} ± {uncertainty:.1e} (truth {:.4e}), phase {phase:.4} (truth {:.4})",
            disc.eccentricity, disc.eccentricity_phase_rad
        );
        let off = |a: f64, b: f64| eps * a - disc.eccentricity * b;
        let miss = off(phase.cos(), disc.eccentricity_phase_rad.cos())
            .hypot(off(phase.sin(), disc.eccentricity_phase_rad.sin()));
        assert!(miss <= 1.5 * uncertainty, "{which}: {miss:e} of ±{uncertainty:e}");
        assert!(uncertainty < 0.2 * eps, "{which}: an uncertainty that says something: {uncertainty:e}");
        // A sound disc has no order 2 beyond its uncertainty, and three divisions cannot tell order 3.
        let [eps2, _, uncertainty2] = order(2.0);
        assert!(eps2 <= 1.5 * uncertainty2, "{which}: {eps2:e} ± {uncertainty2:e}");
        assert_eq!(told["disc"]["untold_orders"], serde_json::json!([3]));
        let snippet = told["documented"].as_str().expect("a snippet");
        assert!(snippet.contains(effect), "{snippet}");
        // The snippet is what the pair file takes.
        let pair = format!("{}\n{snippet}", riglog::pair::DEFAULT_PAIR);
        riglog::pair::parse(&pair, "pair.toml".as_ref()).expect("a pair");
        assert!(std::fs::read_to_string(desk.at("calibration.toml")).expect("a file").contains(key));
        // One place of the disc tells nothing.
        let one = logs.split(' ').next().expect("a log");
        let output = desk.run(&format!("calibrate encoder {which} {one} --out @/calibration.toml"));
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains("mounted_deg"));
    }
}

#[test]
fn the_zeros_of_a_rig_without_errors_are_none() {
    let desk = Desk::new();
    let ran = desk.json(0, "run --load 5Nm --rpm 20 --revs 3 --direction both --rate 2kHz --out @/runs --json");
    let log = ran["log"][0].as_str().expect("a log");
    let told = desk.json(0, &format!("calibrate zero {log} --out @/calibration.toml --json"));
    let zero = &told["zero"];
    let number = |key: &str| zero[key].as_f64().expect("a number");
    println!("{zero}");
    for which in ["input", "output"] {
        let (value, uncertainty) = (number(&format!("{which}_rad")), number(&format!("{which}_uncertainty_rad")));
        assert!(value.abs() <= 1.5 * uncertainty, "{which}: {value:e} ± {uncertainty:e}");
        assert!(uncertainty < 2e-4, "{which}: {uncertainty:e}");
    }
}
