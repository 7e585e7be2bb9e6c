//! Cut files read as a clean prefix and can be finalised; damaged files never panic and are reported.

// A test ends at the first surprise.
#![allow(clippy::unwrap_used)]

mod common;

use std::{io::Cursor, path::Path, sync::LazyLock};

use common::{Plan, SMALL, messages};
use proptest::prelude::*;
use riglog::{Completeness, LogError, LogReader, Record, recover, recover_directory};

/// A log of some kilobytes, so that thousands of cases run in seconds.
const TINY: Plan = Plan { samples: 300, idle: 40, rate_hz: 1_000, revolutions: 0.1, loads_nm: &[5.0], lose: 0 };

static LOG: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    common::write(&path, &TINY).unwrap();
    std::fs::read(&path).unwrap()
});

/// Where header, schemas and channels end: the place of the first metadata record.
static HEAD_BYTES: LazyLock<usize> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let log = riglog::LogWriter::create(&path, common::options()).unwrap();
    let bytes = log.bytes() as usize;
    drop(log);
    bytes
});

fn read(bytes: &[u8]) -> Result<(Vec<Record>, Completeness), LogError> {
    let mut reader = LogReader::over(Cursor::new(bytes), bytes.len() as u64, "bytes")?;
    // A record that does not decode is reported by itself.
    let records = reader.by_ref().filter_map(Result::ok).collect();
    let completeness = reader.completeness().cloned().expect("the reader came to its end");
    Ok((records, completeness))
}

fn check_prefix(length: usize, path: &Path) {
    let (whole, _) = read(&LOG).unwrap();
    let (kept, completeness) = read(&LOG[..length]).unwrap();
    assert!(whole.starts_with(&kept), "{length} bytes");
    assert_eq!(completeness.is_complete(), length == LOG.len(), "{length} bytes");
    std::fs::write(path, &LOG[..length]).unwrap();
    if length < *HEAD_BYTES {
        // Nothing was recorded yet; a head that holds a channel may be completed, less cannot.
        let _ = recover(path);
        return;
    }
    let recovery = recover(path).unwrap();
    assert_eq!(recovery.kept_messages, messages(&kept), "{length} bytes");
    let recovered = std::fs::read(path).unwrap();
    let (again, completeness) = read(&recovered).unwrap();
    assert_eq!(completeness, Completeness::Complete, "{length} bytes");
    assert_eq!(again, kept, "{length} bytes");
    // The public reader takes it, with its indexes.
    let summary = mcap::Summary::read(&recovered).unwrap().unwrap();
    assert_eq!(summary.stats.as_ref().unwrap().message_count, recovery.kept_messages);
    let mut indexed = 0;
    for chunk in &summary.chunk_indexes {
        indexed += summary.read_message_indexes(&recovered, chunk).unwrap().values().map(Vec::len).sum::<usize>();
    }
    assert_eq!(indexed as u64, recovery.kept_messages);
    assert_eq!(
        summary.attachment_indexes.len(),
        kept.iter().filter(|r| matches!(r, Record::Attachment { .. })).count()
    );
    assert!(recover(path).unwrap().already_complete);
}

#[test]
fn cut_at_the_places_that_matter() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let length = LOG.len();
    let near_end = (length - 4000..=length).step_by(37);
    let near_head = *HEAD_BYTES..*HEAD_BYTES + 200;
    for length in near_head.chain(near_end).chain([length - 1, length]) {
        check_prefix(length, &path);
    }
}

#[test]
fn a_directory_is_recovered_file_by_file() {
    let directory = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(directory.path().join(name), bytes).unwrap();
    write("a.mcap", &LOG);
    write("b.mcap", &LOG[..LOG.len() / 2]);
    write("c.mcap", b"no log");
    write("d.mcap", b"");
    write("e.txt", b"not looked at");
    let results = recover_directory(directory.path()).unwrap();
    assert_eq!(results.len(), 4);
    assert!(results[0].1.as_ref().unwrap().already_complete);
    assert!(!results[1].1.as_ref().unwrap().already_complete);
    assert!(matches!(results[2].1, Err(LogError::NotMcap { .. })));
    assert!(matches!(results[3].1, Err(LogError::NotMcap { .. })));
    assert!(recover_directory(directory.path().join("none")).unwrap().is_empty());
}

