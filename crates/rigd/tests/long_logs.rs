//! Logs of long runs: split without losing a sample, audited, recovered, exported and read back, pruned, and ended in order while there is
//! still room on the disk.

mod support;

use std::path::Path;

use serde_json::Value;
use support::desk::Desk;

const RUN: &str =
    "run --load 5Nm --rpm 10 --revs 2 --direction both --rate 2kHz --profile @/rig.toml --out @/runs --json --quiet";

/// What replay, diagnosis, info and audit say of a log is what they say of each of its parts.
#[test]
fn the_parts_of_a_run_are_one_log_to_every_command() {
    let desk = Desk::new();
    desk.profile(|profile| profile.log.rotate_mb = 0.03);
    let ran = desk.json(0, RUN);
    let parts = desk.logs("runs");
    assert!(parts.len() >= 4, "{parts:?}");
    let last = parts.iter().find(|path| path.to_string_lossy().contains(".part3.")).expect("a third part");
    let replayed = desk.json(0, &format!("replay {} --json", last.display()));
    assert_eq!(replayed["te_hash"], ran["te_hash"]);
    assert_eq!(replayed["samples"], ran["samples"]);
    let all: Vec<String> = parts.iter().map(|path| path.display().to_string()).collect();
    let replayed = desk.json(0, &format!("replay {} --json", all.join(" ")));
    assert_eq!(replayed["te_hash"], ran["te_hash"], "all parts named are still one log");
    let info = desk.json(0, &format!("info {} --json", parts[0].display()));
    assert_eq!(info["parts"].as_array().map(Vec::len), Some(parts.len()));
    assert_eq!((info["runs"].as_array().map(Vec::len), &info["losses_in_file"]), (Some(2), &Value::from(0)));
    let audit = desk.json(0, &format!("audit {} --json", all.join(" ")));
    println!("audit of {} parts: {}", parts.len(), audit["logs"][0]);
    assert_eq!((audit["logs"].as_array().map(Vec::len), &audit["logs"][0]["losses"]), (Some(1), &Value::from(0)));
    assert_eq!(audit["logs"][0]["samples"], info["samples_in_file"]);

    // Without its second part it is no longer clean, and every command says so by its exit code.
    let second = parts.iter().find(|path| path.to_string_lossy().contains(".part2.")).expect("a second part");
    std::fs::remove_file(second).expect("it goes");
    let audit = desk.json(3, &format!("audit {} --json", parts[0].display()));
    assert!(audit["logs"][0]["losses"].as_u64().expect("a count") > 0);
    desk.json(3, &format!("info {} --json", parts[0].display()));
    desk.json(3, &format!("replay {} --json", parts[0].display()));
}

#[test]
fn an_exported_log_comes_back_with_the_same_te_bit_by_bit() {
    let desk = Desk::new();
    desk.profile(|_| {});
    let ran = desk.json(0, RUN);
    let log = desk.logs("runs").remove(0);
    std::fs::write(desk.at("pair.toml"), riglog::pair::DEFAULT_PAIR).expect("a file");
    let mut formats = vec!["csv"];
    if cfg!(feature = "parquet") {
        formats.push("parquet");
    }
    for format in formats {
        let told = desk.json(0, &format!("export {} --to {format} --out @/table.{format} --json", log.display()));
        assert_eq!((&told["rows"], &told["losses"]), (&ran["samples"], &Value::from(0)));
        for column in ["time_s", "theta1_rad", "load_nm", "speed_rpm", "te_rad", "time_unix_ns"] {
            assert!(told["columns"].as_array().expect("names").contains(&column.into()), "{column}");
        }
        let back = desk.json(
            0,
            &format!(
                "import @/table.{format} --pair @/pair.toml --counts-per-rev 7200000 --out @/{format}.mcap --json"
            ),
        );
        assert_eq!(back["te_hash"], ran["te_hash"], "{format}");
        // Never over what is there.
        assert_eq!(
            desk.run(&format!("export {} --to {format} --out @/table.{format}", log.display())).status.code(),
            Some(2)
        );
    }
    desk.json(0, &format!("export {} --to npy --out @/table.npy --json", log.display()));
    numpy_agrees(&desk.at("table.npy"), &desk.at("table.csv"));
}

