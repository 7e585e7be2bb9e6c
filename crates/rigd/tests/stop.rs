//! The operator's stop in every phase: exit code 4, log finalised, servo off and at rest by the daemon's hand, not the watchdog's.

mod support;

use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use riglog::proto::{Direction, Phase};
use support::{Ended, Run, Sim, rigd, wait_for};

/// Stops a run by `stop` once `reached` holds, and checks what every stop must leave.
fn stopped(
    name: &str,
    seed: u64,
    arguments: &[&str],
    reached: impl FnOnce(&Run),
    stop: impl FnOnce(&Run),
) -> (Ended, riglog::LogInfo) {
    let sim = Sim::start(seed);
    let profile = sim.profile(|_| {});
    let mut run = Run::with_profile(&profile, arguments);
    reached(&run);
    stop(&run);
    let ended = run.wait(15.0);
    let state = sim.servo().state();
    println!("{name}: exit {:?} {:.2} s after the stop, servo {state:?}", ended.code, ended.seconds);
    assert_eq!(ended.code, Some(4), "{name}: {}", ended.stderr);
    assert!(
        ended.stderr.contains("stopped by the operator") && ended.stderr.contains("log is finalised"),
        "{name}: {}",
        ended.stderr
    );
    // The longest way: a poll under way, the ramp from 30 rpm, and the devices' answers.
    assert!(ended.seconds < 6.0, "{name}: {:.2} s", ended.seconds);
    assert!(!state.on && state.alarm == 0, "{name}: {state:?}");
    assert!(state.motor_rpm.abs() < 1.0, "{name}: {state:?}");
    (ended, run.assert_whole())
}

fn interrupt(run: &Run) {
    run.process.signal(Signal::SIGINT);
}

/// Waits for a phase, in a sense where it matters.
fn phase(wanted: Phase, sense: Option<Direction>) -> impl FnOnce(&Run) {
    move |run| {
        run.await_phase(|phase, direction| phase == wanted && sense.is_none_or(|sense| direction == sense as i32));
    }
}

#[test]
fn ctrl_c_while_connecting() {
    let connecting = |run: &Run| {
        wait_for("the log", 10.0, || run.log());
        std::thread::sleep(Duration::from_millis(150));
    };
    let (_, info) = stopped("connecting", 1, &["--revs", "1"], connecting, interrupt);
    assert_eq!(info.samples, 0);
}

#[test]
fn ctrl_c_while_homing_and_approaching() {
    stopped("homing", 2, &["--revs", "1"], phase(Phase::Homing, None), interrupt);
    stopped("approach", 3, &["--revs", "1"], phase(Phase::Approach, Some(Direction::Ccw)), interrupt);
    let (_, info) = stopped("settle", 4, &["--revs", "1"], phase(Phase::Settle, None), interrupt);
    assert_eq!(info.samples, 0, "nothing was recorded yet");
}

#[test]
fn ctrl_c_while_recording_keeps_what_was_recorded() {
    let (ended, info) =
        stopped("record ccw", 5, &["--revs", "20"], phase(Phase::Record, Some(Direction::Ccw)), interrupt);
    assert_eq!(info.runs.len(), 1);
    assert!(info.samples > 500 && info.losses == 0, "{info:?}");
    let summary: serde_json::Value = serde_json::from_str(&ended.stdout).expect("a summary all the same");
    assert_eq!(summary["samples"], info.samples);

    let (_, info) = stopped("record cw", 6, &["--revs", "1"], phase(Phase::Record, Some(Direction::Cw)), interrupt);
    assert_eq!(info.runs.len(), 2);
}

#[test]
fn ctrl_c_while_stopping_is_a_stop_too() {
    let (_, info) =
        stopped("stopping", 7, &["--revs", "1", "--direction", "ccw"], phase(Phase::Stopping, None), interrupt);
    assert!((info.runs[0].revolutions.expect("encoders") - 1.0).abs() < 1e-3, "the run itself was whole");
}

#[test]
fn sigterm_and_rigd_stop_end_a_run_alike() {
    let recording = || phase(Phase::Record, None);
    stopped("SIGTERM", 8, &["--revs", "20"], recording(), |run| run.process.signal(Signal::SIGTERM));
    stopped("SIGHUP", 9, &["--revs", "20"], recording(), |run| run.process.signal(Signal::SIGHUP));
    stopped("rigd stop", 10, &["--revs", "20"], recording(), |run| {
        let output = rigd(run.home()).arg("stop").output().expect("it runs");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(said.contains(&run.process.pid().to_string()), "{said}");
    });
}

#[test]
fn a_second_ctrl_c_skips_the_ramp() {
    let sim = Sim::start(11);
    // A ramp of 4 s from 30 rpm at the driver, 600 rpm of the motor.
    let profile = sim.profile(|profile| profile.servo.decel_ms = 20_000.0);
    let mut run = Run::with_profile(&profile, &["--revs", "20", "--direction", "ccw"]);
    run.await_phase(|phase, _| phase == Phase::Record);
    interrupt(&run);
    run.await_phase(|phase, _| phase == Phase::Stopping);
    let asked = Instant::now();
    interrupt(&run);
    let ended = run.wait(15.0);
    let took = asked.elapsed().as_secs_f64();
    let state = sim.servo().state();
    println!("second Ctrl-C: exit {:?} after {took:.2} s, servo {state:?}", ended.code);
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert!(ended.stderr.contains("ramp was skipped"), "{}", ended.stderr);
    assert!(took < 2.5, "{took} s, as long as the ramp");
    assert!(!state.on && state.alarm == 0, "{state:?}");
    run.assert_whole();
}

#[test]
fn a_run_faster_than_real_time_stops_as_well() {
    let mut run = Run::start(&["--revs", "20000", "--rate", "1kHz"]);
    run.await_phase(|phase, _| phase == Phase::Record);
    interrupt(&run);
    let ended = run.wait(15.0);
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert!(run.assert_whole().samples > 0);
}

#[test]
fn rigd_stop_without_a_run_says_so() {
    let home = tempfile::TempDir::new().expect("a temporary directory");
    let output = rigd(home.path()).arg("stop").output().expect("it runs");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no run"));
}
