//! `rigd profile` and `rigd doctor` as a person and a script use them.

mod support;

use assert_cmd::Command;
use support::{Sim, rigd};
use tempfile::TempDir;

fn command() -> Command {
    Command::new(env!("CARGO_BIN_EXE_rigd"))
}

fn json(output: &[u8]) -> serde_json::Value {
    serde_json::from_slice(output).expect("one JSON object")
}

#[test]
fn a_new_profile_is_asked_for_its_ports_and_is_good() {
    let directory = TempDir::new().expect("a directory");
    let file = directory.path().join("lab.toml");
    let refused = command().args(["profile", "new"]).arg(&file).assert().code(2);
    let said = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(said.contains("--servo-port") && said.contains("nothing was written") && !file.exists(), "{said}");

    let ports = ["--servo-port", "/dev/a", "--brake-port", "/dev/b", "--counter-port", "/dev/c"];
    let write = || {
        let mut command = command();
        command.args(["profile", "new"]).arg(&file).args(ports).args(["--servo", "dsy-rs", "--max-rpm", "20"]);
        command
    };
    write().assert().success();
    let text = std::fs::read_to_string(&file).expect("written");
    assert!(text.contains("dsy-rs") && text.contains("/dev/b") && text.contains("speed_rpm = 20"), "{text}");
    command().args(["profile", "check"]).arg(&file).assert().success();
    // One that exists is left alone.
    write().assert().code(2);
    assert_eq!(std::fs::read_to_string(&file).expect("still there"), text);
}

#[test]
fn every_fault_has_file_and_line_and_the_exit_code_is_bad_input() {
    let directory = TempDir::new().expect("a directory");
    let file = directory.path().join("lab.toml");
    let text = rigd::profile::SIM_PROFILE
        .replace("lease_s = 1.0", "leese_s = 1.0")
        .replace("chunk_ms = 100", "chunk_ms = 5000")
        .replace("counter-box", "briter-rs485");
    std::fs::write(&file, &text).expect("a file");
    let output = command().args(["profile", "check", "--json"]).arg(&file).assert().code(2).get_output().stdout.clone();
    let found = json(&output);
    let faults = found["faults"].as_array().expect("a list");
    let of = |key: &str| faults.iter().find(|fault| fault["key"] == key).unwrap_or_else(|| panic!("{key}: {found}"));
    for (key, part) in [("sequence.leese_s", "leese_s"), ("log.chunk_ms", "chunk_ms"), ("counter.driver", "briter")] {
        let line = of(key)["line"].as_u64().expect("a line") as usize;
        assert!(text.lines().nth(line - 1).expect("there").contains(part), "{key}: {line}");
    }
    assert!(
        of("counter.driver")["what"].as_str().expect("text").contains("resol")
            || of("counter.driver")["what"].as_str().expect("text").contains("µrad")
    );
    // A run tells them all as well.
    let out = directory.path().join("runs");
    let run =
        command().args(["run", "--load", "5Nm", "--rpm", "5", "--profile"]).arg(&file).arg("--out").arg(&out).assert();
    let said = String::from_utf8_lossy(&run.code(2).get_output().stderr).into_owned();
    assert!(["leese_s", "log.chunk_ms", "counter.driver"].iter().all(|key| said.contains(key)), "{said}");
    assert!(!out.exists(), "nothing was written");
    let plain = command().args(["profile", "check"]).arg(&file).assert().code(2);
    let said = String::from_utf8_lossy(&plain.get_output().stderr).into_owned();
    assert!(said.contains(&format!("{}:", file.display())), "{said}");
}

