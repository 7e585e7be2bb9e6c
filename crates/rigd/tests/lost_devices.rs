//! Devices that are missing, fall silent, are pulled out, or talk nonsense: exit code 5 within seconds, an error that names
//! device, port and what to do, a finalised log, and a rig that stands.

mod support;

use std::path::{Path, PathBuf};
use std::time::Instant;

use nix::sys::signal::Signal;
use rigd::profile::Profile;
use riglog::proto::Phase;
use riglog::{LogReader, Record};
use support::line::{Cable, Fault, SilentPort};
use support::{Ended, Run, ServoState, Sim};

/// Longest time from a fault to the end of the program, s: the limits that notice it, ramp and lease, three devices' time-outs.
const LONGEST_S: f64 = 12.0;

fn set_port(profile: &mut Profile, device: &str, port: &Path) {
    let port = port.display().to_string();
    match device {
        "servo" => profile.servo.port = port,
        "brake" => profile.brake.port = port,
        _ => profile.counter.port = port,
    }
}

/// What every fault must leave: the exit code, an error that says where and what to do, a whole log that tells it too.
fn check(name: &str, run: &Run, ended: &Ended, port: &Path, needles: &[&str]) {
    println!("{name}: exit {:?} after {:.1} s: {}", ended.code, ended.seconds, ended.stderr.trim());
    assert_eq!(ended.code, Some(5), "{name}: {}", ended.stderr);
    assert!(ended.seconds < LONGEST_S, "{name}: {:.1} s", ended.seconds);
    let port = port.display().to_string();
    for needle in needles.iter().chain([&port.as_str()]) {
        assert!(ended.stderr.contains(needle), "{name}: no '{needle}' in: {}", ended.stderr);
    }
    run.assert_whole();
    let told = LogReader::open(run.log().expect("a log"))
        .expect("a readable log")
        .flatten()
        .any(|record| matches!(&record, Record::Event { event, .. } if event.message.contains(&port)));
    assert!(told, "{name}: the log's events do not name {port}");
}

#[test]
fn devices_that_are_missing_or_silent_from_the_start() {
    for device in ["servo", "brake", "counter"] {
        let sim = Sim::start(1);
        let missing = PathBuf::from("/nowhere").join(device);
        let profile = sim.profile(|profile| set_port(profile, device, &missing));
        let mut run = Run::with_profile(&profile, &["--revs", "1"]);
        let ended = run.wait(LONGEST_S);
        check(&format!("{device} missing"), &run, &ended, &missing, &[device, "No such file", "plugged in"]);

        let silent = SilentPort::open();
        let profile = sim.profile(|profile| set_port(profile, device, &silent.path));
        let mut run = Run::with_profile(&profile, &["--revs", "1"]);
        let ended = run.wait(LONGEST_S);
        check(&format!("{device} silent"), &run, &ended, &silent.path, &[device, "check power"]);
        if device != "servo" {
            let state = sim.servo().state();
            assert!(!state.on && state.motor_rpm == 0.0, "{state:?}");
        }
    }
}

/// A run whose `device` hangs on a cable that gets a `fault` while it records.
fn fault_in_the_middle(device: &str, fault: Fault, needles: &[&str]) -> (Ended, ServoState) {
    let sim = Sim::start(2);
    let mut cable = Cable::to(&sim.port(device));
    let profile = sim.profile(|profile| set_port(profile, device, &cable.path));
    let mut run = Run::with_profile(&profile, &["--revs", "20", "--direction", "ccw"]);
    run.await_phase(|phase, _| phase == Phase::Record);
    cable.set(fault);
    let ended = run.wait(2.0 * LONGEST_S);
    cable.pull();
    let state = sim.servo().state();
    println!("{device} {fault:?}: servo {state:?}");
    check(&format!("{device} {fault:?}"), &run, &ended, &cable.path, &[&[device], needles].concat());
    assert!(state.motor_rpm.abs() < 1.0, "{device} {fault:?}: {state:?}");
    (ended, state)
}

#[test]
fn a_servo_that_is_lost_while_it_turns() {
    for (fault, needle) in [
        (Fault::Silent, "did not answer"),
        (Fault::Unplugged, "hung up"),
        (Fault::Noise, "check"),
        (Fault::Chatter, "check"),
    ] {
        let (ended, state) = fault_in_the_middle("servo", fault, &[needle]);
        // Nobody but the drive itself could stop it, and the encoders saw it stand.
        assert!(!state.on, "{fault:?}: {state:?}");
        assert_eq!(state.alarm, wire::asda_b2::ALARM_COMMUNICATION_TIMEOUT, "{fault:?}");
        assert!(ended.stderr.contains("speed 0 was not accepted"), "{}", ended.stderr);
        assert!(ended.stderr.contains("switch the drive off by hand"), "{}", ended.stderr);
    }
}

#[test]
fn a_servo_whose_answers_are_damaged_or_another_units() {
    for fault in [Fault::FlippedBit, Fault::OtherUnit] {
        let (_, state) = fault_in_the_middle("servo", fault, &["check"]);
        // Requests still arrive: it was told to stop and switched off.
        assert!(!state.on, "{fault:?}: {state:?}");
    }
}

#[test]
fn a_brake_that_is_lost_while_the_rig_turns() {
    for (fault, needle) in [(Fault::Silent, "did not answer"), (Fault::Unplugged, "hung up")] {
        let (ended, state) = fault_in_the_middle("brake", fault, &[needle]);
        assert!(!state.on && state.alarm == 0, "{fault:?}: stopped in order: {state:?}");
        assert!(
            ended.stderr.contains("brake was not switched off") && ended.stderr.contains("at its panel"),
            "{}",
            ended.stderr
        );
    }
}

#[test]
fn a_counter_that_is_lost_while_the_rig_turns() {
    let (ended, state) = fault_in_the_middle("counter", Fault::Silent, &["no encoder sample", "cable"]);
    assert!(!state.on && state.alarm == 0, "{state:?}");
    assert!(ended.stderr.contains("standstill could not be confirmed"), "{}", ended.stderr);
    let (_, state) = fault_in_the_middle("counter", Fault::Unplugged, &["check power, cable and plug"]);
    assert!(!state.on && state.alarm == 0, "{state:?}");
}

/// All devices at once: the rig's computer hangs, or its power fails.
fn whole_rig(signal: Signal, needle: &str) {
    let sim = Sim::start(3);
    let profile = sim.profile(|_| {});
    let mut run = Run::with_profile(&profile, &["--revs", "20", "--direction", "ccw"]);
    run.await_phase(|phase, _| phase == Phase::Record);
    let begun = Instant::now();
    sim.process.signal(signal);
    let ended = run.wait(2.0 * LONGEST_S);
    println!("{signal}: {:.1} s", begun.elapsed().as_secs_f64());
    let port = Profile::load(&profile).expect("a profile").servo.port;
    let named = if ended.stderr.contains(&port) { port } else { sim.port("counter").display().to_string() };
    check(signal.as_str(), &run, &ended, Path::new(&named), &[needle, "emergency stop"]);
}

#[test]
fn a_rig_that_falls_silent_as_a_whole() {
    whole_rig(Signal::SIGSTOP, "check power");
    whole_rig(Signal::SIGKILL, "check");
}
