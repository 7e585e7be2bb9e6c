//! `rigd sim --withhold`: logs that tell nothing, labels that only fit their logs.

use std::os::unix::fs::PermissionsExt as _;

use assert_cmd::Command;

fn rigd() -> Command {
    Command::new(env!("CARGO_BIN_EXE_rigd"))
}

#[test]
fn logs_are_whole_and_tell_nothing_and_labels_fit_them() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("set");
    rigd()
        .args(["sim", "--withhold", "98765", "--cases", "2", "--family", "single", "--out"])
        .arg(&out)
        .assert()
        .success();
    for case in 0..2 {
        let log = out.join(format!("case-{case:04}.mcap"));
        let info = rigd().arg("info").arg(&log).arg("--json").assert().success().get_output().stdout.clone();
        let text = String::from_utf8(info).unwrap();
        let info: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(info["runs"].as_array().unwrap().len(), 12);
        assert_eq!(info["complete"], true);
        let label = out.join("sealed").join(format!("case-{case:04}.json"));
        assert_eq!(std::fs::metadata(&label).unwrap().permissions().mode() & 0o777, 0o600);
        let sealed: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&label).unwrap()).unwrap();
        let label: serde_json::Value = serde_json::from_str(sealed["label"].as_str().unwrap()).unwrap();
        let name = label["effects"][0]["name"].as_str().unwrap();
        for word in [name, "98765", "single", "undocumented"] {
            assert!(!text.contains(word), "{word} in {text}");
        }
    }
    // An existing log is never overwritten.
    rigd().args(["sim", "--withhold", "1", "--out"]).arg(&out).assert().code(1);
}

#[test]
fn withheld_data_needs_a_place() {
    rigd().args(["sim", "--withhold", "1"]).assert().code(2);
    rigd().args(["sim", "--cases", "3"]).assert().code(2);
}
