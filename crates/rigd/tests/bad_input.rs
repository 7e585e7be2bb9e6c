//! Bad input as a stranger types it: a clear error, exit code 2, and nothing written.

use assert_cmd::Command;
use tempfile::TempDir;

struct Refused {
    directory: TempDir,
}

impl Refused {
    fn new() -> Self {
        Self { directory: TempDir::new().expect("a temporary directory") }
    }

    fn file(&self, name: &str, text: &str) -> String {
        let path = self.directory.path().join(name);
        std::fs::write(&path, text).expect("a file");
        path.display().to_string()
    }

    /// Runs and expects exit code 2, every needle on stderr, no panic, and no log.
    fn expect(&self, arguments: &[&str], needles: &[&str]) {
        let out = self.directory.path().join("runs");
        let output = Command::cargo_bin("rigd")
            .expect("the binary")
            .args(arguments)
            .args(if arguments[0] == "run" { vec!["--out", out.to_str().expect("a path")] } else { vec![] })
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        for needle in needles {
            assert!(said.contains(needle), "{arguments:?}: no '{needle}' in: {said}");
        }
        assert!(!said.contains("panicked"), "{said}");
        assert!(!out.exists(), "{arguments:?} wrote something");
    }
}

#[test]
fn quantities_show_the_right_form() {
    let refused = Refused::new();
    refused.expect(&["run", "--load", "10", "--rpm", "5"], &["no unit", "10Nm"]);
    refused.expect(&["run", "--load", "10kg", "--rpm", "5"], &["'kg'", "10Nm"]);
    refused.expect(&["run", "--load", "10Nm", "--rpm", "5furlongs"], &["furlongs", "5rpm"]);
    refused.expect(&["run", "--load", "10Nm", "--rpm", "5", "--rate", "10"], &["no unit", "10kHz"]);
    refused.expect(&["run", "--load", "15..5Nm:5", "--rpm", "5"], &["5..15Nm:5"]);
    refused.expect(&["run", "--load", "10Nm", "--rpm", "0"], &["> 0"]);
    refused.expect(&["run", "--load", "10Nm", "--rpm", "5", "--revs", "0"], &["0"]);
}

#[test]
fn limits_are_named_with_value_and_key() {
    let refused = Refused::new();
    refused.expect(&["run", "--load", "500Nm", "--rpm", "5"], &["500", "20", "N·m", "limits.load_nm"]);
    refused.expect(&["run", "--load", "10Nm", "--rpm", "1000"], &["1000", "60", "rpm", "limits.speed_rpm"]);
    refused.expect(&["run", "--load", "10Nm", "--rpm", "1e-300"], &["too slow", "0.01 rpm"]);
    refused.expect(&["jog", "--turn", "--rpm", "0.0099"], &["too slow", "0.01 rpm"]);
    refused.expect(&["run", "--load", "20Nm", "--rpm", "60"], &["W", "limits.slip_power_w"]);
    refused.expect(&["run", "--load", "5Nm", "--rpm", "5", "--rate", "5000kHz"], &["5000000", "1 MHz"]);
}

#[test]
fn files_are_named_with_line_or_reason() {
    let refused = Refused::new();
    let run = ["run", "--load", "10Nm", "--rpm", "5"];
    let with = |option: &'static str, value: &str| {
        let mut arguments: Vec<String> = run.iter().map(ToString::to_string).collect();
        arguments.extend([option.to_owned(), value.to_owned()]);
        arguments
    };
    let expect = |arguments: &[String], needles: &[&str]| {
        refused.expect(&arguments.iter().map(String::as_str).collect::<Vec<_>>(), needles);
    };
    expect(&with("--profile", "/nowhere/lab.toml"), &["/nowhere/lab.toml", "No such file", "rigd sim"]);
    expect(&with("--pair", "/nowhere/pair.toml"), &["/nowhere/pair.toml", "No such file"]);
    let not_toml = refused.file("lab.toml", "name = ");
    expect(&with("--profile", &not_toml), &["lab.toml", "line 1"]);
    let unknown_key = refused.file(
        "pair.toml",
        "kind = \"elliptical\"\nmodule_mm = 3.0\nteeth = [47, 47]\neccentricity = 0.3287\ncolour = \"red\"\n",
    );
    expect(&with("--pair", &unknown_key), &["pair.toml", "colour"]);
    expect(&with("--undocumented", "gremlins"), &["gremlins", "encoder2_eccentricity"]);
}

#[test]
fn a_pair_that_does_not_close_names_the_distance_that_closes_it() {
    let refused = Refused::new();
    let pair = refused.file(
        "pair.toml",
        "kind = \"elliptical\"\nmodule_mm = 3.0\nteeth = [47, 47]\neccentricity = 0.3287\npressure_angle_deg = 20.0\ncentre_distance_mm = 150.0\n",
    );
    refused.expect(&["run", "--load", "10Nm", "--rpm", "5", "--pair", &pair], &["150", "144.9997", "0.928"]);
}

#[test]
fn logs_that_are_none() {
    let refused = Refused::new();
    let text = refused.file("notes.mcap", "this is no log");
    for command in ["replay", "info"] {
        refused.expect(&[command, "/nowhere/run.mcap"], &["/nowhere/run.mcap"]);
        refused.expect(&[command, &text], &["notes.mcap", "MCAP"]);
    }
}

#[test]
fn help_lists_the_exit_codes() {
    let output = Command::cargo_bin("rigd").expect("the binary").arg("--help").output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success());
    for code in ["0  done", "2  bad usage", "3  done, but", "4  stopped", "5  stopped"] {
        assert!(said.contains(code), "{said}");
    }
}
