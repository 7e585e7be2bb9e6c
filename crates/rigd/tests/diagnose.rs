//! `rigd diagnose` and `rigd verify` as a person uses them: the simulated rig with an error that its model does not know.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;

use assert_cmd::Command;
use riglog::proto::Phase;
use riglog::{LogReader, LogWriter, Record, WriterOptions};
use serde_json::Value;
use tempfile::TempDir;

fn rigd(arguments: &[&str]) -> Output {
    Command::cargo_bin("rigd").expect("the binary").args(arguments).output().expect("it runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a name")
}

/// Runs the simulated rig; the log.
fn run(directory: &Path, extra: &[&str]) -> PathBuf {
    let usual = ["run", "--load", "2Nm,10Nm", "--rpm", "12", "--revs", "4", "--rate", "1kHz", "--json", "--quiet", "--out"];
    let output = rigd(&[&usual[..], &[text(directory)], extra].concat());
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).expect("one object");
    PathBuf::from(summary["log"][0].as_str().expect("a log"))
}

/// Two logs of one rig with an eccentric output encoder, the second begun after the first.
fn campaign() -> &'static (TempDir, PathBuf) {
    static CAMPAIGN: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    CAMPAIGN.get_or_init(|| {
        let directory = TempDir::new().expect("a directory");
        let log = run(directory.path(), &["--undocumented", "gear2_eccentricity"]);
        (directory, log)
    })
}

fn diagnosed(arguments: &[&str]) -> Value {
    let output = rigd(&[&["diagnose", "--json"], arguments].concat());
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    serde_json::from_slice(&output.stdout).expect("one object")
}

/// Names of the verdict, members of groups among them.
fn named(diagnosis: &Value) -> Vec<String> {
    let item = |item: &Value| match item {
        Value::String(name) => vec![name.clone()],
        group => group["members"].as_array().expect("members").iter().map(|m| m.as_str().expect("a name").into()).collect(),
    };
    diagnosis["verdict"].as_array().expect("a verdict").iter().flat_map(item).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"))
}

/// Cuts a log in two where `share` of its messages are written.
fn cut(log: &Path, share: f64) -> [PathBuf; 2] {
    let records: Vec<Record> = LogReader::open(log).expect("a log").map(|record| record.expect("whole")).collect();
    let messages = records.iter().filter(|r| matches!(r, Record::Angles { .. } | Record::State { .. })).count();
    let middle = (share * messages as f64) as usize;
    let paths = [log.with_extension("a.mcap"), log.with_extension("b.mcap")];
    let mut writers = paths.each_ref().map(|path| {
        LogWriter::create(path, WriterOptions::new("rigd test")).expect("a log")
    });
    let mut written = 0;
    let mut last_state = None;
    for record in records {
        match record {
            Record::Metadata { name, map } => {
                for writer in &mut writers {
                    match name.as_str() {
                        "rig.encoders" => writer.encoders(&riglog::EncoderMetadata::from_map(&map).expect("encoders")).expect("written"),
                        _ => {}
                    }
                }
            }
            Record::Attachment { name, media_type, data, .. } => {
                for writer in &mut writers {
                    writer.attach(0, &name, &media_type, &data).expect("written");
                }
            }
            Record::Angles { log_time_ns, batch, .. } => {
                writers[usize::from(written >= middle)].angles(log_time_ns, &batch).expect("written");
                written += 1;
            }
            Record::State { log_time_ns, state, .. } => {
                if written >= middle && last_state.is_none() {
                    last_state = Some(());
                }
                // Both have all states: the first one's stretches without samples are empty.
                for writer in &mut writers {
                    writer.state(log_time_ns, &state).expect("written");
                }
                written += 1;
            }
            _ => {}
        }
    }
    for writer in writers {
        writer.finish().expect("finished");
    }
    let _ = Phase::Record;
    paths
}
