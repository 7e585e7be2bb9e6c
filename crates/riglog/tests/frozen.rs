//! Logs of the first format version stay readable for ever.
//!
//! If a test in this file fails, do not change the file or the numbers: there are recordings like it on people's disks.

// A test ends at the first surprise.
#![allow(clippy::unwrap_used)]

mod common;

use std::path::PathBuf;

use common::{Plan, messages, read};
use riglog::{Completeness, Record, read_runs};

/// What `fixtures/logs/v1.mcap` was made of.
const V1: Plan = Plan { samples: 400, idle: 50, rate_hz: 1_000, revolutions: 0.1, loads_nm: &[5.0], lose: 3 };

fn fixture(name: &str) -> PathBuf {
    common::root().join("fixtures/logs").join(name)
}

#[test]
fn a_log_of_version_1_gives_the_numbers_that_it_always_gave() {
    let path = fixture("v1.mcap");
    let (records, completeness) = read(&path);
    assert_eq!(completeness, Completeness::Complete);
    assert_eq!(messages(&records), 174);
    let (mut samples, mut sums) = (0, (0i64, 0i64));
    for record in &records {
        if let Record::Angles { batch, .. } = record {
            for (_, input, output) in batch.samples().unwrap() {
                samples += 1;
                sums = (sums.0.wrapping_mul(31) + input, sums.1.wrapping_mul(31) + output);
            }
        }
    }
    assert_eq!((samples, sums), (950, (3783747754271420448, -84993210275363661)));
    let runs = read_runs(&path).unwrap();
    assert_eq!(runs.iter().map(|run| (run.samples, run.losses)).collect::<Vec<_>>(), [(400, 3), (400, 0)]);
    assert_eq!(runs[1].theta1_rad[399].to_bits(), 4596430297016014083);
    assert_eq!(runs[1].theta2_rad[399].to_bits(), 4600792626241739437);
}

#[test]
fn its_killed_twin_is_a_prefix_of_it() {
    let (whole, _) = read(&fixture("v1.mcap"));
    let (cut, completeness) = read(&fixture("v1_cut.mcap"));
    assert!(matches!(completeness, Completeness::Truncated { .. }), "{completeness}");
    assert!(cut.len() > 10 && whole.starts_with(&cut));
}

#[test]
fn what_is_written_today_holds_the_same_records() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    common::write(&path, &V1).unwrap();
    // Sines differ in their last bits from system to system; counts do not.
    let but_te =
        |path| read(path).0.into_iter().filter(|record| !matches!(record, Record::Te { .. })).collect::<Vec<_>>();
    assert_eq!(but_te(&path), but_te(&fixture("v1.mcap")));
}
