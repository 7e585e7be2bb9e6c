//! A writer that is killed, and disks that take no more: what is left is always readable.

// A test ends at the first surprise.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    env, fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use common::{messages, read};
use riglog::{
    BatchBuilder, Completeness, LogError, LogWriter, Record,
    proto::{Level, RigState},
    recover,
};

/// Set for the process that writes until something ends it: the path of its log.
const CHILD: &str = "RIGLOG_TEST_CHILD";

/// Started by the tests below in a process of its own; does nothing as a test.
#[test]
fn child() {
    let Ok(path) = env::var(CHILD) else { return };
    let result = write_for_ever(Path::new(&path));
    println!("{}", result.unwrap_err());
}

/// Writes in real time, 10 kS/s, and says in each event how many samples came before it.
fn write_for_ever(path: &Path) -> Result<(), LogError> {
    let mut log = LogWriter::create(path, common::options())?;
    log.run_metadata(&common::run_metadata())?;
    log.attach(0, "pair.toml", "application/toml", common::PAIR_TOML.as_bytes())?;
    log.encoders(&common::encoders())?;
    let mut batches = BatchBuilder::new(100);
    let started = Instant::now();
    for n in 0u64.. {
        let due = started + Duration::from_micros(100 * n);
        if n % 100 == 0 {
            sleep(due.saturating_duration_since(Instant::now()));
        }
        let noise = (n.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 44) as i64;
        let now_ns = common::START_NS + started.elapsed().as_nanos() as u64;
        if let Some(batch) = batches.push(n, n * 100_000, n as i64 * 60 + noise, n as i64 * 55 - noise) {
            let written = log
                .angles(now_ns, batch.t0_ns, &batch)
                .and_then(|()| log.event(now_ns, now_ns, Level::Info, "count", &(n + 1).to_string()));
            if let Err(error) = written {
                // A rig stops in order; the log is finished whatever happened to it.
                assert!(matches!(log.state(0, 0, &RigState::default()), Err(LogError::Stopped { .. })));
                log.finish()?;
                return Err(error);
            }
        }
    }
    Ok(())
}

fn start(path: &Path) -> Child {
    Command::new(env::current_exe().unwrap())
        .args(["child", "--exact", "--nocapture"])
        .env(CHILD, path)
        .stdout(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn a_writer_killed_at_any_instant_leaves_a_prefix_that_is_250_ms_short_at_most() {
    let directory = tempfile::tempdir().unwrap();
    for round in 0..8u64 {
        let path = directory.path().join(format!("{round}.mcap"));
        let mut child = start(&path);
        while !path.exists() || fs::metadata(&path).unwrap().len() == 0 {
            sleep(Duration::from_millis(1));
        }
        let begun = Instant::now();
        sleep(Duration::from_millis(150 + 83 * round));
        let ran = begun.elapsed();
        child.kill().unwrap();
        child.wait().unwrap();
        let (records, completeness) = read(&path);
        assert!(matches!(completeness, Completeness::Truncated { .. }), "{completeness}");
        let (mut samples, mut stated) = (0, 0);
        for record in &records {
            match record {
                Record::Angles { batch, .. } => {
                    assert_eq!(batch.first_sample, samples);
                    samples += batch.len() as u64;
                }
                Record::Event { event, .. } => stated = event.message.parse().unwrap(),
                _ => {}
            }
        }
        assert_eq!(samples, stated);
        let written = Duration::from_micros(samples * 100);
        // The machine may be slow to start the child, never quick to lose what it wrote.
        assert!(written + Duration::from_millis(250) >= ran, "{written:?} of {ran:?}");
        let recovery = recover(&path).unwrap();
        assert_eq!(recovery.kept_messages, messages(&records));
        let (again, completeness) = read(&path);
        assert_eq!((again, completeness), (records, Completeness::Complete));
    }
}

/// What a writer leaves that ran into a limit of the system, here by a shell that sets it up.
fn runs_into(shell: &str, path: &Path) -> String {
    let output = Command::new("sh")
        .args(["-c", shell, "sh"])
        .arg(env::current_exe().unwrap())
        .env(CHILD, path)
        .output()
        .unwrap();
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn check_stopped(path: &Path, said: &str, expected: &[&str]) {
    for part in expected {
        assert!(said.contains(part), "{said}");
    }
    let (records, completeness) = read(path);
    let samples: usize =
        records.iter().map(|r| if let Record::Angles { batch, .. } = r { batch.len() } else { 0 }).sum();
    assert!(samples > 1000, "{samples}");
    // Where the end still fitted the file is complete, else it is a clean prefix.
    assert!(!matches!(completeness, Completeness::Damaged { .. }), "{completeness}");
}

#[test]
fn a_file_size_limit_ends_the_log_in_order() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let said = runs_into("trap '' XFSZ; ulimit -f 48; exec \"$1\" child --exact --nocapture", &path);
    check_stopped(&path, &said, &["bytes at byte", "a.mcap", "ulimit"]);
    recover(&path).unwrap();
    assert!(read(&path).1.is_complete());
}

#[test]
fn a_full_disk_ends_the_log_in_order() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    // A name space of its own, so that the mount goes with the process; the file is copied out of it.
    let shell = format!(
        "unshare --mount --map-root-user sh -c 'mount -t tmpfs -o size=48k none \"{0}\" && \"$1\" child --exact --nocapture; \
         cp \"{0}/a.mcap\" \"{0}.mcap\"' sh \"$1\"",
        directory.path().display()
    );
    let said = runs_into(&shell, &path);
    let copy = directory.path().with_extension("mcap");
    if !copy.exists() {
        println!("skipped: this system lets nobody mount a tmpfs");
        return;
    }
    check_stopped(&copy, &said, &["No space left on device", "a.mcap", "free space"]);
    recover(&copy).unwrap();
    assert!(read(&copy).1.is_complete());
    fs::remove_file(copy).unwrap();
}
