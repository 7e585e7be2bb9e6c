//! Campaigns: killed and taken up again, paused by signal, refused as a whole, as long as the dry run says, and from what
//! `rigd diagnose --plan-next` writes.

mod support;

use std::path::{Path, PathBuf};
use std::time::Duration;

use nix::sys::signal::Signal;
use riglog::proto::Phase;
use serde_json::Value;
use support::bench::{events, replayed};
use support::{Run, Sim, rigd, wait_for};

const PLAN: &str = "name = \"short\"\noperator = \"night shift\"\nnote = \"new bearings\"\norder = \"random\"\nseed = 5\nrate_hz = 2000.0\n\
    [reference]\ndirection = \"ccw\"\nload_nm = 5.0\nspeed_rpm = 30.0\nrevolutions = 1\n\
    [[matrix]]\ndirections = [\"both\"]\nloads_nm = [5.0, 10.0]\nspeeds_rpm = [30.0]\nrevolutions = 1\n";

/// `rigd campaign` of a plan in its own home, which later starts share.
fn start(home: &Path, plan: &str, arguments: &[&str]) -> Run {
    Run::through(|_, _| {
        std::fs::write(home.join("plan.toml"), plan).expect("a file");
        let mut command = rigd(home);
        command.args(["campaign", "--quiet", "--json"]).arg(home.join("plan.toml")).arg("--out").arg(home.join("logs"));
        command.args(arguments);
        command
    })
}

fn logs(home: &Path) -> Vec<PathBuf> {
    let mut logs: Vec<_> = std::fs::read_dir(home.join("logs"))
        .expect("a directory")
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "mcap"))
        .collect();
    logs.sort();
    logs
}

fn journal(home: &Path) -> String {
    std::fs::read_to_string(home.join("logs/journal.jsonl")).unwrap_or_default()
}

#[test]
fn every_run_has_a_whole_log_and_all_share_one_clock_and_one_zero() {
    let home = tempfile::TempDir::new().expect("a directory");
    let ended = start(home.path(), PLAN, &[]).wait(60.0);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert_eq!((report["planned"].as_u64(), report["losses"].as_u64()), (Some(6), Some(0)));
    assert_eq!(report["drift"][0]["direction"], "ccw");
    let logs = logs(home.path());
    assert_eq!(logs.len(), 6);
    let (mut end_ns, mut number, mut zero) = (0, None, None);
    for log in &logs {
        let info = riglog::info(log).expect("a log");
        assert!(info.completeness.is_complete() && info.losses_in_file == 0, "{}", log.display());
        assert_eq!(info.runs.len(), 1);
        let stream = riglog::RunStream::open(log).expect("a log");
        let run = stream.metadata().expect("its metadata");
        assert!(run.operator == "night shift" && run.note.starts_with("new bearings; "), "{run:?}");
        assert!(stream.attachment("plan.toml").is_some());
        // The numbers of the samples go on from file to file: none was lost between them.
        let (mut first, mut last) = (None, 0);
        for record in riglog::LogReader::open(log).expect("a log").flatten() {
            if let riglog::Record::Angles { batch, .. } = record {
                first.get_or_insert(batch.first_sample);
                last = batch.first_sample + batch.input_delta.len() as u64;
                assert!(batch.t0_ns >= end_ns, "one clock");
                end_ns = batch.t0_ns;
            }
        }
        assert!(number.is_none_or(|number| Some(number) == first), "{}: {first:?} after {number:?}", log.display());
        number = Some(last);
        let encoders = *stream.encoders().expect("encoders");
        assert!(zero.is_none_or(|zero| zero == encoders), "one zero");
        zero = Some(encoders);
    }
    // And the diagnosis takes them as one campaign.
    let diagnosed = rigd(home.path()).arg("diagnose").args(&logs).arg("--json").output().expect("it runs");
    assert!(diagnosed.status.success(), "{}", String::from_utf8_lossy(&diagnosed.stderr));
    // The same command has nothing left to do.
    let again = start(home.path(), PLAN, &[]).wait(30.0);
    assert!(again.code == Some(0) && again.stderr.contains("complete already"), "{}", again.stderr);
    // Another order is another campaign.
    let other = start(home.path(), &PLAN.replace("seed = 5", "seed = 6"), &[]).wait(30.0);
    assert!(other.code == Some(2) && other.stderr.contains("--out"), "{}", other.stderr);
}

