//! Questions to the model as a person asks them.

use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

fn rigd(arguments: &[&str]) -> Output {
    Command::cargo_bin("rigd").expect("the binary").arg("model").args(arguments).output().expect("it runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// What stands on stdout after exit code 0.
fn asked(arguments: &[&str]) -> String {
    let output = rigd(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&asked(&[arguments, &["--json"]].concat())).expect("one JSON object and nothing else")
}

fn refused(arguments: &[&str], needles: &[&str]) {
    let output = rigd(arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    assert!(!said.contains("panicked") && output.stdout.is_empty(), "{arguments:?}: {said}");
    for needle in needles {
        assert!(said.contains(needle), "{arguments:?}: no '{needle}' in: {said}");
    }
}

fn column(csv: &str, name: &str) -> Vec<f64> {
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let place = lines.next().expect("names").split(',').position(|one| one == name);
    let place = place.unwrap_or_else(|| panic!("no column {name}"));
    lines.map(|line| line.split(',').nth(place).and_then(|field| field.parse().ok()).expect("a number")).collect()
}

/// The reference tables' set-up: no backlash, e1 and e2 as in the built-in pair.
const REFERENCE: [&str; 2] = ["--set", "backlash_mm=0"];

#[test]
fn te_and_backlash_are_those_of_the_reference_tables() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/reference");
    for (file, eccentricity) in [("te_elliptic_k0.3287.csv", "0.3287"), ("te_circular_k0.csv", "0")] {
        let reference = std::fs::read_to_string(fixtures.join(file)).expect("a reference table");
        let rows = column(&reference, "theta1_rad").len();
        let eccentricity = format!("eccentricity={eccentricity}");
        let points = rows.to_string();
        let setting = [&REFERENCE[..], &["--set", &eccentricity, "--points", &points]].concat();
        let te = asked(&[&["te", "--method", "exact,common_normal,published", "--csv", "-"], &setting[..]].concat());
        let close = |name: &str, ours: &str, tolerance: f64| {
            for (n, (expected, got)) in column(&reference, name).iter().zip(column(&te, ours)).enumerate() {
                assert!((expected - got).abs() < tolerance, "{file} {name} row {n}: {got} for {expected}");
            }
        };
        assert_eq!(column(&te, "theta1_rad").len(), rows);
        close("theta1_rad", "theta1_rad", 1e-9);
        close("theta2_nominal_rad", "theta2_nominal_rad", 1e-9);
        for sense in ["ccw", "cw"] {
            close(&format!("te_{sense}_exact"), &format!("te_{sense}_exact_rad"), 1e-8);
            close(&format!("te_{sense}_common_normal"), &format!("te_{sense}_common_normal_rad"), 1e-10);
            close(&format!("te_{sense}_published"), &format!("te_{sense}_published_rad"), 1e-10);
        }
        let backlash = asked(&[&["backlash", "--csv", "-"], &setting[..]].concat());
        let expected = column(&reference, "backlash_variation_common_normal");
        for (expected, got) in expected.iter().zip(column(&backlash, "backlash_rad")) {
            assert!((expected - got).abs() < 1e-10, "{file}: {got} for {expected}");
        }
    }
}

#[test]
fn every_form_says_the_same() {
    let directory = TempDir::new().expect("a temporary directory");
    let path = |name: &str| directory.path().join(name).display().to_string();
    let (csv, svg, png, html) = (path("te.csv"), path("te.svg"), path("te.png"), path("te.html"));
    let object = json(&["te", "--load", "10Nm", "--csv", &csv, "--plot", &svg]);
    assert_eq!(object["schema"], "rigd.model.te/1");
    let te = &object["figures"][0];
    assert_eq!((&te["method"], &te["direction"]), (&Value::from("common_normal"), &Value::from("ccw")));
    let values = column(&std::fs::read_to_string(&csv).expect("a table"), "te_ccw_rad");
    let listed = object["table"]["te_ccw_rad"].as_array().expect("a column");
    // The reader of JSON rounds in the last bit.
    let same = |(one, other): (&Value, &f64)| (one.as_f64().expect("a number") - other).abs() < 1e-18;
    assert!(listed.len() == values.len() && listed.iter().zip(&values).all(same));
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    assert!((te["te"]["pp_rad"].as_f64().expect("a number") - (high - low)).abs() < 1e-15);
    assert!(std::fs::read_to_string(&svg).expect("a picture").contains("TE ccw"));

    let shown = asked(&["te", "--load", "10Nm", "--plot", &png]);
    let arcsec = format!("{:.1}\"", (high - low).to_degrees() * 3600.0);
    assert!(shown.contains(&arcsec), "{arcsec} in {shown}");
    assert!(std::fs::read(&png).expect("a picture").starts_with(b"\x89PNG"));
    asked(&["backlash", "--plot", &html]);
    let page = std::fs::read_to_string(&html).expect("a page");
    assert!(page.contains("<svg") && page.contains("pointermove") && page.ends_with("</html>\n"));
    assert!(asked(&["te", "--plot", "-"]).starts_with("<svg"));
    assert!(asked(&["backlash", "--csv", "-"]).starts_with("theta1_rad,backlash_rad\n0,"));
}

#[test]
fn methods_agree_as_the_theory_says() {
    let figures = json(&["te", "--method", "common_normal,exact,published,loaded", "--direction", "ccw"]);
    let pp = |n: usize| figures["figures"][n]["te"]["pp_rad"].as_f64().expect("a number");
    assert!((pp(1) / pp(0) - 1.0).abs() < 1e-3, "first order");
    assert!((pp(2) / pp(1) - 1.0).abs() > 0.05, "the printed equations are off");
    assert!((pp(3) / pp(1) - 1.0).abs() < 1e-6, "without load elastic teeth are rigid");
    let start = json(&["te", "--relative-to-start", "--direction", "cw"]);
    assert_eq!(start["table"]["te_cw_rad"][0].as_f64(), Some(0.0));
}

#[test]
fn a_check_says_what_holds_and_what_does_not() {
    let sound = asked(&["check"]);
    assert!(sound.ends_with("no fault\n"), "{sound}");
    insta::assert_snapshot!("check", sound);
    let output = rigd(&["check", "--set", "eccentricity=0.7", "--set", "teeth=[17, 17]"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("FAULT") && text(&output.stderr).contains("undercut"));
    let binding = rigd(&["check", "--set", "backlash_mm=0", "--json"]);
    assert_eq!(binding.status.code(), Some(1));
    let object: Value = serde_json::from_slice(&binding.stdout).expect("JSON");
    assert_eq!(object["ok"], false);
    assert!(text(&binding.stderr).contains("bind"));
    let constant = TempDir::new().expect("a temporary directory");
    let pair = constant.path().join("pair.toml");
    std::fs::write(&pair, "kind = \"constant\"\nratio = 81.0\n").expect("a pair");
    assert!(asked(&["check", pair.to_str().expect("a path")]).contains("no fault"));
}

#[test]
fn phases_stand_beside_the_printed_ones() {
    let equal = ["phases", "--set", "e2_mm=0.05"];
    let shown = asked(&equal);
    // The optimum is at 0 and at 180° alike, so only the others have one text.
    for line in [
        "as documented                    17.189     63.025  214.7\"",
        "published, n even and even      160.000     20.000  439.5\"",
    ] {
        assert!(shown.contains(line), "{shown}");
    }
    let object = json(&equal);
    let degrees = |value: &Value| value["value_rad"].as_f64().expect("a number").to_degrees();
    assert!((degrees(&object["best"]) - 0.0222).abs() < 6e-5);
    assert!((degrees(&object["published"][0]) - 0.1221).abs() < 6e-5);
    assert!((degrees(&object["published"][1]) - 0.0506).abs() < 6e-5);
    let fixed = json(&["phases", "--driver", "fixed", "--driven", "index:47", "--objective", "te_both"]);
    assert!((fixed["best"]["phi1_rad"].as_f64().expect("a number") - 0.3).abs() < 1e-12);
    refused(&["phases", "--driver", "loose"], &["loose", "index:N"]);
}

#[test]
fn sweeps_are_labelled_and_say_where_there_is_no_pair() {
    let csv = asked(&["sweep", "--over", "eccentricity=0.2,0.4", "--over", "e1_mm=0..0.1:0.05", "--csv", "-"]);
    assert_eq!(column(&csv, "e1_mm"), [0.0, 0.05, 0.1, 0.0, 0.05, 0.1]);
    let one = json(&["te", "--set", "eccentricity=0.4", "--set", "e1_mm=0.1", "--direction", "ccw"]);
    let alone = one["figures"][0]["te"]["pp_rad"].as_f64().expect("a number");
    assert!((column(&csv, "te_ccw_pp_rad")[5] - alone).abs() < 1e-12);

    let output = rigd(&["sweep", "--over", "eccentricity=0.3,1.5", "--json"]);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    let object: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(object["table"]["te_ccw_pp_rad"][1], Value::Null);
    assert_eq!(object["faults"][0]["cell"], 1);
    assert!(text(&output.stderr).contains("eccentricity = 1.5"));
    refused(&["sweep", "--over", "colour=1"], &["colour", "e1_mm"]);
    refused(&["sweep", "--over", "e1_mm=3..1:1"], &["FIRST <= LAST"]);
    refused(&["sweep"], &["--over"]);
    // A parameter of another kind of pair is refused before anything is computed.
    refused(&["sweep", "--over", "harmonic_scale=0.5,1"], &["harmonic_scale", "elliptical"]);
}

#[test]
fn tolerances_are_reproducible() {
    let study = ["tolerance", "--sigma", "e1_mm=0.01", "--uniform", "phi1_rad=3.1416", "--pairs", "2000"];
    let with = |seed: &str| json(&[&study[..], &["--seed", seed]].concat());
    let first = with("1");
    assert_eq!(first, with("1"));
    assert_ne!(first["table"], with("2")["table"]);
    let table = &first["table"];
    assert_eq!(table["figure"][0], "te_ccw_pp_rad");
    assert!(table["q5_rad"][0].as_f64() < table["q95_rad"][0].as_f64());
    let shares = |name: &str| table[name][4].as_f64().expect("a share");
    assert!(shares("share_phi1_rad") > shares("share_e1_mm"), "an open phase matters most to the backlash");
    let draws = asked(&[&study[..], &["--draws", "-"]].concat());
    assert_eq!(column(&draws, "backlash_pp_rad").len(), 2000);
    refused(&["tolerance"], &["--sigma"]);
    refused(&["tolerance", "--sigma", "eccentricity=0.1"], &["eccentricity", "design"]);
}

#[test]
fn outlines_are_drawings() {
    let directory = TempDir::new().expect("a temporary directory");
    let path = |name: &str| directory.path().join(name).display().to_string();
    let (dxf, svg) = (path("gears.dxf"), path("gears.svg"));
    asked(&["outline", "--dxf", &dxf, "--svg", &svg, "--points-per-tooth", "40", "--plot", &path("mesh.png")]);
    for gear in [1, 2] {
        let drawing = std::fs::read_to_string(path(&format!("gears-{gear}.dxf"))).expect("a drawing");
        assert_eq!(drawing.matches("VERTEX").count(), 47 * 40);
        assert!(drawing.contains(&format!("GEAR{gear}")) && drawing.trim_end().ends_with("EOF"));
        assert!(std::fs::read_to_string(path(&format!("gears-{gear}.svg"))).expect("a drawing").contains("<svg"));
    }
    assert!(!Path::new(&dxf).exists());
    assert!(asked(&["outline", "--gear", "2", "--dxf", "-"]).starts_with("0\nSECTION"));
    refused(&["outline", "--dxf", "-"], &["--gear 1"]);
    refused(&["outline", "--theta1", "30"], &["no unit", "30deg"]);
    refused(&["outline", "--set", "teeth=[17, 17]", "--set", "eccentricity=0.7"], &["undercut", "theta1"]);
}

#[test]
fn bad_questions_are_refused_with_the_right_form() {
    refused(&["te", "/nowhere/pair.toml"], &["/nowhere/pair.toml", "No such file"]);
    refused(&["te", "--set", "eccentricity"], &["KEY=VALUE"]);
    refused(&["te", "--set", "colour=red"], &["colour"]);
    refused(&["te", "--set", "centre_distance_mm=150"], &["150", "144.9997", "0.928"]);
    refused(&["te", "--load", "10"], &["no unit", "10Nm"]);
    refused(&["te", "--method", "published", "--load", "10Nm"], &["published", "load"]);
    refused(&["te", "--points", "0"], &["--points 0", "4 to"]);
    refused(&["te", "--plot", "te.jpg"], &["jpg", ".svg, .png or .html"]);
    refused(&["te", "--csv", "-", "--json"], &["--json and --csv", "stdout"]);
    refused(&["te", "--method", "guess"], &["guess", "common_normal"]);
    if !cfg!(feature = "parquet") {
        refused(&["te", "--parquet", "te.parquet"], &["--features parquet"]);
    }
    let output = rigd(&["te", "--csv", "/nowhere/te.csv"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("/nowhere/te.csv"));
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_holds_the_columns() {
    let directory = TempDir::new().expect("a temporary directory");
    let path = directory.path().join("te.parquet");
    asked(&["tolerance", "--sigma", "e1_mm=0.01", "--pairs", "100", "--parquet", path.to_str().expect("a path")]);
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    let reader = SerializedFileReader::new(std::fs::File::open(&path).expect("a file")).expect("Parquet");
    assert_eq!(reader.metadata().file_metadata().num_rows(), 5);
    assert_eq!(reader.metadata().file_metadata().schema().get_fields()[0].name(), "figure");
}
