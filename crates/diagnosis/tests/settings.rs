//! The settings: their page, and their place in a diagnosis.

#![allow(clippy::unwrap_used)] // helpers of tests may

use std::fmt::Write as _;
use std::path::Path;

use diagnosis::Settings;

/// What makes the page anew.
const UPDATE: &str = "UPDATE_SETTINGS";

fn page() -> String {
    let mut page = String::from(
        "# Settings of the diagnosis\n\n\
         Every number that can change a verdict, by step, as `crates/diagnosis/src/settings.rs` has it; a diagnosis carries those\n\
         that it was made with in its field `settings`. What *derived*, *resolution* and *calibrated* mean stands there. Made by\n\
         `UPDATE_SETTINGS=1 cargo test -p diagnosis --test settings`; do not edit.\n",
    );
    for (step, about, settings) in Settings::TABLE {
        let _ = write!(
            page,
            "\n## {step}\n\n{}\n\n| name | default | unit | kind | meaning |\n|---|---|---|---|---|\n",
            about.trim()
        );
        for setting in *settings {
            let unit = if setting.unit.is_empty() { "–" } else { setting.unit };
            let (kind, meaning) = (setting.kind, setting.meaning.trim());
            let _ = writeln!(page, "| `{}` | `{}` | {unit} | {kind} | {meaning} |", setting.name, setting.default);
        }
    }
    page
}

#[test]
fn the_page_says_what_the_code_has() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/theory/settings.md");
    if std::env::var_os(UPDATE).is_some() {
        std::fs::write(&path, page()).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap();
    assert!(written == page(), "docs/theory/settings.md is not made from these settings: {UPDATE}=1 makes it anew");
}

#[test]
fn every_setting_is_carried_as_a_number_under_its_name() {
    let carried = serde_json::to_value(Settings::default()).unwrap();
    assert_eq!(carried.as_object().unwrap().len(), Settings::TABLE.len());
    for (step, _, settings) in Settings::TABLE {
        assert_eq!(carried[step].as_object().unwrap().len(), settings.len(), "{step}");
        for setting in *settings {
            let value = &carried[step][setting.name];
            let numbers = value.as_array().cloned().unwrap_or_else(|| vec![value.clone()]);
            assert!(!numbers.is_empty() && numbers.iter().all(serde_json::Value::is_number), "{step}.{}", setting.name);
            // A line of a table.
            assert!(!setting.meaning.contains('\n') && !setting.meaning.trim().is_empty(), "{step}.{}", setting.name);
        }
    }
}