/// Kills a campaign once so many runs are finished, each time in the middle of the next run, and takes it up again at last. Each log
/// is one file, or split at `rotate_mb`.
fn killed_and_resumed(seed: u64, rotate_mb: f64, kills_after: &[usize]) {
    let home = tempfile::TempDir::new().expect("a directory");
    let sim = Sim::start(seed);
    let profile = sim.profile(|profile| profile.log.rotate_mb = rotate_mb).display().to_string();
    for &done in kills_after {
        let mut run = start(home.path(), PLAN, &["--profile", &profile]);
        wait_for("finished runs", 60.0, || {
            (journal(home.path()).matches("\"what\":\"finished\"").count() >= done).then_some(())
        });
        // Somewhere in the next run, once its log has several parts where logs are split.
        std::thread::sleep(Duration::from_millis(1700));
        if rotate_mb > 0.0 {
            wait_for("parts", 20.0, || unfinished(home.path()).iter().any(|log| log.contains(".part3.")).then_some(()));
        }
        run.process.signal(Signal::SIGKILL);
        run.process.wait(5.0);
    }
    let left = unfinished(home.path());
    let ended = start(home.path(), PLAN, &["--profile", &profile]).wait(120.0);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_eq!(ended.stderr.matches("put aside").count(), 1, "a log once, however many parts: {}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    let runs = report["runs"].as_array().expect("runs");
    assert_eq!((runs.len(), report["losses"].as_u64()), (6, Some(0)));
    let text = journal(home.path());
    for run in 0..6 {
        let finished = format!("\"what\":\"finished\",\"run\":{run},");
        assert_eq!(text.matches(&finished).count(), 1, "run {run} was done once: {text}");
    }
    assert!(unfinished(home.path()).is_empty(), "only finished runs lie here: {:?}", unfinished(home.path()));
    let whole = riglog::LogParts::group(&logs(home.path())).expect("logs");
    assert_eq!(whole.len(), 6);
    for log in &whole {
        assert_eq!(log.is_split(), rotate_mb > 0.0, "{}", log.first().display());
        assert!(riglog::info(log.first()).expect("a log").completeness.is_complete(), "{}", log.first().display());
    }
    // Every part of the last run that was killed lies aside, and each kill left one log there.
    let aside: Vec<_> = std::fs::read_dir(home.path().join("logs/unfinished"))
        .expect("put aside")
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    assert!(!left.is_empty() && left.iter().all(|part| aside.contains(part)), "{left:?} in {aside:?}");
    let paths: Vec<_> = aside.iter().map(|name| home.path().join("logs/unfinished").join(name)).collect();
    assert_eq!(riglog::LogParts::group(&paths).expect("logs").len(), kills_after.len(), "{aside:?}");
    println!("rotation at {rotate_mb} MB: {} files of finished runs, {} aside", logs(home.path()).len(), aside.len());
}

/// Files here that belong to no run in the journal.
fn unfinished(home: &Path) -> Vec<String> {
    let text = journal(home);
    let first = |log: &PathBuf| riglog::part_path(log, 1).file_name().expect("a name").to_string_lossy().into_owned();
    let of_none = |log: &&PathBuf| !text.contains(&format!("\"log\":\"{}\"", first(log)));
    let name = |log: &PathBuf| log.file_name().expect("a name").to_string_lossy().into_owned();
    logs(home).iter().filter(of_none).map(name).collect()
}

#[test]
fn a_campaign_that_was_killed_goes_on_at_its_first_unfinished_run() {
    killed_and_resumed(5, 0.0, &[1, 3]);
}

#[test]
fn a_campaign_whose_logs_are_split_is_killed_and_goes_on_alike() {
    killed_and_resumed(8, 0.01, &[2]);
}

#[test]
fn sigusr1_pauses_at_a_revolutions_end_and_goes_on() {
    let home = tempfile::TempDir::new().expect("a directory");
    let sim = Sim::start(6);
    let profile = sim.profile(|_| {}).display().to_string();
    let plan = "rate_hz = 2000.0\n[[runs]]\ndirection = \"cw\"\nload_nm = 5.0\nspeed_rpm = 30.0\nrevolutions = 3\n";
    let mut run = start(home.path(), plan, &["--profile", &profile]);
    run.out = home.path().join("logs");
    run.await_phase(|phase, _| phase == Phase::Record);
    run.process.signal(Signal::SIGUSR1);
    wait_for("the pause", 10.0, || journal(home.path()).contains("paused at the end of a revolution").then_some(()));
    std::thread::sleep(Duration::from_millis(1500));
    let shafts = sim.shafts();
    assert!(shafts.iter().rev().take(100).all(|shaft| !shaft.turns() && !shaft.servo_on), "at rest and off");
    run.process.signal(Signal::SIGUSR1);
    let ended = run.wait(60.0);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let log = &logs(home.path())[0];
    let (analysis, found) = replayed(log);
    let parts: Vec<_> = analysis.runs().iter().map(|run| run.te.revolutions()).collect();
    println!("recorded in parts of {parts:?} revolutions");
    assert_eq!((parts.len(), parts.iter().sum::<usize>(), found.losses), (2, 3, 0));
    assert!(events(log).iter().any(|(_, name, _)| name == "resume"));
}

#[test]
fn ctrl_c_ends_it_with_whole_logs_and_a_word_on_how_to_go_on() {
    let home = tempfile::TempDir::new().expect("a directory");
    let sim = Sim::start(7);
    let profile = sim.profile(|_| {}).display().to_string();
    let mut run = start(home.path(), PLAN, &["--profile", &profile]);
    run.out = home.path().join("logs");
    run.await_phase(|phase, _| phase == Phase::Record);
    run.process.signal(Signal::SIGINT);
    let ended = run.wait(20.0);
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert!(ended.stderr.contains("first unfinished run"), "{}", ended.stderr);
    assert!(logs(home.path()).is_empty(), "the run was not finished");
    let aside =
        std::fs::read_dir(home.path().join("logs/unfinished")).expect("put aside").flatten().next().expect("a log");
    assert!(riglog::info(aside.path()).expect("a log").completeness.is_complete());
}

#[test]
fn a_dry_run_moves_nothing_and_is_right_about_the_time() {
    let home = tempfile::TempDir::new().expect("a directory");
    let dry = start(home.path(), PLAN, &["--dry-run"]).wait(10.0);
    assert_eq!(dry.code, Some(0), "{}", dry.stderr);
    assert!(!home.path().join("logs").exists());
    let dry: Value = serde_json::from_str(&dry.stdout).expect("JSON");
    assert_eq!(dry["runs"], 6);
    let wet = start(home.path(), PLAN, &[]).wait(60.0);
    assert_eq!(wet.code, Some(0), "{}", wet.stderr);
    // From the first sample to the last, in the rig's own time.
    let logs = logs(home.path());
    let first = riglog::RunStream::open(&logs[0]).expect("a log").start_ns().expect("samples");
    let last = riglog::LogReader::open(&logs[5]).expect("a log").flatten().filter_map(|record| match record {
        riglog::Record::Angles { log_time_ns, .. } => Some(log_time_ns),
        _ => None,
    });
    let took_s = (last.last().expect("samples") - first) as f64 * 1e-9;
    let said_s = dry["duration_s"].as_f64().expect("a time");
    println!("dry run {said_s:.1} s, took {took_s:.1} s");
    assert!((took_s / said_s - 1.0).abs() < 0.1, "{said_s} s said, {took_s} s taken");
    assert!(dry["heat_j"].as_f64().expect("heat") > 0.0);
}

#[test]
fn faults_of_a_plan_are_told_all_at_once_before_anything_is_written() {
    let home = tempfile::TempDir::new().expect("a directory");
    let wrong =
        PLAN.replace("loads_nm = [5.0, 10.0]", "loads_nm = [5.0, 21.0]").replace("rate_hz = 2000.0", "rate_hz = 1.0");
    let ended = start(home.path(), &wrong, &[]).wait(10.0);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("load_nm = 21") && ended.stderr.contains("rate_hz = 1 "), "{}", ended.stderr);
    assert!(!home.path().join("logs").exists());
}

