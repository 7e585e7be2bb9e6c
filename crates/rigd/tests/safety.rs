//! The shaft stands still within lease and ramp, by the plant's own record, with the rig in a process of its own: SIGKILL, SIGSTOP,
//! each device unplugged or silent, a full disk, and a clock that jumps.

mod support;

use std::path::Path;
use std::process::Command;
use std::time::{Duration, SystemTime};

use nix::sys::signal::Signal;
use rigd::profile::Profile;
use riglog::proto::Phase;
use riglog::{LogReader, Record};
use support::bench::events;
use support::line::{Cable, Fault};
use support::{Run, Sim, rigd};

/// Coupling and gears ring out, and the plant's clock and ours are read at different moments.
const MARGIN_S: f64 = 0.4;

/// The lease as the drive's watchdog counts it, whole seconds, and the ramp from 30 rpm; half a second more where the daemon has to
/// notice silence first.
fn limit_s(profile: &Path, notice_s: f64) -> f64 {
    let profile = Profile::load(profile).expect("a profile");
    let ramp_s = 30.0 * profile.servo.reduction / 3000.0 * profile.servo.decel_ms * 1e-3;
    profile.sequence.lease_s.ceil() + ramp_s + notice_s + MARGIN_S
}

fn recording(sim: &Sim, profile: &Path) -> Run {
    let run = Run::with_profile(profile, &["--revs", "50", "--direction", "ccw"]);
    run.await_phase(|phase, _| phase == Phase::Record);
    assert!(sim.shafts().last().is_some_and(|shaft| shaft.servo_on && shaft.input_rpm > 25.0));
    run
}

fn stands(name: &str, sim: &Sim, since: SystemTime, limit_s: f64) {
    let took_s = sim.standstill_after(since, 30.0);
    println!("{name}: the shafts stood {took_s:.2} s after it, limit {limit_s:.2} s");
    assert!(took_s <= limit_s, "{name}: {took_s} s");
}

/// The daemon gets a signal that it cannot handle.
fn struck(signal: Signal) {
    let sim = Sim::start(1);
    let profile = sim.profile(|_| {});
    let mut run = recording(&sim, &profile);
    let since = SystemTime::now();
    run.process.signal(signal);
    stands(signal.as_str(), &sim, since, limit_s(&profile, 0.0));
    assert!(sim.shafts().last().is_some_and(|shaft| !shaft.servo_on), "{signal}: servo off by its watchdog");
    if signal == Signal::SIGSTOP {
        // Thawed, it finds its lease run out, and does not take up what it was doing.
        run.process.signal(Signal::SIGCONT);
        let ended = run.wait(20.0);
        assert_eq!(ended.code, Some(5), "{}", ended.stderr);
        assert!(ended.stderr.contains("lease") || ended.stderr.contains("0x0020"), "{}", ended.stderr);
        assert!(!sim.shafts().iter().rev().take(100).any(|shaft| shaft.turns()));
        run.assert_whole();
    }
}

#[test]
fn a_killed_daemon() {
    struck(Signal::SIGKILL);
}

#[test]
fn a_frozen_daemon() {
    struck(Signal::SIGSTOP);
}

/// A device whose plug is pulled, and one that falls silent.
fn lost(device: &str) {
    for fault in [Fault::Unplugged, Fault::Silent] {
        let sim = Sim::start(2);
        let mut cable = Cable::to(&sim.port(device));
        let profile = sim.profile(|profile| {
            let port = cable.path.display().to_string();
            match device {
                "servo" => profile.servo.port = port,
                "brake" => profile.brake.port = port,
                _ => profile.counter.port = port,
            }
        });
        let mut run = recording(&sim, &profile);
        let since = SystemTime::now();
        cable.set(fault);
        // A silent brake is asked three times before it counts as lost.
        let notice_s = if fault == Fault::Silent { 1.5 } else { 0.0 };
        stands(&format!("{device} {fault:?}"), &sim, since, limit_s(&profile, notice_s));
        assert_eq!(run.wait(30.0).code, Some(5));
        assert!(sim.shafts().last().is_some_and(|shaft| !shaft.servo_on), "{device} {fault:?}: servo off");
        cable.pull();
    }
}

