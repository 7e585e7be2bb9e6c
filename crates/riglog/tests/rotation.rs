//! A log that is split while it is written is the same log: no sample is lost, whichever file one names.

// A test ends at the first surprise.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use common::{SMALL, START_NS, encoders, run_metadata};
use riglog::{
    BatchBuilder, FindingKind, Follower, Following, LogParts, LogReader, Record, RotatingWriter, Rotation, RunStream,
    audit, info, part_path,
    proto::{AngleBatch, Direction, Level, Phase, RigState, Timestamp},
    read_runs, recover,
};

const SAMPLES: u64 = 60_000;
const RATE_HZ: u64 = 1_000;
const BATCH: usize = 50;

fn state(number: u64, phase: Phase) -> (u64, RigState) {
    let at_ns = START_NS + number * (1_000_000_000 / RATE_HZ);
    let state = RigState {
        timestamp: Some(Timestamp::from_ns(at_ns)),
        phase: phase.into(),
        direction: Direction::Ccw.into(),
        speed_setpoint_rpm: 5.0,
        load_setpoint_nm: 10.0,
        samples: number,
        ..RigState::default()
    };
    (at_ns, state)
}

fn batches() -> Vec<AngleBatch> {
    let mut builder = BatchBuilder::new(BATCH);
    let mut batches = Vec::new();
    for n in 0..SAMPLES {
        let wobble = ((n as f64 * 0.013).sin() * 900.0) as i64;
        batches.extend(builder.push(
            n,
            START_NS + n * (1_000_000_000 / RATE_HZ),
            n as i64 * 87 + wobble,
            -(n as i64) * 600,
        ));
    }
    batches.extend(builder.take());
    batches
}

/// Writes a run of [`SAMPLES`]; `look` is called after each batch.
fn write(path: &Path, rotation: Rotation, mut look: impl FnMut()) -> RotatingWriter {
    let run = run_metadata();
    let mut log = RotatingWriter::create(path, common::options(), rotation, &run.run_id).unwrap();
    log.run_metadata(&run).unwrap();
    log.attach(START_NS, "pair.toml", "application/toml", common::PAIR_TOML.as_bytes()).unwrap();
    log.encoders(&encoders()).unwrap();
    let (at_ns, first) = state(0, Phase::Record);
    log.state(at_ns, at_ns, &first).unwrap();
    for (n, batch) in batches().iter().enumerate() {
        let arrived_ns = batch.last_time_ns().unwrap() + 2_000_000;
        log.angles(arrived_ns, batch.t0_ns, batch).unwrap();
        if n % 7 == 0 {
            let (at_ns, state) = state((n as u64 + 1) * BATCH as u64 - 1, Phase::Record);
            log.state(at_ns, at_ns, &state).unwrap();
            log.event(at_ns, at_ns, Level::Info, "test", "still there").unwrap();
        }
        look();
    }
    let (at_ns, last) = state(SAMPLES, Phase::Idle);
    log.state(at_ns, at_ns, &last).unwrap();
    log
}

fn by_size() -> Rotation {
    Rotation { bytes: Some(20_000), period: None }
}

