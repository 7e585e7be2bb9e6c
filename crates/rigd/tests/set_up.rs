//! `rigd jog` and `rigd brake`: nothing moves without consent, only while asked, within limits, and off afterwards; by the plant's own
//! record.

mod support;

use std::cell::Cell;
use std::f64::consts::TAU;
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

use nix::sys::signal::Signal;
use rigd::doctor::{self, Consent, Grade};
use rigd::profile::Profile;
use rigd::run::connected_rig::ConnectedRig;
use rigd::run::dialer::Dialer;
use rigd::run::limits::{Exceeded, Limit};
use rigd::run::session;
use rigd::run::set_up::hold_brake;
use rigd::run::stop_reason::StopReason;
use rigd::simulated;
use serde_json::Value;
use support::bench::{Bench, events, in_virtual_time};
use support::{Ended, Run, Sim, rigd, wait_for};

/// A command of set-up with its logs in its own home.
fn start(arguments: &[&str], profile: Option<&Path>) -> Run {
    Run::through(|home, out| {
        let mut command = rigd(home);
        command.args(arguments).args(["--json", "--logs"]).arg(out);
        command.args(profile.into_iter().flat_map(|profile| ["--profile".as_ref(), profile.as_os_str()]));
        command
    })
}

fn answer(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout).expect("one JSON object")
}

/// On a profile of the simulated rig changed by `edit`, faster than real time.
fn with(edit: impl FnOnce(&mut Profile), arguments: &[&str]) -> Ended {
    let mut profile = Profile::simulated();
    edit(&mut profile);
    let directory = tempfile::TempDir::new().expect("a directory");
    let path = directory.path().join("profile.toml");
    std::fs::write(&path, profile.to_toml()).expect("a file");
    start(arguments, Some(&path)).wait(60.0)
}

/// Off and at rest, by the plant's own record, without current in the brake.
fn assert_off(sim: &Sim) {
    std::thread::sleep(Duration::from_millis(300));
    let shafts = sim.shafts();
    let end = shafts.iter().rev().take(20);
    assert!(end.clone().all(|shaft| !shaft.turns() && !shaft.servo_on && shaft.brake_a < 0.01), "{:?}", shafts.last());
}

#[test]
fn nothing_turns_without_consent_or_over_a_limit() {
    let ended = start(&["jog"], None).wait(10.0);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("consent") && ended.stderr.contains("--turn"), "{}", ended.stderr);

    // A limit below the speed of homing is refused with the profile.
    let slow = |profile: &mut Profile| (profile.limits.speed_rpm, profile.sequence.home_rpm) = (5.0, 5.0);
    let turn = |rpm| ["jog", "--turn", "--turns", "0.1", "--rpm", rpm];
    assert_eq!(with(|_| {}, &turn("10")).code, Some(0));
    assert_eq!(with(|_| {}, &turn("10.01")).code, Some(2));
    assert_eq!(with(slow, &turn("5")).code, Some(0));
    let over = with(slow, &turn("5.01"));
    assert!(over.code == Some(2) && over.stderr.contains("limits.speed_rpm"), "{}", over.stderr);
    for wrong in ["0", "1001", "many"] {
        assert_eq!(with(|_| {}, &["jog", "--turn", "--turns", wrong]).code, Some(2), "{wrong}");
    }
}