#[test]
fn a_lost_servo() {
    lost("servo");
}

#[test]
fn a_lost_brake() {
    lost("brake");
}

#[test]
fn a_lost_counter() {
    lost("counter");
}

#[test]
fn the_emergency_stop() {
    let mut sim = Sim::start(5);
    let profile = sim.profile(|_| {});
    let mut run = recording(&sim, &profile);
    let since = SystemTime::now();
    sim.tell("estop press");
    // The drive takes the torque away by itself: no lease and no ramp.
    stands("emergency stop", &sim, since, MARGIN_S);
    let ended = run.wait(20.0);
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    assert!(
        ended.stderr.contains("emergency stop was pressed") && ended.stderr.contains("release"),
        "{}",
        ended.stderr
    );
    run.assert_whole();
    // Pressed, nothing starts; released, the next run does.
    let refused = Run::with_profile(&profile, &["--revs", "1", "--direction", "ccw"]).wait(20.0);
    assert_eq!(refused.code, Some(5), "{}", refused.stderr);
    assert!(!sim.shafts().iter().rev().take(200).any(|shaft| shaft.servo_on));
    sim.tell("estop release");
    std::thread::sleep(Duration::from_millis(200));
    let next = Run::with_profile(&profile, &["--revs", "1", "--direction", "ccw"]).wait(60.0);
    assert_eq!(next.code, Some(0), "{}", next.stderr);
}

#[test]
fn a_load_that_runs_over_its_limit_while_the_shaft_turns() {
    let mut sim = Sim::start(7);
    // Supervised at 11 N·m, a tenth over what set-points are refused by.
    let profile = sim.profile(|profile| profile.limits.load_nm = 10.0);
    let mut run = recording(&sim, &profile);
    // 0.482 A make 10 N·m; 4 % more are 10.6 N·m.
    sim.tell("overcurrent 1.04");
    std::thread::sleep(Duration::from_secs(2));
    assert!(!run.process.ended(), "under the limit it goes on");
    sim.tell("overcurrent 1.3");
    let ended = run.wait(20.0);
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    assert!(ended.stderr.contains("load") && ended.stderr.contains("limits.load_nm, and a tenth"), "{}", ended.stderr);
    let said = events(&run.log().expect("a log"));
    assert!(said.iter().any(|(_, name, text)| name == "halt" && text.contains("limits.load_nm")), "{said:?}");
    run.assert_whole();
    // The order of the stop: the load stays on the shaft until it stands, then brake to 0, then servo off.
    std::thread::sleep(Duration::from_millis(300));
    let shafts = sim.shafts();
    // Shafts that are wound up by the load spring back when it is let go: less than a thirtieth of the speed.
    let last_turning = shafts.iter().rposition(|shaft| shaft.input_rpm.abs() > 1.0).expect("it turned");
    let brake_off = shafts.iter().rposition(|shaft| shaft.brake_a > 0.05).expect("it was loaded");
    let servo_off = shafts.iter().rposition(|shaft| shaft.servo_on).expect("it was on");
    let at = |index: usize| shafts[index].unix_s - shafts[last_turning].unix_s;
    println!("over its load: brake off {:.2} s, servo off {:.2} s after standstill", at(brake_off), at(servo_off));
    assert!(last_turning < brake_off && brake_off < servo_off && servo_off + 1 < shafts.len());
}

#[test]
fn a_drive_without_a_watchdog() {
    let mut sim = Sim::start(6);
    sim.tell("no-watchdog");
    let profile = sim.profile(|_| {});
    std::thread::sleep(Duration::from_millis(200));
    let refused = Run::with_profile(&profile, &["--revs", "1", "--direction", "ccw"]).wait(20.0);
    assert_eq!(refused.code, Some(5), "{}", refused.stderr);
    assert!(refused.stderr.contains("P3-04") && refused.stderr.contains("watchdog"), "{}", refused.stderr);
    assert!(!sim.shafts().iter().any(|shaft| shaft.servo_on), "it was never switched on");
    let accepted = ["--revs", "1", "--direction", "ccw", "--accept-no-watchdog"];
    let accepted = Run::with_profile(&profile, &accepted).wait(60.0);
    assert_eq!(accepted.code, Some(0), "{}", accepted.stderr);
    assert!(accepted.stderr.contains("ACCEPTED WITHOUT A WATCHDOG"), "{}", accepted.stderr);
}