#[test]
fn a_foreign_file_that_was_cut_is_not_touched() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let mut foreign = mcap::WriteOptions::new().use_chunks(false).create(Cursor::new(Vec::new())).unwrap();
    foreign.add_channel(0, "/imu", "json", &Default::default()).unwrap();
    foreign.finish().unwrap();
    let bytes = foreign.into_inner().into_inner();
    let cut = &bytes[..bytes.len() - 9];
    std::fs::write(&path, cut).unwrap();
    assert!(matches!(recover(&path), Err(LogError::NoRigChannels { .. })));
    assert_eq!(std::fs::read(&path).unwrap(), cut);
}

/// Starts of the chunks in a file, by the public reader.
fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    summary.chunk_indexes.iter().map(|c| (c.chunk_start_offset as usize, c.chunk_length as usize)).collect()
}

#[test]
fn a_damaged_chunk_costs_that_chunk_alone() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    common::write(&path, &SMALL).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let all = messages(&read(&whole).unwrap().0);
    let (at, length) = chunks(&whole)[20];
    // In the compressed data; in the record's length; in the length of the data.
    for place in [at + length - 20, at + 3, at + 8, at + 9 + 8 + 8 + 8 + 4 + 8 + 1] {
        let mut bad = whole.clone();
        bad[place] ^= 0x41;
        let (records, completeness) = read(&bad).unwrap();
        let lost = all - messages(&records);
        assert!(
            matches!(completeness, Completeness::Damaged { at_byte, .. } if at_byte == at as u64),
            "{completeness}"
        );
        // 100 ms of this log: a batch of angles and the bins of a twelfth of a turn.
        assert!((1..=70).contains(&lost), "byte {place}: {lost} messages lost");
        // Without its end the file is finalised all the same; what the damage covers stays in the file kept beside it.
        std::fs::write(&path, &bad[..bad.len() - 100]).unwrap();
        let recovery = recover(&path).unwrap();
        assert!(matches!(recovery.found, Completeness::Damaged { .. }));
        let kept = path.with_extension("mcap.damaged");
        assert_eq!(std::fs::read(&kept).unwrap(), &bad[..bad.len() - 100]);
        std::fs::remove_file(kept).unwrap();
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1, "nothing else is left behind");
        assert_eq!(recovery.kept_messages, messages(&records));
        let recovered = std::fs::read(&path).unwrap();
        assert_eq!(messages(&read(&recovered).unwrap().0), messages(&records));
        assert_eq!(chunks(&recovered).len(), chunks(&whole).len() - 1);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_prefix_reads_as_a_prefix_and_can_be_finalised(cut in 0.0f64..1.0) {
        let length = 8 + ((LOG.len() - 8) as f64 * cut) as usize;
        let directory = tempfile::tempdir().unwrap();
        check_prefix(length, &directory.path().join("a.mcap"));
    }

    #[test]
    fn flipped_bytes_never_panic_and_are_reported(
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1u8..=255), 1..4),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut bytes = LOG.clone();
        for (place, bits) in &flips {
            let place = place.index(bytes.len());
            bytes[place] ^= bits;
        }
        let changed = bytes != *LOG;
        let cut = cut.map(|cut| cut.index(bytes.len()));
        bytes.truncate(cut.unwrap_or(bytes.len()));
        if let Ok((_, completeness)) = read(&bytes) {
            prop_assert_eq!(completeness.is_complete(), !changed && cut.is_none());
        }
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.mcap");
        std::fs::write(&path, &bytes).unwrap();
        let _ = recover(&path);
        let _ = riglog::info(&path);
        let _ = riglog::read_runs(&path);
    }

    #[test]
    fn any_bytes_after_the_magic_are_survived(noise in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut bytes = LOG[..8].to_vec();
        bytes.extend(noise);
        let _ = read(&bytes);
    }
}