fn files(directory: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn a_split_log_is_the_log_that_was_not_split() {
    let directory = tempfile::tempdir().unwrap();
    let whole = directory.path().join("whole.mcap");
    let statistics = write(&whole, Rotation::default(), || {}).finish().unwrap();
    assert_eq!(statistics.samples, SAMPLES);
    let expected = read_runs(&whole).unwrap();
    let expected_info = info(&whole).unwrap();
    for (name, rotation) in
        [("size", by_size()), ("time", Rotation { bytes: None, period: Some(Duration::from_secs(9)) })]
    {
        let inside = directory.path().join(name);
        std::fs::create_dir(&inside).unwrap();
        let path = inside.join("log.mcap");
        let log = write(&path, rotation, || {});
        let paths = log.paths();
        let statistics = log.finish().unwrap();
        assert_eq!(files(&inside).len(), paths.len(), "{name}");
        assert!(paths.len() >= 4, "{name}: {} parts only", paths.len());
        assert_eq!(statistics.samples, SAMPLES);
        // Whichever part is named, and in whatever order: the same samples, bit by bit.
        for named in &paths {
            assert_eq!(LogParts::of(named).unwrap().paths().collect::<Vec<_>>(), paths, "{name}");
            assert_eq!(read_runs(named).unwrap(), expected, "{name}");
        }
        let mut backwards = paths.clone();
        backwards.reverse();
        assert_eq!(LogParts::group(&backwards).unwrap().len(), 1);
        let split = info(&paths[1]).unwrap();
        assert_eq!((split.samples_in_file, split.losses_in_file), (SAMPLES, 0));
        assert!(split.completeness.is_complete());
        assert_eq!(split.parts, paths);
        assert_eq!(split.channels, expected_info.channels, "no message more, no message less");
        assert_eq!(split.attachments, expected_info.attachments);
        // Each part alone is a whole log that the public reader opens.
        for part in &paths {
            let bytes = std::fs::read(part).unwrap();
            let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).count() as u64;
            let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
            assert_eq!(summary.stats.unwrap().message_count, messages);
        }
        let audited = audit(&LogParts::of(&path).unwrap()).unwrap();
        assert!(audited.is_clean(), "{name}: {:?}", audited.findings);
        assert_eq!((audited.samples, audited.losses, audited.repeated), (SAMPLES, 0, 0));
    }
}

#[test]
fn a_head_that_is_longer_than_a_part_may_be_does_not_make_a_part_of_every_message() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("log.mcap");
    let rotation = Rotation { bytes: Some(10_000), period: None };
    let mut log = RotatingWriter::create(&path, common::options(), rotation, "long-headed").unwrap();
    log.attach(1, "pair.toml", "application/toml", &[b'#'; 50_000]).unwrap();
    for n in 0..2000 {
        // Text that does not compress away: digits of a hash.
        let text: String =
            (0..8_u64).map(|k| format!("{:016x}", (n * 8 + k + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15))).collect();
        log.event(n * 1_000_000, n * 1_000_000, Level::Info, "x", &text).unwrap();
    }
    let parts = log.paths().len();
    log.finish().unwrap();
    assert!((2..60).contains(&parts), "{parts} parts of 2000 messages");
}

#[test]
fn a_part_that_is_missing_is_named_and_its_samples_are_losses() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("log.mcap");
    let log = write(&path, by_size(), || {});
    let paths = log.paths();
    log.finish().unwrap();
    let told = |parts: &LogParts| audit(parts).unwrap();

    let kept = std::fs::read(&paths[2]).unwrap();
    std::fs::remove_file(&paths[2]).unwrap();
    let middle = told(&LogParts::of(&path).unwrap());
    assert!(middle.losses > 0 && middle.samples + middle.losses == SAMPLES, "{middle:?}");
    for kind in [FindingKind::Truncation, FindingKind::Samples, FindingKind::Messages] {
        assert!(middle.findings.iter().any(|finding| finding.kind == kind), "{kind:?}: {:?}", middle.findings);
    }
    let seen = info(&path).unwrap();
    assert_eq!(seen.losses_in_file, middle.losses);
    assert!(!seen.completeness.is_complete() && seen.completeness.to_string().contains("part 3"));
    std::fs::write(&paths[2], kept).unwrap();
    assert!(told(&LogParts::of(&path).unwrap()).is_clean());

    // A copy under another name is no second part; another run's part is none of this log's.
    std::fs::copy(&paths[1], directory.path().join("copy.mcap")).unwrap();
    let group = LogParts::group(&[path.clone(), directory.path().join("copy.mcap")]).unwrap();
    assert_eq!((group.len(), group[0].paths().count()), (1, paths.len()));

    let last = paths.last().unwrap();
    std::fs::remove_file(last).unwrap();
    let end = told(&LogParts::of(&path).unwrap());
    assert!(end.findings.iter().any(|finding| finding.what.contains(&format!("part {}", paths.len()))), "{end:?}");
}

