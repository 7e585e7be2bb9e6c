//! Each limit from both sides, on the whole program: refused before motion, or stopped during it, and not a hair earlier.

mod support;

use rigd::profile::Profile;
use support::{Ended, Run};

/// A run faster than real time on a profile changed by `edit`.
fn run(edit: impl FnOnce(&mut Profile), arguments: &[&str]) -> Ended {
    let mut profile = Profile::simulated();
    (profile.sequence.settle_s, profile.sequence.load_s, profile.sequence.home_rpm) = (0.4, 0.4, 30.0);
    edit(&mut profile);
    let mut run = Run::through(|home, out| {
        let path = home.join("profile.toml");
        std::fs::write(&path, profile.to_toml()).expect("a file");
        let mut command = support::rigd(home);
        command.args(["run", "--direction", "ccw", "--revs", "2", "--rate", "2kHz", "--json", "--profile"]);
        command.arg(path).arg("--out").arg(out).args(arguments);
        command
    });
    run.wait(60.0)
}

fn check(name: &str, ended: &Ended, code: i32, needle: &str) {
    println!("{name}: exit {:?} {}", ended.code, ended.stderr.lines().last().unwrap_or_default());
    assert_eq!(ended.code, Some(code), "{name}: {}", ended.stderr);
    assert!(ended.stderr.contains(needle), "{name}: no '{needle}' in {}", ended.stderr);
}

#[test]
fn speed() {
    let limit = |profile: &mut Profile| profile.limits.speed_rpm = 40.0;
    check("at the limit", &run(limit, &["--load", "5Nm", "--rpm", "40"]), 0, "");
    check("over it", &run(limit, &["--load", "5Nm", "--rpm", "40.01"]), 2, "limits.speed_rpm");
    // A drive that turns twice as fast as it was told: reduction wrong by two.
    let wrong = |profile: &mut Profile| {
        profile.limits.speed_rpm = 40.0;
        profile.servo.reduction = 40.0;
    };
    check("turns twice as fast", &run(wrong, &["--load", "5Nm", "--rpm", "30"]), 5, "limits.speed_rpm, and a tenth");
}

#[test]
fn load() {
    let limit = |profile: &mut Profile| profile.limits.load_nm = 10.0;
    check("at the limit", &run(limit, &["--load", "10Nm", "--rpm", "30"]), 0, "");
    check("over it", &run(limit, &["--load", "10.01Nm", "--rpm", "30"]), 2, "limits.load_nm");
}

#[test]
fn slip_power() {
    // 10 N·m at 30 rpm are 31.416 W.
    let limit = |watts: f64| move |profile: &mut Profile| profile.limits.slip_power_w = watts;
    check("just enough", &run(limit(31.42), &["--load", "10Nm", "--rpm", "30"]), 0, "");
    check("just too little", &run(limit(31.41), &["--load", "10Nm", "--rpm", "30"]), 2, "limits.slip_power_w");
}

#[test]
fn temperature() {
    let limit = |celsius: f64| move |profile: &mut Profile| profile.limits.brake_temperature_c = celsius;
    let sound = run(limit(80.0), &["--load", "10Nm", "--rpm", "30"]);
    check("the brake's own temperature", &sound, 0, "");
    // The simulated brake stands in a room of 22 °C and warms by a degree or two.
    check("a cooler limit", &run(limit(15.0), &["--load", "10Nm", "--rpm", "30"]), 5, "limits.brake_temperature_c");
}

#[test]
fn te_excursion() {
    let limit = |mrad: f64| move |profile: &mut Profile| profile.limits.te_excursion_mrad = mrad;
    check("noise alone", &run(limit(0.1), &["--load", "10Nm", "--rpm", "30"]), 0, "");
    let tight = run(limit(0.001), &["--load", "10Nm", "--rpm", "30"]);
    check("tighter than noise", &tight, 5, "limits.te_excursion_mrad");
    assert!(tight.stderr.contains("inspect the teeth"), "{}", tight.stderr);
}
