//! The main job as a person runs it, on the simulated rig faster than real time, and its replay.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

fn rigd(arguments: &[&str]) -> std::process::Output {
    Command::cargo_bin("rigd").expect("the binary").args(arguments).output().expect("it runs")
}

fn run(out: &Path, more: &[&str]) -> (Value, PathBuf) {
    let out = out.to_str().expect("a path");
    let mut arguments = vec!["run", "--rpm", "5", "--json", "--out", out];
    if !more.contains(&"--load") {
        arguments.extend(["--load", "10Nm"]);
    }
    arguments.extend(more);
    let output = rigd(&arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    let summary: Value = serde_json::from_slice(&output.stdout).expect("one JSON object and nothing else");
    let log = PathBuf::from(summary["log"][0].as_str().expect("a log"));
    (summary, log)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"))
}

#[test]
fn measures_what_the_model_predicts() {
    let directory = TempDir::new().expect("a temporary directory");
    let (summary, log) = run(directory.path(), &[]);
    assert_eq!(summary["schema"], "rigd.run/1");
    assert_eq!(summary["backend"], "sim");
    assert_eq!(summary["losses"], 0);
    // Six revolutions at 5 rpm and 10 kS/s are 720 000 samples; the servo holds its speed to a part in a thousand.
    let samples = number(&summary["samples"]);
    assert!((samples - 720_000.0).abs() < 2000.0, "{samples}");
    assert!((number(&summary["duration_s"]) - 72.0).abs() < 0.2);
    for sense in ["ccw", "cw"] {
        let te = &summary["te"][sense];
        let (measured, predicted) = (number(&te["pp_rad"]), number(&te["predicted_pp_rad"]));
        assert!((measured / predicted - 1.0).abs() < 0.02, "{sense}: {measured} against {predicted}");
        assert!(number(&te["residual_rms_rad"]) < 3e-6, "{sense}: {te}");
        assert!(number(&te["offset_per_rev_rad"]).abs() < 2e-6, "{sense}: {te}");
    }
    let backlash = &summary["backlash"];
    assert!((number(&backlash["mean_rad"]) / number(&backlash["predicted_mean_rad"]) - 1.0).abs() < 0.01, "{backlash}");
    assert!(number(&backlash["min_rad"]) > 0.0);
    assert!(summary["te_hash"].as_str().is_some_and(|hash| hash.len() == "sha256:".len() + 64));
    let picture = std::fs::read_to_string(log.with_extension("svg")).expect("a picture beside the log");
    assert!(picture.contains("<svg") && picture.contains("backlash"));
}

#[test]
fn replay_gives_the_same_bits_and_info_the_same_counts() {
    let directory = TempDir::new().expect("a temporary directory");
    let (summary, log) = run(directory.path(), &["--revs", "2", "--load", "5..15Nm:10", "--seed", "7"]);
    let log = log.to_str().expect("a path");
    let output = rigd(&["replay", log, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let replay: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(replay["schema"], "rigd.replay/1");
    for key in ["samples", "losses", "te_hash", "te", "backlash", "runs"] {
        assert_eq!(summary[key], replay[key], "{key}");
    }
    assert_eq!(summary["runs"].as_array().map(Vec::len), Some(4));
    let info: Value = serde_json::from_slice(&rigd(&["info", log, "--json"]).stdout).expect("JSON");
    assert_eq!(info["complete"], true);
    let recorded: f64 = info["runs"].as_array().expect("runs").iter().map(|run| number(&run["samples"])).sum();
    assert_eq!(recorded, number(&summary["samples"]));
}

#[test]
fn one_seed_one_result_another_seed_another() {
    let directory = TempDir::new().expect("a temporary directory");
    let short = ["--revs", "1", "--direction", "ccw", "--rate", "2kHz"];
    let hash = |seed: &str| {
        let (summary, _) = run(directory.path(), &[&short[..], &["--seed", seed]].concat());
        summary["te_hash"].clone()
    };
    let first = hash("3");
    assert_eq!(first, hash("3"));
    assert_ne!(first, hash("4"));
}

#[test]
fn an_undocumented_effect_stands_above_the_floor() {
    let directory = TempDir::new().expect("a temporary directory");
    let residual = |more: &[&str]| {
        let (summary, _) = run(directory.path(), more);
        let te = summary["te"]["ccw"].clone();
        (number(&te["residual_rms_rad"]), number(&te["floor_rms_rad"]))
    };
    let (known, floor) = residual(&[]);
    let (unknown, _) = residual(&["--undocumented", "encoder2_eccentricity"]);
    assert!(unknown > 10.0 * known && unknown > 10.0 * floor, "{unknown} against {known}, floor {floor}");
}

#[test]
fn the_first_line_says_that_the_rig_is_simulated() {
    let directory = TempDir::new().expect("a temporary directory");
    let out = directory.path().to_str().expect("a path");
    let output = rigd(&["run", "--load", "10Nm", "--rpm", "5", "--revs", "1", "--out", out]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.lines().next().is_some_and(|line| line.contains("SIMULATED")), "{said}");
    assert!(said.contains("arcsec") || said.contains('"'));
    // Five rpm of slip is below what makers recommend, and the run says so.
    assert!(String::from_utf8_lossy(&output.stderr).contains("sticks and slips"));
}
