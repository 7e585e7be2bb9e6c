//! A disk that fills up, and a process at its file size limit: exit code 5, an error that names the log and what to do, the
//! servo stopped, and a log that reads up to where the room ended.

mod support;

use std::path::Path;
use std::process::Command;

use support::{Ended, Run, Sim, python_counts, rigd};

/// Room for some five seconds of log, KiB.
const ROOM_KIB: u32 = 256;

/// The run's arguments: long enough to fill the room many times over.
fn arguments(profile: &Path) -> Vec<String> {
    let mut arguments: Vec<_> = "run --load 10Nm --rpm 30 --revs 100 --direction ccw --rate 18kHz --json --profile"
        .split(' ')
        .map(str::to_owned)
        .collect();
    arguments.push(profile.display().to_string());
    arguments
}

fn check(name: &str, sim: &Sim, run: &Run, ended: &Ended, needles: &[&str]) {
    println!("{name}: exit {:?} after {:.1} s: {}", ended.code, ended.seconds, ended.stderr.trim());
    let state = sim.servo().state();
    assert_eq!(ended.code, Some(5), "{name}: {}", ended.stderr);
    let log = run.log().expect("a log");
    for needle in needles.iter().chain([&log.to_str().expect("a path")]) {
        assert!(ended.stderr.contains(needle), "{name}: no '{needle}' in: {}", ended.stderr);
    }
    assert!(!state.on && state.motor_rpm.abs() < 1.0 && state.alarm == 0, "{name}: {state:?}");
    let info = riglog::info(&log).expect("a readable log");
    println!("{name}: {} samples in {} bytes, {}", info.samples_in_file, info.bytes, info.completeness);
    assert!(info.samples_in_file > 10_000 && info.losses_in_file == 0, "{info:?}");
    let messages: u64 = info.channels.iter().map(|channel| channel.messages).sum();
    if let Some(counts) = python_counts("stream", std::slice::from_ref(&log)) {
        assert_eq!(counts, [messages]);
    }
    if info.completeness.is_complete()
        && let Some(counts) = python_counts("whole", &[log])
    {
        assert_eq!(counts, [messages]);
    }
}

#[test]
fn a_file_size_limit_stops_the_rig_in_order() {
    let sim = Sim::start(1);
    let profile = sim.profile(|_| {});
    let mut run = Run::through(|home, out| {
        // The signal that comes with the limit is left as it is: the daemon must outlive it by itself.
        let mut command = Command::new("bash");
        let limited = format!("ulimit -f {ROOM_KIB}; exec \"$@\"");
        command.env("XDG_RUNTIME_DIR", home).args(["-c", &limited, "bash", env!("CARGO_BIN_EXE_rigd")]);
        command.args(arguments(&profile)).arg("--out").arg(out);
        command
    });
    let ended = run.wait(60.0);
    check("file size limit", &sim, &run, &ended, &["File too large", "ulimit"]);
}

/// A small file system of its own; gone when dropped.
struct SmallDisk<'a>(&'a Path);

impl<'a> SmallDisk<'a> {
    fn mount(at: &'a Path, room_kib: u32) -> Option<Self> {
        std::fs::create_dir_all(at).expect("a directory");
        let size = format!("size={room_kib}k");
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(at).status();
        mounted.is_ok_and(|status| status.success()).then_some(Self(at))
    }
}

impl Drop for SmallDisk<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("--lazy").arg(self.0).status();
    }
}

#[test]
fn a_full_disk_stops_the_rig_in_order() {
    let directory = tempfile::TempDir::new().expect("a temporary directory");
    let at = directory.path().join("small");
    let Some(disk) = SmallDisk::mount(&at, ROOM_KIB) else {
        println!("skipped: this user may not mount a tmpfs; the test of the file size limit stands in");
        return;
    };
    let sim = Sim::start(2);
    // Without the watch, which would not let a run begin here.
    let profile = sim.profile(|profile| profile.log.stop_free_mb = 0.0);
    let mut run = Run::through(|home, _| {
        let mut command = rigd(home);
        command.args(arguments(&profile)).arg("--out").arg(&at);
        command
    });
    run.out = at.clone();
    let ended = run.wait(60.0);
    check("full disk", &sim, &run, &ended, &["No space left on device", "free space"]);
    // With room again, the next run finalises what is there and measures.
    let enlarged = Command::new("mount").args(["-o", "remount,size=4g"]).arg(&at).status();
    assert!(enlarged.is_ok_and(|status| status.success()));
    let next = rigd(run.home())
        .args("run --load 5Nm --rpm 30 --revs 1 --direction ccw --rate 1kHz --json --out".split(' '))
        .arg(&at)
        .output()
        .expect("it runs");
    assert_eq!(next.status.code(), Some(0), "{}", String::from_utf8_lossy(&next.stderr));
    run.assert_whole();
    drop(disk);
}

#[test]
fn a_disk_that_runs_short_stops_the_rig_while_the_log_can_still_be_ended() {
    let directory = tempfile::TempDir::new().expect("a temporary directory");
    let at = directory.path().join("small");
    let Some(disk) = SmallDisk::mount(&at, 4 * ROOM_KIB) else {
        println!("skipped: this user may not mount a tmpfs");
        return;
    };
    let sim = Sim::start(3);
    let profile = sim.profile(|profile| (profile.log.warn_free_mb, profile.log.stop_free_mb) = (0.9, 0.8));
    let mut run = Run::through(|home, _| {
        let mut command = rigd(home);
        command.args(arguments(&profile)).arg("--out").arg(&at);
        command
    });
    run.out = at.clone();
    let ended = run.wait(60.0);
    println!("short of room: exit {:?} after {:.1} s: {}", ended.code, ended.seconds, ended.stderr.trim());
    let state = sim.servo().state();
    assert_eq!(ended.code, Some(5), "{}", ended.stderr);
    assert!(ended.stderr.contains("log.stop_free_mb"), "{}", ended.stderr);
    assert!(!state.on && state.motor_rpm.abs() < 1.0 && state.alarm == 0, "{state:?}");
    // Unlike that of a full disk, this log has its end and lacks nothing.
    let log = run.log().expect("a log");
    let audit = riglog::audit(&riglog::LogParts::of(&log).expect("a log")).expect("a readable log");
    assert!(audit.is_clean() && audit.samples > 10_000, "{:?}", audit.findings);
    drop(disk);
}