#[test]
fn a_writer_that_dies_leaves_parts_that_are_recovered_as_one() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("log.mcap");
    let log = write(&path, by_size(), || {});
    let paths = log.paths();
    drop(log);
    // Whatever the death left without an end, each for itself.
    for part in &paths {
        // The thread that ends the part before may still hold it.
        for _ in 0..100 {
            match recover(part) {
                Err(riglog::LogError::Locked { .. }) => std::thread::sleep(Duration::from_millis(10)),
                done => {
                    done.unwrap();
                    break;
                }
            }
        }
    }
    let seen = info(&path).unwrap();
    assert!(seen.completeness.is_complete(), "{}", seen.completeness);
    assert_eq!((seen.samples_in_file, seen.losses_in_file), (SAMPLES, 0));
}

#[test]
fn a_follower_sees_every_record_once_while_it_is_written() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("log.mcap");
    let mut follower: Option<Follower> = None;
    let mut samples = 0;
    let mut looks = 0;
    let mut follow = |follower: &mut Option<Follower>| {
        if follower.is_none() {
            *follower = Follower::open(&path).ok();
        }
        let Some(follower) = follower else { return Following::Growing };
        follower
            .poll(|record| {
                if let Record::Angles { batch, .. } = record {
                    assert_eq!(batch.first_sample, samples);
                    samples += batch.len() as u64;
                }
            })
            .unwrap()
    };
    let log = write(&path, by_size(), || {
        looks += 1;
        if looks % 3 == 0 {
            assert_eq!(follow(&mut follower), Following::Growing);
        }
    });
    assert!(log.paths().len() > 3);
    log.finish().unwrap();
    assert_eq!(follow(&mut follower), Following::Ended);
    assert_eq!(samples, SAMPLES);
}

#[test]
fn the_audit_finds_every_kind_of_fault() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("clean.mcap");
    common::write(&path, &SMALL).unwrap();
    let clean = std::fs::read(&path).unwrap();
    let audited = |bytes: &[u8]| {
        let path = directory.path().join("changed.mcap");
        std::fs::write(&path, bytes).unwrap();
        audit(&LogParts::alone(&path)).unwrap()
    };
    assert!(audited(&clean).is_clean(), "{:?}", audited(&clean).findings);
    let kinds = |bytes: &[u8]| audited(bytes).findings.iter().map(|finding| finding.kind).collect::<Vec<_>>();
    // One bit anywhere in the data is damage.
    for at in (clean.len() / 4..clean.len() / 2).step_by(997) {
        let mut bad = clean.clone();
        bad[at] ^= 1;
        assert!(kinds(&bad).contains(&FindingKind::Damage), "byte {at}");
    }
    assert!(kinds(&clean[..clean.len() / 2]).contains(&FindingKind::Truncation));
    // Lost samples, told or not.
    let path = directory.path().join("lossy.mcap");
    common::write(&path, &common::Plan { lose: 17, ..SMALL }).unwrap();
    let lossy = audit(&LogParts::alone(&path)).unwrap();
    assert_eq!(lossy.losses, 17);
    // The states of this log claim that nothing was lost: the audit does not believe them.
    for kind in [FindingKind::Samples, FindingKind::Account] {
        assert!(lossy.findings.iter().any(|finding| finding.kind == kind), "{kind:?}: {:?}", lossy.findings);
    }
    let records = LogReader::open(&path).unwrap().count();
    assert!(records > 0 && RunStream::open(&path).unwrap().parts().paths().count() == 1);
    assert_eq!(part_path(&path, 2), directory.path().join("lossy.part2.mcap"));
}