#[test]
fn the_plan_that_diagnose_proposes_runs() {
    let home = tempfile::TempDir::new().expect("a directory");
    let plan = "rate_hz = 2000.0\n[[runs]]\ndirection = \"ccw\"\nload_nm = 10.0\nspeed_rpm = 30.0\nrevolutions = 4\n";
    let ended = start(home.path(), plan, &["--undocumented", "encoder2_eccentricity"]).wait(60.0);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let next = home.path().join("next.toml");
    let mut diagnose = rigd(home.path());
    diagnose.arg("diagnose").args(logs(home.path())).arg("--plan-next").arg(&next);
    diagnose.output().expect("it runs");
    let text = std::fs::read_to_string(&next).expect("one load in one sense leaves something to measure");
    println!("{text}");
    let other = tempfile::TempDir::new().expect("a directory");
    let ended = start(other.path(), &text, &["--undocumented", "encoder2_eccentricity"]).wait(120.0);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_eq!(logs(other.path()).len(), text.matches("[[runs]]").count());
}

#[test]
fn the_source_documents_plan_is_within_the_simulated_rigs_limits() {
    let plan = concat!(env!("CARGO_MANIFEST_DIR"), "/../../plans/source-document.toml");
    let home = tempfile::TempDir::new().expect("a directory");
    let output = rigd(home.path()).args(["campaign", plan, "--dry-run", "--json"]).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let dry: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    // Two warm-ups, reference in both senses first and last, six loads in both senses.
    assert_eq!(dry["runs"], 2 + 2 + 12 + 2);
}
