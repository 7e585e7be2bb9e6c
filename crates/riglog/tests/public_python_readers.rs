//! The public Python `mcap` package reads what is written here; `scripts/check_log.py` uses nothing else.

// A test ends at the first surprise.
#![allow(clippy::unwrap_used)]

mod common;

use std::{path::Path, process::Command};

use common::SMALL;

/// A Python with the packages that the script needs; `None` where none is found.
fn python() -> Option<String> {
    let local = common::root().join(".venv/bin/python");
    let candidates =
        [std::env::var("PYTHON").ok(), Some(local.to_string_lossy().into_owned()), Some("python3".to_owned())];
    candidates.into_iter().flatten().find(|python| {
        let imports = Command::new(python).args(["-c", "import mcap.reader, mcap_protobuf.decoder, numpy"]).output();
        imports.is_ok_and(|output| output.status.success())
    })
}

fn check(python: &str, log: &Path, flags: &[&str]) -> Result<String, String> {
    let script = common::root().join("scripts/check_log.py");
    let output = Command::new(python).arg(script).arg(log).args(flags).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
}

#[test]
fn every_public_reader_reads_every_log() {
    let Some(python) = python() else {
        println!("skipped: no Python with mcap, mcap-protobuf-support and numpy (set PYTHON or make .venv)");
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let statistics = common::write(&path, &SMALL).unwrap();
    let said = check(&python, &path, &["--recompute"]).unwrap();
    assert!(said.contains(&format!("{} messages, {} samples", statistics.messages, statistics.samples)), "{said}");
    let compared: u64 = said.split(", ").last().unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(compared >= 4 * 900, "{said}");

    // A killed writer's log, as it is and finalised.
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
    check(&python, &path, &["--truncated"]).unwrap();
    check(&python, &path, &[]).unwrap_err();
    riglog::recover(&path).unwrap();
    check(&python, &path, &["--recompute"]).unwrap();

    // The script is no rubber stamp: one bit in the middle is found.
    let mut bad = whole;
    let middle = bad.len() / 2;
    bad[middle] ^= 1;
    std::fs::write(&path, &bad).unwrap();
    check(&python, &path, &["--recompute"]).unwrap_err();
}
