//! `rigd analyse` on logs whose orders are known.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

fn rigd(arguments: &[&str]) -> Output {
    Command::cargo_bin("rigd").expect("the binary").args(arguments).output().expect("it runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A log of `turns` turns of the driver, of the pair in `toml`, with TE as a function of θ1.
fn log(directory: &Path, toml: &str, turns: u32, te_rad: impl Fn(f64) -> f64) -> String {
    const ROWS: u32 = 7200;
    let path = |name: &str| directory.join(name).display().to_string();
    std::fs::write(path("pair.toml"), toml).expect("a pair");
    let model = riglog::pair::parse(toml, Path::new("pair.toml")).expect("a pair");
    let mut table = "time_s,theta1_rad,theta2_rad,load_nm,speed_rpm,direction\n".to_owned();
    for n in 0..turns * ROWS {
        let theta1 = TAU * (f64::from(n) + 0.5) / f64::from(ROWS);
        let theta2 = model.pair.theta2(theta1) + te_rad(theta1);
        writeln!(table, "{:.3},{theta1},{theta2},10,12,ccw", f64::from(n) * 1e-3).expect("a String");
    }
    std::fs::write(path("table.csv"), table).expect("a table");
    let (table, pair, log) = (path("table.csv"), path("pair.toml"), path("run.mcap"));
    let output = rigd(&["import", &table, "--pair", &pair, "--out", &log]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    log
}

fn analysed(arguments: &[&str]) -> Value {
    let output = rigd(&[&["analyse", "--json"], arguments].concat());
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    serde_json::from_slice(&output.stdout).expect("one object")
}

fn strongest(spectrum: &Value) -> (f64, f64) {
    let lines = spectrum["lines"].as_array().expect("lines").iter();
    let number = |line: &Value, name: &str| line[name].as_f64().expect("a number");
    lines
        .map(|line| (number(line, "order"), number(line, "amplitude_rad")))
        .max_by(|one, other| one.1.total_cmp(&other.1))
        .expect("a line")
}

const ELLIPSE: &str = "kind = \"elliptical\"\nmodule_mm = 3.0\nteeth = [47, 47]\neccentricity = 0.3287\n";

#[test]
fn waves_of_each_axis_are_found_and_parted() {
    let directory = TempDir::new().expect("a directory");
    let model = riglog::pair::parse(ELLIPSE, Path::new("pair.toml")).expect("a pair");
    let tooth = |theta1: f64| TAU * model.pair.tooth_phase(theta1).expect("teeth");
    let log = log(directory.path(), ELLIPSE, 4, |theta1| 1e-3 * (2.0 * theta1).cos() + 1e-4 * tooth(theta1).cos());
    let found = analysed(&[&log, "--bins", "1440", "--split", "mesh:0.3"]);
    assert_eq!(found["schema"], "rigd.analyse/1");
    let run = &found["runs"][0];
    assert_eq!((run["direction"].as_str(), run["revolutions"]["input"].as_u64()), (Some("ccw"), Some(4)));
    let (order, amplitude) = strongest(&run["spectra"]["input"]);
    assert!(order == 2.0 && (amplitude / 1e-3 - 1.0).abs() < 2e-3, "{order} {amplitude}");
    let lines = run["spectra"]["mesh"]["lines"].as_array().expect("lines");
    let tooth = &lines[46];
    assert!((tooth["order"].as_f64().expect("an order") - 1.0).abs() < 1e-12);
    assert!((tooth["amplitude_rad"].as_f64().expect("an amplitude") / 1e-4 - 1.0).abs() < 1e-2, "{tooth}");
    // Over the mesh the wave of θ1 has lines of its own near the cut-off: little of it is short.
    let part = |name: &str| run["waves"][name]["fluctuation_rms_rad"].as_f64().expect("a figure") * 2_f64.sqrt();
    assert!((part("long") / 1e-3 - 1.0).abs() < 0.02 && (part("short") / 1e-4 - 1.0).abs() < 0.03, "{}", run["waves"]);
    let floor = &run["floor"];
    let of = |name: &str| floor[name].as_f64().expect("a figure");
    // Counts of 2^26 a turn are all the scatter there is.
    assert!(of("lower_rms_rad") <= of("floor_rms_rad") && of("floor_rms_rad") <= of("upper_rms_rad"));
    assert!(of("upper_rms_rad") < 1e-7);
    assert_eq!(found["table"]["order"].as_array().map(Vec::len), Some(3 * 180));
}

#[test]
fn averages_follow_their_shaft_and_every_form_is_delivered() {
    let directory = TempDir::new().expect("a directory");
    let pair = "kind = \"constant\"\nratio = 3.0\n";
    let log = log(directory.path(), pair, 6, |theta1| 4e-5 * (theta1 / 3.0).sin());
    let path = |name: &str| directory.path().join(name).display().to_string();
    let (averages, csv, html) = (path("averages.csv"), path("orders.csv"), path("orders.html"));
    let output = rigd(&["analyse", &log, "--averages", &averages, "--csv", &csv, "--plot", &html]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(text.contains("6 whole revolutions of the input shaft, 2 of the output shaft"), "{text}");
    assert!(text.contains("no mesh spectrum: a pair of kind constant has no teeth"), "{text}");
    assert!(text.contains("parted at input order 10") && text.contains("% in "), "{text}");
    let mut worst: f64 = 0.0;
    let mut reader = csv::Reader::from_path(&averages).expect("a table");
    for row in reader.records().map(|row| row.expect("a row")).filter(|row| &row[2] == "output") {
        let (angle, te): (f64, f64) = (row[4].parse().expect("an angle"), row[5].parse().expect("a value"));
        worst = worst.max((te - 4e-5 * angle.sin()).abs());
    }
    // Half a count of 2^26 a turn, and the bins at the ends of a revolution.
    assert!(worst > 0.0 && worst < 2e-7, "{worst}");
    assert!(std::fs::read_to_string(&csv).expect("a table").starts_with("run,direction,load_nm,speed_rpm,axis,"));
    assert!(std::fs::read_to_string(&html).expect("a page").contains("Orders of the output shaft"));
}

#[test]
fn what_cannot_be_is_refused_with_the_right_form() {
    let directory = TempDir::new().expect("a directory");
    let log = log(directory.path(), ELLIPSE, 1, |_| 0.0);
    for (arguments, text) in [
        (vec!["analyse", "nowhere.mcap"], "nowhere.mcap"),
        (vec!["analyse", &log, "--bins", "3"], "3 bins"),
        (vec!["analyse", &log, "--split", "tooth:1"], "AXIS:ORDER"),
        (vec!["analyse", &log, "--json", "--averages", "-"], "both ask for stdout"),
    ] {
        let output = rigd(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains(text), "{text} in {}", said(&output));
    }
    // One revolution: no floor, but everything else.
    let found = analysed(&[&log]);
    assert!(found["runs"][0]["floor"]["reason"].as_str().is_some_and(|reason| reason.contains("2 are the fewest")));
    let half = analysed(&[&log, "--highest", "9999"]);
    let reason = &half["runs"][0]["spectra"]["input"]["reason"];
    assert!(reason.as_str().is_some_and(|reason| reason.contains("9999") && reason.contains("359")), "{reason}");
}