#[test]
fn a_full_disk() {
    let sim = Sim::start(3);
    let profile = sim.profile(|_| {});
    let mut run = Run::through(|home, out| {
        let mut command = Command::new("bash");
        let limited = "ulimit -f 256; exec \"$@\"";
        command.env("XDG_RUNTIME_DIR", home).args(["-c", limited, "bash", env!("CARGO_BIN_EXE_rigd")]);
        command.args("run --load 10Nm --rpm 30 --revs 100 --direction ccw --rate 18kHz --json --profile".split(' '));
        command.arg(&profile).arg("--out").arg(out);
        command
    });
    let ended = run.wait(60.0);
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    // The last sample that found room.
    let last_ns = LogReader::open(run.log().expect("a log"))
        .expect("readable")
        .flatten()
        .filter_map(|record| if let Record::Angles { log_time_ns, .. } = record { Some(log_time_ns) } else { None })
        .last()
        .expect("samples");
    let full = SystemTime::UNIX_EPOCH + Duration::from_nanos(last_ns);
    stands("full disk", &sim, full, limit_s(&profile, 0.25));
}

/// Shifts the wall clock of one process by what a file says, s.
const SHIFTED_CLOCK: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
int clock_gettime(clockid_t clock, struct timespec *now) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int answer = real(clock, now);
    if (answer == 0 && clock == CLOCK_REALTIME) {
        FILE *file = fopen(getenv("CLOCK_SHIFT"), "r");
        long shift = 0;
        if (file) { if (fscanf(file, "%ld", &shift) != 1) shift = 0; fclose(file); }
        now->tv_sec += shift;
    }
    return answer;
}
"#;

#[test]
fn a_clock_that_jumps() {
    let sim = Sim::start(4);
    let profile = sim.profile(|_| {});
    let at = |name: &str| sim.directory.path().join(name);
    std::fs::write(at("shift.c"), SHIFTED_CLOCK).expect("a file");
    let library = at("shift.so");
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-o"]).arg(&library).arg(at("shift.c")).arg("-ldl");
    assert!(compiler.status().expect("a C compiler, which Rust needs to link").success());
    // The shim shifts the clock that the daemon's own library reads.
    let date = |shift: &str| {
        std::fs::write(at("probe"), shift).expect("a file");
        let output =
            Command::new("date").arg("+%s").env("LD_PRELOAD", &library).env("CLOCK_SHIFT", at("probe")).output();
        String::from_utf8_lossy(&output.expect("it runs").stdout).trim().parse::<i64>().expect("seconds")
    };
    assert!(date("7200") - date("0") > 7000, "the shim works");

    let mut run = Run::through(|home, out| {
        let mut command = rigd(home);
        command.env("LD_PRELOAD", &library).env("CLOCK_SHIFT", at("shift"));
        command.args("run --load 10Nm --rpm 30 --revs 4 --direction ccw --json --profile".split(' '));
        command.arg(&profile).arg("--out").arg(out);
        command
    });
    run.await_phase(|phase, _| phase == Phase::Record);
    for shift in ["7200", "-7200", "0"] {
        std::fs::write(at("shift"), shift).expect("a file");
        std::thread::sleep(Duration::from_millis(1200));
    }
    let ended = run.wait(60.0);
    assert_eq!(ended.code, Some(0), "a jump of the wall clock changes nothing: {}", ended.stderr);
    let info = run.assert_whole();
    assert_eq!(info.losses_in_file, 0);
    let mut last = 0;
    for record in LogReader::open(run.log().expect("a log")).expect("readable").flatten() {
        if let Record::Angles { log_time_ns, .. } = record {
            assert!(log_time_ns >= last && (last == 0 || log_time_ns - last < 1_000_000_000), "time in the log jumped");
            last = log_time_ns;
        }
    }
    assert!(sim.shafts().last().is_some_and(|shaft| !shaft.turns() && !shaft.servo_on));
    println!("clock jumps of ±2 h: run complete, log time without a jump, shafts at rest");
}
