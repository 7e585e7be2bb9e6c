//! `rigd sim` on its pseudo-terminals: what it prints, who may open its ports, and the main job against it, again and again.

mod support;

use std::io::Read as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::time::{Duration, Instant};

use nix::libc::{O_NOCTTY, O_NONBLOCK};
use nix::sys::signal::Signal;
use support::{Run, Sim, rigd};

#[test]
fn prints_a_line_a_device_and_ready_and_cleans_up() {
    let mut sim = Sim::start(1);
    let ports = sim.port("").canonicalize().expect("its directory");
    let at = |name: &str| ports.join(name).display().to_string();
    assert_eq!(
        sim.lines,
        [
            format!("servo {} 38400 8N2 unit 1", at("servo")),
            format!("brake {} 115200 8N1 unit 1", at("brake")),
            format!("counter {} 921600 8N1 unit 0", at("counter")),
            "ready".to_owned(),
        ]
    );
    assert!(sim.ready_s < 10.0, "{} s", sim.ready_s);
    sim.process.signal(Signal::SIGINT);
    assert_eq!(sim.process.wait(5.0).code(), Some(0));
    for name in ["servo", "brake", "counter"] {
        assert!(!sim.port(name).is_symlink(), "{name} is still there");
    }
}

#[test]
fn ends_when_nobody_can_learn_its_ports() {
    let home = tempfile::TempDir::new().expect("a temporary directory");
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let output = rigd(home.path())
        .arg("sim")
        .arg("--pty-dir")
        .arg(home.path().join("ports"))
        .stdout(writer)
        .output()
        .expect("it ends");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("standard output"));
}

#[test]
fn a_master_may_come_and_go() {
    let sim = Sim::start(2);
    for _ in 0..5 {
        let state = sim.servo().state();
        assert_eq!((state.motor_rpm, state.on, state.alarm), (0.0, false, 0));
    }
    // Without a line of Modbus, and without settings of the terminal.
    let mut port = std::fs::OpenOptions::new()
        .read(true)
        .write(true)
        .custom_flags(O_NOCTTY | O_NONBLOCK)
        .open(sim.port("servo"))
        .expect("opens");
    std::io::Write::write_all(&mut port, b"hello\r\n").expect("takes bytes");
    std::thread::sleep(Duration::from_millis(100));
    assert!(
        port.read(&mut [0; 64]).is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock),
        "noise is met with silence"
    );
    drop(port);
    assert_eq!(sim.servo().state().alarm, 0);
}

#[test]
fn the_main_job_runs_against_it_twice_in_a_row() {
    let sim = Sim::start(3);
    for round in 0..2 {
        let begun = Instant::now();
        let mut run = Run::with_profile(&sim.port("profile.toml"), &["--revs", "1", "--direction", "ccw"]);
        let ended = run.wait(60.0);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        assert!(!ended.stderr.contains("watchdog"), "a run in order leaves no alarm behind: {}", ended.stderr);
        let summary: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
        let residual = summary["te"]["ccw"]["residual_rms_rad"].as_f64().expect("a number");
        println!(
            "round {round}: {:.1} s, losses {}, residual {:.2} µrad",
            begun.elapsed().as_secs_f64(),
            summary["losses"],
            residual * 1e6
        );
        assert_eq!(summary["losses"], 0);
        assert!(residual < 5e-6, "{residual}");
        let info = run.assert_whole();
        assert_eq!((info.runs.len(), info.losses_in_file), (1, 0));
    }
}