#[test]
fn it_turns_as_far_as_asked_in_either_sense() {
    for (direction, sign) in [("ccw", 1.0), ("cw", -1.0)] {
        let ended = with(|_| {}, &["jog", "--turn", "--direction", direction, "--turns", "0.5"]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let turned = answer(&ended)["turned_rad"].as_f64().expect("an angle") * sign / TAU;
        // A poll of 0.1 s and the ramp at 3 rpm are a hundredth of a turn.
        assert!((0.5..0.52).contains(&turned), "{direction}: {turned} turns");
    }
    // Or for as long.
    let ended = with(|_| {}, &["jog", "--turn", "--rpm", "6", "--seconds", "5"]);
    let turned = answer(&ended)["turned_rad"].as_f64().expect("an angle") / TAU;
    assert!(ended.code == Some(0) && (0.45..0.52).contains(&turned), "{turned} turns in 5 s at 6 rpm");
}

#[test]
fn ctrl_c_ends_the_turning_and_all_is_off() {
    let sim = Sim::start(1);
    let mut run = start(&["jog", "--turn", "--direction", "cw", "--rpm", "6"], Some(&sim.port("profile.toml")));
    wait_for("turning", 20.0, || sim.shafts().last().filter(|shaft| shaft.input_rpm < -5.0).copied());
    assert!(sim.shafts().last().is_some_and(|shaft| shaft.servo_on && shaft.brake_a < 0.01), "without load");
    std::thread::sleep(Duration::from_secs(1));
    run.process.signal(Signal::SIGINT);
    let ended = run.wait(10.0);
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert!(answer(&ended)["turned_rad"].as_f64().expect("an angle") < -0.1);
    assert_off(&sim);
    let fastest = sim.shafts().iter().map(|shaft| shaft.input_rpm.abs()).fold(0.0, f64::max);
    assert!(fastest < 7.5, "never faster than set-up: {fastest} rpm");
    run.assert_whole();
}

#[test]
fn a_jog_under_the_drives_watchdog_stops_when_it_is_killed() {
    let sim = Sim::start(2);
    let mut run = start(&["jog", "--turn", "--rpm", "6"], Some(&sim.port("profile.toml")));
    wait_for("turning", 20.0, || sim.shafts().last().filter(|shaft| shaft.input_rpm > 5.0).copied());
    let since = std::time::SystemTime::now();
    run.process.signal(Signal::SIGKILL);
    run.process.wait(5.0);
    // Lease of 1 s, a ramp of 0.12 s, and the clocks of two processes.
    let took_s = sim.standstill_after(since, 10.0);
    println!("SIGKILL of a jog: the shafts stood {took_s:.2} s after it");
    assert!(took_s < 1.6, "{took_s} s");
}

#[test]
fn without_a_watchdog_it_is_refused_unless_that_is_accepted() {
    let mut sim = Sim::start(3);
    sim.tell("no-watchdog");
    std::thread::sleep(Duration::from_millis(200));
    let profile = sim.port("profile.toml");
    let jog = ["jog", "--turn", "--turns", "0.05"];
    let refused = start(&jog, Some(&profile)).wait(20.0);
    assert_eq!(refused.code, Some(5), "{}", refused.stderr);
    assert!(refused.stderr.contains("P3-04"), "{}", refused.stderr);
    assert!(!sim.shafts().iter().any(|shaft| shaft.servo_on), "never switched on");
    let accepted = start(&[&jog[..], &["--accept-no-watchdog"]].concat(), Some(&profile)).wait(30.0);
    assert_eq!(accepted.code, Some(0), "{}", accepted.stderr);
    assert!(accepted.stderr.contains("ACCEPTED WITHOUT A WATCHDOG"), "{}", accepted.stderr);
    assert_off(&sim);

    // To the doctor alike, who turns nothing without consent.
    for (flag, grade, code) in [(None, "fault", 1), (Some("--accept-no-watchdog"), "warning", 0)] {
        let mut doctor = rigd(sim.directory.path());
        doctor.args(["doctor", "--json", "--profile"]).arg(&profile).args(flag);
        let output = doctor.output().expect("it ends");
        let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let findings = found["findings"].as_array().expect("a list");
        let watchdog = findings.iter().find(|finding| finding["subject"] == "servo watchdog").expect("looked at");
        assert_eq!((&watchdog["grade"], output.status.code()), (&grade.into(), Some(code)), "{found}");
    }
}

#[test]
fn the_doctors_turn_without_a_watchdog_too() {
    for (no_watchdog, turns) in [(false, false), (true, true)] {
        in_virtual_time(async {
            let bench = Bench::new(9);
            bench.world.borrow_mut().take_watchdog_away();
            let fastest = Rc::new(Cell::new(0.0_f64));
            let look = {
                let (bench, fastest) = (bench.clone(), Rc::clone(&fastest));
                tokio::task::spawn_local(async move {
                    loop {
                        fastest.set(fastest.get().max(bench.speed_rpm()));
                        tokio::time::sleep(Duration::from_millis(50)).await;
                    }
                })
            };
            let consent = Consent { turn: true, no_watchdog };
            let report = doctor::examine(&bench.profile, simulated::links_to(&bench.world), consent, &bench.stop).await;
            look.abort();
            let grade = |subject: &str| report.findings.iter().find(|one| one.subject == subject).map(|one| one.grade);
            let watchdog = if no_watchdog { Grade::Warning } else { Grade::Fault };
            assert_eq!(grade("servo watchdog"), Some(watchdog), "{report:?}");
            assert_eq!(fastest.get() > 2.0, turns, "{} rpm", fastest.get());
            let index = turns.then_some(Grade::Good);
            assert_eq!((grade("input index"), grade("standstill")), (index, index), "{report:?}");
            assert!(bench.speed_rpm() < 0.1, "and it stands");
        });
    }
}

#[test]
fn a_shaft_that_turns_too_fast_or_not_at_all_ends_it() {
    // The rig's reduction is 20: told 40, it turns twice as fast; told 2, a tenth as fast.
    let reduction = |reduction| move |profile: &mut Profile| profile.servo.reduction = reduction;
    let fast = with(reduction(40.0), &["jog", "--turn"]);
    assert!(fast.code == Some(5) && fast.stderr.contains("servo.reduction"), "{}", fast.stderr);
    let slow = with(reduction(2.0), &["jog", "--turn", "--rpm", "10"]);
    assert!(slow.code == Some(5) && slow.stderr.contains("blocked"), "{}", slow.stderr);
    // Within its bounds it is left alone.
    assert_eq!(with(reduction(26.0), &["jog", "--turn", "--turns", "0.2"]).code, Some(0));
}

#[test]
fn the_brake_holds_while_asked_and_goes_to_zero() {
    let sim = Sim::start(4);
    let profile = sim.port("profile.toml");
    let mut run = start(&["brake", "5Nm"], Some(&profile));
    // 5 N·m on the rising branch are 0.313 A.
    let holds = || sim.shafts().last().filter(|shaft| (shaft.brake_a - 0.313).abs() < 0.01).copied();
    wait_for("the load", 20.0, holds);
    std::thread::sleep(Duration::from_secs(2));
    assert!(holds().is_some_and(|shaft| !shaft.servo_on), "still there, the motor off");
    run.process.signal(Signal::SIGTERM);
    let ended = run.wait(10.0);
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert_off(&sim);
    assert!(!sim.shafts().iter().any(|shaft| shaft.servo_on), "the motor was never on");
    let log = run.log().expect("a log");
    assert!(events(&log).iter().any(|(_, name, text)| name == "brake" && text.contains("5 N·m")));
    run.assert_whole();
    // By itself after its time.
    let ended = start(&["brake", "5Nm", "--seconds", "1"], Some(&profile)).wait(20.0);
    assert_eq!((ended.code, &answer(&ended)["ended"]), (Some(0), &"done".into()), "{}", ended.stderr);
    assert_off(&sim);
}

#[test]
fn a_brake_torque_over_a_limit_is_refused() {
    let limit = |profile: &mut Profile| profile.limits.load_nm = 10.0;
    assert_eq!(with(limit, &["brake", "10Nm", "--seconds", "1"]).code, Some(0));
    let over = with(limit, &["brake", "10.01Nm"]);
    assert!(over.code == Some(2) && over.stderr.contains("limits.load_nm"), "{}", over.stderr);
    let coil = |profile: &mut Profile| profile.brake.current_limit_a = 0.4;
    let beyond = with(coil, &["brake", "10Nm"]);
    assert!(beyond.code == Some(2) && beyond.stderr.contains("brake.current_limit_a"), "{}", beyond.stderr);
}

/// Holds 10 N·m for `seconds` while another master drives the gear at 30 rpm: 31.4 W, of which 25 W may go on for ever.
fn held_against_a_turning_gear(seconds: f64) -> (Option<StopReason>, f64) {
    in_virtual_time(async {
        let mut bench = Bench::new(12);
        bench.profile.limits.slip_power_w = 25.0;
        let hands = {
            let (bench, links) = (bench.clone(), simulated::links_to(&bench.world));
            tokio::task::spawn_local(async move {
                let mut servo = Dialer::new(bench.profile.clone(), links.again.clone())
                    .servo(links.servo)
                    .await
                    .expect("another master");
                servo.prepare(300.0, 300.0, Duration::from_secs(1)).await.expect("it answers");
                servo.set_enabled(true).await.expect("on");
                servo.set_motor_rpm(30.0 * bench.profile.servo.reduction).await.expect("turns");
                // Feeds the drive's watchdog for as long as the test needs.
                while servo.status().await.is_ok() {
                    tokio::time::sleep(Duration::from_millis(300)).await;
                }
            })
        };
        let work = async |rig: &mut ConnectedRig| hold_brake(rig, 10.0, seconds).await;
        let outcome = session::with_rig(bench.context(0.0), async |rig| session::once(rig, work).await).await;
        hands.abort();
        // The powder takes its time to let go.
        tokio::time::sleep(Duration::from_secs(3)).await;
        (outcome.stop_reason, bench.brake_torque_nm())
    })
}

#[test]
fn the_heat_account_holds_where_somebody_turns_the_gear() {
    // The account of 60 s · 25 W is full after 1500 J / 6.4 W = 234 s.
    let (reason, _) = held_against_a_turning_gear(200.0);
    assert!(reason.is_none(), "{reason:?}");
    let (reason, torque_nm) = held_against_a_turning_gear(300.0);
    assert!(matches!(reason, Some(StopReason::Limit(Exceeded { limit: Limit::BrakeHeat, .. }))), "{reason:?}");
    assert!(torque_nm < 1.0, "and the brake is at zero: {torque_nm} N·m");
}
