//! Two QSB readers in place of the counter box, over pseudo-terminals: the same TE, and what happens when one of them fails.

mod support;

use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use riglog::{LogReader, Record};
use serde_json::Value;
use support::line::{Cable, Fault};
use support::{Run, Sim, rigd};

/// Drift between the emulated readers, ppm.
const DRIFT_PPM: f64 = 40.0;

/// One rig at a time: their clocks are judged by when lines arrive.
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn sim(seed: u64) -> Sim {
    Sim::start_with(seed, &["--qsb", "--qsb-drift", "40", "--qsb-offset", "1.7"])
}

/// A run ccw at 10 rpm.
fn run(profile: &Path, revolutions: &str) -> Run {
    Run::through(|home, out| {
        let mut command = rigd(home);
        command.args(["run", "--load", "10Nm", "--rpm", "10", "--direction", "ccw", "--json", "--revs", revolutions]);
        command.arg("--out").arg(out).arg("--profile").arg(profile);
        command
    })
}

fn summary(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn te_is_the_counter_boxes_within_the_stated_uncertainty_and_the_drift_is_found() {
    let _alone = alone();
    let sim = sim(1);
    let profile = sim.profile_of("qsb.toml", |_| {});
    let check = rigd(sim.directory.path()).args(["profile", "check"]).arg(&profile).output().expect("it runs");
    assert!(check.status.success(), "{check:?}");
    let mut by_box = run(&sim.profile(|_| {}), "2");
    let ended = by_box.wait(90.0);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let expected = summary(&ended.stdout);
    let mut by_readers = run(&profile, "2");
    let ended = by_readers.wait(90.0);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let found = summary(&ended.stdout);

    assert!(expected.get("time_skew").is_none(), "a counter box has one clock");
    let skew = &found["time_skew"];
    let te_uncertainty = skew["te_uncertainty_rad"].as_f64().expect("stated");
    let drift = skew["drift_ppm"][1].as_f64().expect("output") - skew["drift_ppm"][0].as_f64().expect("input");
    let te = |summary: &Value, key: &str| summary["te"]["ccw"][key].as_f64().expect("a number");
    let difference = |key| te(&found, key) - te(&expected, key);
    println!(
        "TE ± {:.0} µrad; mean {:+.1}, peak-to-peak {:+.1} µrad off, residual {:.1} µrad; drift {drift:.1} ppm; losses {}",
        te_uncertainty * 1e6,
        difference("mean_rad") * 1e6,
        difference("pp_rad") * 1e6,
        te(&found, "residual_rms_rad") * 1e6,
        found["losses"]
    );
    // A tick each, a USB frame, and what the fits leave, at 10 rpm and the pair's steepest place.
    assert!((0.5e-3..4e-3).contains(&te_uncertainty), "{te_uncertainty}");
    assert!(difference("mean_rad").abs() < te_uncertainty);
    assert!(difference("pp_rad").abs() < 2.0 * te_uncertainty);
    assert!(te(&found, "residual_rms_rad") < te_uncertainty);
    // The faster clock has the shorter ticks.
    assert!((drift + DRIFT_PPM).abs() < 20.0, "{drift} ppm");
    assert_eq!(found["losses"], 0);

    let info = by_readers.assert_whole();
    let clocks = &info.metadata["rig.clocks"];
    assert!((clocks["te_uncertainty_rad"].parse::<f64>().expect("a number") - te_uncertainty).abs() < 1e-9);
    let said = LogReader::open(by_readers.log().expect("a log"))
        .expect("a readable log")
        .flatten()
        .any(|record| matches!(&record, Record::Event { event, .. } if event.message.contains("have no index")));
    assert!(said, "the log says what the zero is");
}

/// A run whose output reader hangs on a cable that gets a fault while it records.
fn fault_in_the_middle(fault: Fault, needles: &[&str]) {
    let _alone = alone();
    let sim = sim(2);
    let mut cable = Cable::to(&sim.port("output"));
    let port = cable.path.display().to_string();
    let profile = sim.profile_of("qsb.toml", |profile| {
        profile.counter.qsb.as_mut().expect("readers").output_port.clone_from(&port);
    });
    let mut run = run(&profile, "20");
    run.await_phase(|phase, _| phase == riglog::proto::Phase::Record);
    cable.set(fault);
    let ended = run.wait(24.0);
    cable.pull();
    println!("{fault:?}: exit {:?} after {:.1} s: {}", ended.code, ended.seconds, ended.stderr.trim());
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    for needle in needles.iter().chain(&["output reader", &port]) {
        assert!(ended.stderr.contains(needle), "{fault:?}: no '{needle}' in {}", ended.stderr);
    }
    run.assert_whole();
    let state = sim.servo().state();
    assert!(!state.on && state.alarm == 0 && state.motor_rpm.abs() < 1.0, "stopped in order: {state:?}");
}

#[test]
fn one_reader_unplugged_stops_the_rig() {
    fault_in_the_middle(Fault::Unplugged, &["check power, cable and plug"]);
}

#[test]
fn one_reader_silent_stops_the_rig() {
    fault_in_the_middle(Fault::Silent, &["sends nothing", "while the other one does"]);
}

#[test]
fn a_reader_that_lost_its_power_stops_the_rig() {
    let _alone = alone();
    let mut sim = sim(3);
    let profile = sim.profile_of("qsb.toml", |_| {});
    let mut run = run(&profile, "20");
    run.await_phase(|phase, _| phase == riglog::proto::Phase::Record);
    sim.tell("reader input restart");
    let ended = run.wait(24.0);
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    assert!(ended.stderr.contains("input reader: it sends nothing"), "{}", ended.stderr);
    let state = sim.servo().state();
    assert!(!state.on && state.motor_rpm.abs() < 1.0, "{state:?}");
}

#[test]
fn damaged_lines_are_losses_and_no_te() {
    let _alone = alone();
    let sim = sim(4);
    let cable = Cable::to(&sim.port("output"));
    let profile = sim.profile_of("qsb.toml", |profile| {
        profile.counter.qsb.as_mut().expect("readers").output_port = cable.path.display().to_string();
    });
    let mut run = run(&profile, "1");
    run.await_phase(|phase, _| phase == riglog::proto::Phase::Record);
    cable.set(Fault::FlippedBit);
    std::thread::sleep(Duration::from_millis(150));
    cable.set(Fault::None);
    let ended = run.wait(60.0);
    assert_eq!(ended.code, Some(3), "data is missing: {}", ended.stderr);
    let found = summary(&ended.stdout);
    let refused = found["time_skew"]["refused_lines"][1].as_u64().expect("a number");
    let (losses, residual) = (found["losses"].as_u64(), found["te"]["ccw"]["residual_rms_rad"].as_f64());
    println!("{refused} lines refused, {losses:?} samples lost, residual {residual:?} rad");
    assert!(refused > 5 && losses.is_some_and(|losses| losses >= refused));
    assert!(residual.is_some_and(|residual| residual < 4e-3));
}
