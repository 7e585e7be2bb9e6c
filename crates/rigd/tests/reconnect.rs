//! A replug of each device, over terminals and in real time: back within 2 s, the gap told, the run done again.

mod support;

use std::os::unix::fs::symlink;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use riglog::proto::Phase;
use support::bench::{events, replayed};
use support::line::Cable;
use support::{Run, Sim};

fn replugged(device: &str, seed: u64) {
    let sim = Sim::start(seed);
    // As udev's by-id names: the same name leads to whatever terminal the plug has got.
    let plug = sim.directory.path().join("plug");
    let mut cable = Cable::to(&sim.port(device));
    symlink(&cable.path, &plug).expect("a link");
    let profile = sim.profile(|profile| {
        let port = plug.display().to_string();
        match device {
            "servo" => profile.servo.port = port,
            "brake" => profile.brake.port = port,
            _ => profile.counter.port = port,
        }
    });
    let mut run = Run::with_profile(&profile, &["--revs", "3", "--direction", "ccw", "--reconnect", "60"]);
    run.await_phase(|phase, _| phase == Phase::Record);
    std::fs::remove_file(&plug).expect("the link");
    cable.pull();
    std::thread::sleep(Duration::from_secs(4));
    assert!(sim.shafts().iter().rev().take(50).all(|shaft| !shaft.turns()), "{device}: it stands while it waits");
    let cable = Cable::to(&sim.port(device));
    symlink(&cable.path, &plug).expect("a link");
    let put_in = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_nanos() as f64;
    let ended = run.wait(60.0);

    let log = run.log().expect("a log");
    let events = events(&log);
    let (back_ns, _, _) = events.iter().find(|(_, name, _)| name == "reconnect").expect("it came back");
    let took_s = (*back_ns as f64 - put_in) * 1e-9;
    println!("{device}: back {took_s:.2} s after the replug; {}", ended.stderr.lines().last().unwrap_or_default());
    assert!(took_s <= 2.0, "{device}: {took_s} s");
    assert!(events.iter().any(|(_, name, text)| name == "gap" && text.contains(device)));
    assert!(events.iter().any(|(_, name, _)| name == "index check"));
    run.assert_whole();
    let (analysis, found) = replayed(&log);
    let again = analysis.runs().last().expect("a run");
    assert_eq!((again.te.revolutions(), again.losses), (3, 0), "{device}: the run was done again as a whole");
    // What the encoders did not send is lost, and the exit code says so; nothing else is.
    assert_eq!((found.losses > 0, ended.code), if device == "counter" { (true, Some(3)) } else { (false, Some(0)) });
}

#[test]
fn the_servo() {
    replugged("servo", 1);
}

#[test]
fn the_brake() {
    replugged("brake", 2);
}

#[test]
fn the_counter() {
    replugged("counter", 3);
}