/// Another reader of the array, where Python with NumPy is there.
fn numpy_agrees(npy: &Path, csv: &Path) {
    let Ok(python) = std::env::var("RIG_PYTHON") else {
        println!("skipped: RIG_PYTHON names no Python with NumPy");
        return;
    };
    let script = "import sys, numpy as np\n\
        a = np.load(sys.argv[1]); b = np.genfromtxt(sys.argv[2], delimiter=',', names=True, dtype=None, encoding=None)\n\
        assert len(a) == len(b) > 1000\n\
        for n in ('theta1_rad', 'theta2_rad', 'te_rad', 'input_counts', 'time_unix_ns'): assert (a[n] == b[n]).all(), n\n\
        assert np.abs(a['time_s'] - b['time_s']).max() < 1e-9\n\
        assert ((a['direction'] == 1) == (b['direction'] == 'ccw')).all() and set(a['direction']) == {1, -1}";
    let output = std::process::Command::new(python).args(["-c", script]).args([npy, csv]).output().expect("Python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_cut_log_is_recovered_and_its_end_is_told() {
    let desk = Desk::new();
    desk.profile(|_| {});
    desk.json(0, RUN);
    let log = desk.logs("runs").remove(0);
    let bytes = std::fs::read(&log).expect("a log");
    std::fs::write(&log, &bytes[..bytes.len() * 2 / 3]).expect("a cut log");
    let audit = desk.json(3, &format!("audit {} --json", log.display()));
    assert_eq!(audit["logs"][0]["findings"][0]["kind"], "truncation");
    // Unfinished logs are none that retention may take.
    let pruned = desk.json(0, "prune @/runs --keep-gb 0.000001 --delete --json");
    assert_eq!(pruned["chosen"].as_array().map(Vec::len), Some(0));
    let done = desk.json(3, &format!("recover {} --json", log.display()));
    assert!(done["logs"][0]["kept_messages"].as_u64().expect("a count") > 100, "{done}");
    assert_eq!(desk.json(0, "recover @/runs --json")["logs"][0]["already_complete"], true);
    assert_eq!(desk.json(0, &format!("audit {} --json", log.display()))["clean"], true);
    // Listed first, deleted only when told so.
    desk.json(0, "prune @/runs --keep-gb 0.000001 --json");
    assert!(log.exists());
    desk.json(0, "prune @/runs --keep-gb 0.000001 --delete --json");
    assert!(!log.exists());
    assert_eq!(desk.run("prune @/runs").status.code(), Some(2), "what to keep must be said");
    assert_eq!(desk.run("audit @/rig.toml").status.code(), Some(2));
}

#[test]
fn little_room_is_a_warning_and_less_is_a_stop_before_the_run() {
    let desk = Desk::new();
    desk.profile(|profile| (profile.log.warn_free_mb, profile.log.stop_free_mb) = (1e9, 0.0));
    let ran = desk.json(0, RUN);
    let log = ran["log"][0].as_str().expect("a log").to_owned();
    let events: Vec<String> = riglog::LogReader::open(&log)
        .expect("a log")
        .filter_map(|record| match record.expect("whole") {
            riglog::Record::Event { event, .. } if event.name == "disk" => Some(event.message),
            _ => None,
        })
        .collect();
    assert!(events.len() == 1 && events[0].contains("log.warn_free_mb"), "{events:?}");
    desk.profile(|profile| profile.log.stop_free_mb = 1e9);
    let refused = desk.run(RUN);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.contains("log.stop_free_mb") && said.contains("free space"), "{said}");
    assert_eq!(desk.logs("runs").len(), 1, "nothing was begun");
}
