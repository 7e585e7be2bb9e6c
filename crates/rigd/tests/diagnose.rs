//! `rigd diagnose` and `rigd verify` as a person uses them: the simulated rig with an error that its model does not know.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;

use assert_cmd::Command;
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
    let usual =
        ["run", "--load", "2Nm,10Nm", "--rpm", "12", "--revs", "4", "--rate", "1kHz", "--json", "--quiet", "--out"];
    let output = rigd(&[&usual[..], &[text(directory)], extra].concat());
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).expect("one object");
    PathBuf::from(summary["log"][0].as_str().expect("a log"))
}

/// A log of a rig whose gear 2 sits off its documented centre.
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
        group => {
            group["members"].as_array().expect("members").iter().map(|m| m.as_str().expect("a name").into()).collect()
        }
    };
    diagnosis["verdict"].as_array().expect("a verdict").iter().flat_map(item).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"))
}

/// Cuts a log in two where `share` of its samples are written, as a rotating writer would.
fn cut(log: &Path, directory: &Path, share: f64) -> [PathBuf; 2] {
    let records: Vec<Record> = LogReader::open(log).expect("a log").map(|record| record.expect("whole")).collect();
    let batches = records.iter().filter(|record| matches!(record, Record::Angles { .. })).count();
    let middle = (share * batches as f64) as usize;
    let paths = ["first.mcap", "second.mcap"].map(|name| directory.join(name));
    let mut writers =
        paths.each_ref().map(|path| LogWriter::create(path, WriterOptions::new("rigd test")).expect("a log"));
    let mut written = 0;
    for record in records {
        if let Record::Angles { log_time_ns, publish_time_ns, batch } = &record {
            let part = usize::from(written >= middle);
            writers[part].angles(*log_time_ns, *publish_time_ns, batch).expect("written");
            written += 1;
        }
        // Both parts say what was run and with what.
        for writer in &mut writers {
            match &record {
                Record::State { log_time_ns, publish_time_ns, state } => {
                    writer.state(*log_time_ns, *publish_time_ns, state).expect("written");
                }
                Record::Encoders(encoders) => writer.encoders(encoders).expect("written"),
                Record::Attachment { name, media_type, data } => {
                    writer.attach(0, name, media_type, data).expect("written");
                }
                _ => {}
            }
        }
    }
    for writer in writers {
        writer.finish().expect("finished");
    }
    paths
}

fn same(one: &Value, other: &Value, share: f64) {
    assert_eq!(named(one), named(other));
    for figure in ["before_rad", "after_rad", "floor_rad"] {
        let (a, b) = (number(&one["gap"][figure]), number(&other["gap"][figure]));
        assert!((a / b - 1.0).abs() < share, "{figure}: {a} {b}");
    }
}

#[test]
fn the_effect_is_named_with_its_size_and_the_gap_shrinks() {
    let (_, log) = campaign();
    let found = diagnosed(&[text(log)]);
    let names = named(&found);
    assert!(names.contains(&"gear2_eccentricity".to_owned()), "{names:?}");
    assert!(number(&found["gap"]["closed"]) > 0.98);
    let effect = found["effects"].as_array().expect("effects").iter().find(|e| e["name"] == "gear2_eccentricity");
    let parameters = &effect.expect("the effect")["parameters"];
    // What the simulated rig puts there: (-5, 10) µm.
    for (name, expected) in [("dx_mm", -0.005), ("dy_mm", 0.010)] {
        assert!((number(&parameters[name]["value"]) - expected).abs() < 2e-4, "{parameters}");
    }
    let summary = rigd(&["diagnose", text(log)]);
    let said = String::from_utf8_lossy(&summary.stdout).into_owned();
    assert!(
        said.contains("gap ") && said.contains("why   eccentricity of gear 2") && said.contains("gear2_eccentricity"),
        "{said}"
    );
}