#[test]
fn how_late_an_answer_may_come_and_who_shares_a_line_is_checked() {
    let directory = TempDir::new().expect("a directory");
    let file = directory.path().join("lab.toml");
    let check = |text: String| {
        std::fs::write(&file, text).expect("a file");
        let output = command().args(["profile", "check"]).arg(&file).output().expect("it runs");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let with =
        |keys: &str| rigd::profile::SIM_PROFILE.replace("reduction = 20.0", &format!("reduction = 20.0\n{keys}\n"));
    for (keys, good) in [
        ("late_ms = 10.0\nrepeated_ms = 10.0", true),
        ("late_ms = 9.9\nrepeated_ms = 0.0", false),
        ("late_ms = 5000.0", true),
        ("late_ms = 5001.0", false),
        ("late_ms = 300.0\nrepeated_ms = 301.0", false),
    ] {
        let (code, said) = check(with(keys));
        assert_eq!(code, Some(if good { 0 } else { 2 }), "{keys}: {said}");
        assert!(good || said.contains("_ms"), "{keys}: {said}");
    }
    // Servo and brake on one RS-485 line.
    let mut profile = rigd::profile::Profile::simulated();
    (profile.servo.port, profile.brake.port) = ("/dev/ttyUSB0".into(), "/dev/ttyUSB0".into());
    profile.counter.port = "/dev/ttyUSB1".into();
    let (code, said) = check(profile.to_toml());
    assert!(code == Some(2) && said.contains("is also the servo's") && said.contains("a line of its own"), "{said}");
    let run = command().args(["run", "--load", "5Nm", "--rpm", "5", "--profile"]).arg(&file).assert().code(2);
    let said = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
    assert!(said.contains("brake.port") && said.contains("a line of its own"), "{said}");
}

#[test]
fn a_register_map_of_ones_own_drives_the_simulated_drive() {
    let sim = Sim::start(7);
    let map = sim.directory.path().join("drive.toml");
    let (_, text) = rigd::device::map::BUILT_IN[0];
    std::fs::write(&map, text.replace("title = \"Delta ASDA-B2\"", "title = \"our own drive\"")).expect("a file");
    command().args(["profile", "check"]).arg(&map).assert().success();
    let profile = sim.profile(|profile| {
        profile.servo.driver = "map".into();
        profile.servo.map = Some(map.clone());
    });
    let output =
        rigd(sim.directory.path()).args(["doctor", "--json", "--profile"]).arg(&profile).output().expect("ends");
    let found = json(&output.stdout);
    assert_eq!((output.status.code(), &found["faults"]), (Some(0), &serde_json::json!(0)), "{found}");
    assert!(found.to_string().contains("our own drive"), "{found}");

    // A map with a fault is told, with its own line, before anything moves.
    std::fs::write(&map, text.replace("speed_set = \"speed_1\"", "speed_set = \"speed_9\"")).expect("a file");
    let said = command().args(["profile", "check"]).arg(&profile).assert().code(2).get_output().stderr.clone();
    assert!(String::from_utf8_lossy(&said).contains("speed_9"), "{}", String::from_utf8_lossy(&said));
}

#[test]
fn the_doctor_finds_the_simulated_rig_well_and_a_wrong_sense_with_what_to_do() {
    let output = command().args(["doctor", "--json", "--turn"]).assert().success().get_output().stdout.clone();
    let found = json(&output);
    assert_eq!((&found["faults"], &found["warnings"]), (&serde_json::json!(0), &serde_json::json!(0)), "{found}");
    for subject in ["servo watchdog", "input index", "output index", "standstill", "encoder resolution"] {
        let findings = found["findings"].as_array().expect("a list");
        assert!(findings.iter().any(|finding| finding["subject"] == subject), "{subject}: {found}");
    }

    let directory = TempDir::new().expect("a directory");
    let file = directory.path().join("wrong.toml");
    let text = rigd::profile::SIM_PROFILE.replace("output_sign = 1", "output_sign = -1");
    std::fs::write(&file, text).expect("a file");
    let output =
        command().args(["doctor", "--turn", "--profile"]).arg(&file).assert().code(1).get_output().stdout.clone();
    let said = String::from_utf8_lossy(&output).into_owned();
    assert!(said.contains("FAULT    output encoder") && said.contains("set counter.output_sign = 1"), "{said}");
    assert!(said.contains("ok       standstill"), "{said}");
}

#[test]
fn without_consent_nothing_moves() {
    let sim = Sim::start(8);
    let output =
        rigd(sim.directory.path()).args(["doctor", "--profile"]).arg(sim.port("profile.toml")).output().expect("ends");
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).contains("--turn"));
    let state = sim.servo().state();
    assert_eq!((state.motor_rpm, state.on, state.alarm), (0.0, false, 0));
}