#[test]
fn neither_the_order_of_logs_nor_a_cut_through_one_changes_the_answer() {
    let (directory, log) = campaign();
    let whole = diagnosed(&[text(log)]);
    // 0.4: within a run.
    let [first, second] = cut(log, directory.path(), 0.4);
    let in_order = diagnosed(&[text(&first), text(&second)]);
    let backwards = diagnosed(&[text(&second), text(&first)]);
    assert_eq!(in_order, backwards);
    assert_eq!(in_order, diagnosed(&[text(&first), text(&second), text(&first)]), "a log named twice counts once");
    same(&whole, &in_order, 0.01);
}

#[test]
fn a_written_model_explains_a_fresh_run_and_the_old_one_does_not() {
    let (directory, log) = campaign();
    let model = directory.path().join("model.toml");
    diagnosed(&[text(log), "--write-model", text(&model)]);
    let written = std::fs::read_to_string(&model).expect("a model");
    assert!(written.contains("# gear2_eccentricity: p = 1.000") && written.contains("e2_mm"), "{written}");
    let fresh_directory = TempDir::new().expect("a directory");
    let extra = ["--undocumented", "gear2_eccentricity", "--seed", "7", "--model", text(&model)];
    let fresh = run(fresh_directory.path(), &extra);
    let verified = |extra: &[&str]| {
        let output = rigd(&[&["verify", "--json", text(&fresh)], extra].concat());
        let object: Value = serde_json::from_slice(&output.stdout).expect("one object");
        (output.status.code(), object)
    };
    // The fresh log carries the model that it was run with.
    for extra in [&[][..], &["--model", text(&model)]] {
        let (code, object) = verified(extra);
        assert_eq!(
            (code, &object["passed"], &object["schema"]),
            (Some(0), &true.into(), &"rigd.verify/1".into()),
            "{object}"
        );
        assert_eq!(object["runs"].as_array().map(Vec::len), Some(4));
    }
    let old = directory.path().join("old.toml");
    std::fs::write(&old, riglog::pair::DEFAULT_PAIR).expect("a pair");
    let (code, object) = verified(&["--model", text(&old)]);
    assert_eq!((code, &object["passed"]), (Some(3), &false.into()));
    assert!(object["runs"].as_array().expect("runs").iter().all(|row| number(&row["ratio"]) > 10.0), "{object}");
    // A limit of one's own.
    assert_eq!(verified(&["--model", text(&old), "--within-urad", "500"]).0, Some(0));
    let shrunken = diagnosed(&[text(&fresh)]);
    assert!(!named(&shrunken).contains(&"gear2_eccentricity".to_owned()), "{}", shrunken["verdict"]);
    let unchanged = diagnosed(&[text(&fresh), "--pair", text(&old)]);
    assert!(number(&shrunken["gap"]["before_rad"]) < 0.1 * number(&unchanged["gap"]["before_rad"]));
}

#[test]
fn an_effect_that_depends_on_speed_is_documented_as_a_table() {
    let directory = TempDir::new().expect("a directory");
    let log = run(directory.path(), &["--undocumented", "time_skew"]);
    let pair = directory.path().join("pair.toml");
    let text_of = |dt_s: &str| format!("{}\n[documented.time_skew]\ndt_s = {dt_s}\n", riglog::pair::DEFAULT_PAIR);
    // What the simulated rig puts there: 60 µs.
    std::fs::write(&pair, text_of("6e-5")).expect("a pair");
    let known = diagnosed(&[text(&log), "--pair", text(&pair)]);
    assert!(!named(&known).contains(&"time_skew".to_owned()), "{}", known["verdict"]);
    assert!(number(&known["gap"]["before_rad"]) < 1.1 * number(&known["gap"]["floor_rad"]), "{}", known["gap"]);
    // Half of it documented: the other half is found and added to the table.
    std::fs::write(&pair, text_of("3e-5")).expect("a pair");
    let model = directory.path().join("model.toml");
    let half = diagnosed(&[text(&log), "--pair", text(&pair), "--write-model", text(&model)]);
    assert!(named(&half).contains(&"time_skew".to_owned()), "{}", half["verdict"]);
    let file = gearmodel::PairFile::parse(&std::fs::read_to_string(&model).expect("a model")).expect("a pair");
    let [table] = &file.effects["time_skew"][..] else { panic!("one table, not {:?}", file.effects) };
    assert!(
        matches!(table["dt_s"], gearmodel::effect::Stated::Number(dt_s) if (dt_s - 6e-5).abs() < 2e-6),
        "{table:?}"
    );
}

#[test]
fn known_and_excluded_effects_are_taken_at_their_word() {
    let (_, log) = campaign();
    let excluded = diagnosed(&[text(log), "--exclude", "gear2_eccentricity"]);
    assert!(excluded["effects"].as_array().expect("effects").iter().all(|e| e["name"] != "gear2_eccentricity"));
    let known = diagnosed(&[text(log), "--known", "time_skew"]);
    assert!(named(&known).contains(&"gear2_eccentricity".to_owned()));
}

#[test]
fn a_report_and_the_next_plan_are_written() {
    let (directory, log) = campaign();
    let (page, plan) = (directory.path().join("report.html"), directory.path().join("next.toml"));
    diagnosed(&[text(log), "--html", text(&page), "--plan-next", text(&plan)]);
    let page = std::fs::read_to_string(page).expect("a page");
    assert!(page.starts_with("<!doctype html>") && page.contains("gear2_eccentricity"));
    let plan: toml::Table = std::fs::read_to_string(plan).expect("a plan").parse().expect("TOML");
    let runs = plan["runs"].as_array().expect("runs");
    assert!(!runs.is_empty() && runs.iter().all(|run| run["revolutions"].as_integer() > Some(0)));
}

#[test]
fn what_cannot_be_diagnosed_is_refused_with_what_to_do() {
    let (directory, log) = campaign();
    let refused = |arguments: &[&str], code: i32, words: &[&str]| {
        let output = rigd(arguments);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(output.stdout.is_empty() && words.iter().all(|word| said.contains(word)), "{said}");
    };
    let log = text(log);
    refused(&["diagnose", "no-such.mcap"], 2, &["no-such.mcap"]);
    refused(&["diagnose", log, "--known", "gear3"], 2, &["gear3", "gear2_eccentricity"]);
    refused(&["diagnose", log, "--known", "slip", "--exclude", "slip"], 2, &["slip", "both"]);
    let pair = directory.path().join("wrong.toml");
    std::fs::write(&pair, format!("{}\n[documented.time_skew]\ndt = 1\n", riglog::pair::DEFAULT_PAIR)).expect("a pair");
    refused(&["diagnose", log, "--pair", text(&pair)], 2, &["wrong.toml", "time_skew", "`dt`", "`dt_s`"]);
    refused(&["verify", log, "--model", text(&pair)], 2, &["wrong.toml", "`dt_s`"]);
    let other = directory.path().join("other.toml");
    std::fs::write(&other, "kind = \"circular\"\nmodule_mm = 2.0\nteeth = [30, 30]\n").expect("a pair");
    let out = directory.path().join("never");
    refused(
        &["run", "--load", "5Nm", "--rpm", "5", "--model", text(&other), "--out", text(&out)],
        2,
        &["other.toml", "built-in pair", "--pair"],
    );
    assert!(!out.exists());
    // Sound, but hardly any motion: the question cannot be answered.
    let table = directory.path().join("short.csv");
    let rows: String = (0..200)
        .map(|n| format!("{},{},{},5,5,ccw\n", f64::from(n) * 1e-3, f64::from(n) * 1e-3, f64::from(n) * 1e-3))
        .collect();
    std::fs::write(&table, format!("time_s,theta1_rad,theta2_rad,load_nm,speed_rpm,direction\n{rows}"))
        .expect("a table");
    let short = directory.path().join("short.mcap");
    let imported = rigd(&["import", text(&table), "--pair", text(&other), "--out", text(&short)]);
    assert_eq!(imported.status.code(), Some(0), "{}", said(&imported));
    refused(&["diagnose", text(&short)], 3, &["at least 60"]);
}
