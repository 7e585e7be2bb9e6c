//! Tables of angles as logs: what comes back from a log is what stood in the table, to half a count.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use gearmodel::{Direction, NominalModel};
use serde_json::Value;
use tempfile::TempDir;

/// Rows a turn.
const ROWS: u32 = 5000;
const HEAD: &str = "time_s,theta1_rad,theta2_rad,load_nm,speed_rpm,direction\n";

fn rigd(arguments: &[&str]) -> Output {
    Command::cargo_bin("rigd").expect("the binary").args(arguments).output().expect("it runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

struct Desk {
    directory: TempDir,
    model: NominalModel,
}

impl Desk {
    fn new() -> Self {
        let directory = TempDir::new().expect("a temporary directory");
        let (text, model) = riglog::pair::load(None).expect("the built-in pair");
        std::fs::write(directory.path().join("pair.toml"), text).expect("a pair");
        Self { directory, model }
    }

    fn path(&self, name: &str) -> String {
        self.directory.path().join(name).display().to_string()
    }

    fn write(&self, name: &str, text: &str) -> String {
        let path = self.path(name);
        std::fs::write(&path, text).expect("a file");
        path
    }

    fn import(&self, table: &str, more: &[&str]) -> Output {
        let pair = self.path("pair.toml");
        rigd(&[&["import", table, "--pair", &pair], more].concat())
    }

    /// Two turns a sense at 10 N·m, TE as the model predicts; times begin at `start_s` of each sense.
    fn rows(&self, starts_s: [f64; 2]) -> Vec<(Direction, f64, f64, f64)> {
        let mut rows = Vec::new();
        for (direction, start_s) in Direction::BOTH.into_iter().zip(starts_s) {
            for n in 0..2 * ROWS {
                let theta1 = direction.sign() * TAU * (f64::from(n) + 0.25) / f64::from(ROWS);
                let theta2 = self.model.pair.theta2(theta1) + self.model.te_rad(theta1, direction, 10.0);
                rows.push((direction, start_s + f64::from(n) * 1e-3, theta1, theta2));
            }
        }
        rows
    }

    fn table(&self, rows: &[(Direction, f64, f64, f64)]) -> String {
        let mut text = HEAD.to_owned();
        for (direction, time_s, theta1, theta2) in rows {
            writeln!(text, "{time_s:.3},{theta1},{theta2},10,12,{direction}").expect("a String");
        }
        text
    }
}

#[test]
fn a_log_gives_back_the_table_and_replays_to_the_same_bits() {
    let desk = Desk::new();
    let rows = desk.rows([0.0, 60.0]);
    let table = desk.write("drive.csv", &desk.table(&rows));
    let output = desk.import(&table, &["--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(summary["schema"], "rigd.import/1");
    assert_eq!(summary["samples"], 4 * ROWS);
    assert_eq!(summary["losses"], 0);

    let log = desk.path("drive.mcap");
    assert_eq!(summary["log"][0], log.as_str());
    let half_rad = 0.5 * TAU / f64::from(1 << 26);
    let bound_rad = summary["quantisation"]["te_bound_rad"].as_f64().expect("a number");
    assert!(summary["quantisation"]["angle_largest_rad"].as_f64().expect("a number") <= half_rad * (1.0 + 1e-6));
    let runs = riglog::read_runs(&log).expect("a rig log");
    assert_eq!(runs.len(), 2);
    let mut expected = rows.iter();
    for run in &runs {
        assert_eq!((run.load_nm, run.speed_rpm, run.losses), (10.0, 12.0, 0));
        for ((time_s, theta1), theta2) in run.time_s.iter().zip(&run.theta1_rad).zip(&run.theta2_rad) {
            let (direction, t, a, b) = expected.next().expect("a row for each sample");
            assert_eq!(run.direction, *direction);
            assert!((time_s - t).abs() < 1e-9);
            assert!((theta1 - a).abs() <= half_rad * (1.0 + 1e-6) && (theta2 - b).abs() <= half_rad * (1.0 + 1e-6));
            let te = |theta1: f64, theta2: f64| theta2 - desk.model.pair.theta2(theta1);
            assert!((te(*theta1, *theta2) - te(*a, *b)).abs() <= bound_rad * (1.0 + 1e-6));
        }
    }
    assert!(expected.next().is_none());

    let replay = rigd(&["replay", &log, "--json"]);
    assert_eq!(replay.status.code(), Some(0), "{}", said(&replay));
    let replay: Value = serde_json::from_slice(&replay.stdout).expect("JSON");
    for key in ["te_hash", "te", "backlash", "runs", "samples", "losses"] {
        assert_eq!(summary[key], replay[key], "{key}");
    }
    for sense in ["ccw", "cw"] {
        let residual = replay["te"][sense]["residual_rms_rad"].as_f64().expect("a number");
        assert!(residual < 2.0 * bound_rad, "{sense}: {residual}");
    }
    let info: Value = serde_json::from_slice(&rigd(&["info", &log, "--json"]).stdout).expect("JSON");
    assert_eq!(info["complete"], true);
    assert_eq!(info["metadata"]["rig.run"]["backend"], "import");
}

#[test]
fn other_tables_of_the_same_rows_give_the_same_log() {
    let desk = Desk::new();
    let rows = desk.rows([0.0, 60.0]);
    let hash = |name: &str, text: &str, more: &[&str]| {
        let output = desk.import(&desk.write(name, text), &[&["--json"], more].concat());
        assert_eq!(output.status.code(), Some(0), "{name}: {}", said(&output));
        let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (summary["te_hash"].clone(), summary["warnings"].clone())
    };
    let (plain, warnings) = hash("plain.csv", &desk.table(&rows), &[]);
    assert_eq!(warnings, Value::Array(Vec::new()));

    // Columns in another order, another delimiter, a comment, a column more, Unix times, conditions on the command line.
    let mut text = "# measured in the morning\ndirection;temperature_c;theta2_rad;time_s;theta1_rad\n".to_owned();
    for (direction, time_s, theta1, theta2) in &rows {
        let time_ns = 1_763_766_000_000_000_000 + (time_s * 1e3).round() as u64 * 1_000_000;
        let (s, ns) = (time_ns / 1_000_000_000, time_ns % 1_000_000_000);
        writeln!(text, "{direction};21.5;{theta2};{s}.{ns:09};{theta1}").expect("a String");
    }
    let (other, warnings) = hash("other.csv", &text, &["--load", "10Nm", "--rpm", "12"]);
    assert_eq!(other, plain);
    assert!(warnings[0].as_str().is_some_and(|warning| warning.contains("temperature_c")), "{warnings}");

    // Each sense with a clock of its own.
    let (anew, warnings) = hash("anew.csv", &desk.table(&desk.rows([0.0, 0.0])), &[]);
    assert_eq!(anew, plain);
    assert!(warnings[0].as_str().is_some_and(|warning| warning.contains("row 10002")), "{warnings}");
}

#[test]
fn rows_without_an_angle_are_losses() {
    let desk = Desk::new();
    let mut text = HEAD.to_owned();
    for (n, (direction, time_s, theta1, theta2)) in desk.rows([0.0, 60.0]).iter().enumerate() {
        let theta2 = if n % 1000 == 500 { String::new() } else { theta2.to_string() };
        let theta1 = if n % 1000 == 700 { "NaN".into() } else { theta1.to_string() };
        writeln!(text, "{time_s:.3},{theta1},{theta2},10,12,{direction}").expect("a String");
    }
    let output = desk.import(&desk.write("gaps.csv", &text), &["--json"]);
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(summary["losses"], 40);
    let replay = rigd(&["replay", &desk.path("gaps.mcap"), "--json"]);
    assert_eq!(replay.status.code(), Some(3), "{}", said(&replay));
    let replay: Value = serde_json::from_slice(&replay.stdout).expect("JSON");
    assert_eq!((&replay["losses"], &replay["te_hash"]), (&summary["losses"], &summary["te_hash"]));
}

#[test]
fn a_coarser_log_says_so() {
    let desk = Desk::new();
    let table = desk.write("coarse.csv", &desk.table(&desk.rows([0.0, 60.0])));
    let output = desk.import(&table, &["--json", "--counts-per-rev", "360000", "--out", &desk.path("other.mcap")]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let bound = summary["quantisation"]["angle_bound_rad"].as_f64().expect("a number");
    assert!((bound - 0.5 * TAU / 360_000.0).abs() < 1e-15);
    assert!(Path::new(&desk.path("other.mcap")).exists() && !Path::new(&desk.path("coarse.mcap")).exists());
}

#[test]
fn bad_tables_are_refused_by_row_column_and_value_and_leave_nothing() {
    let desk = Desk::new();
    let steady = |n: u32| format!("{}.0,{},{},10,12,ccw\n", n, f64::from(n) * 0.1, f64::from(n) * 0.1);
    let ten: String = (0..10).map(steady).collect();
    let with = |row: &str| format!("{HEAD}{ten}{row}\n");
    let cases: [(String, &[&str]); 15] = [
        (with("soon,1,1,10,12,ccw"), &["row 12", "time_s", "'soon'"]),
        (with("-1,1,1,10,12,ccw"), &["row 12", "time_s", "'-1'"]),
        (with("10,one,1,10,12,ccw"), &["row 12", "theta1_rad", "'one'", "rad"]),
        (with("10,1,inf,10,12,ccw"), &["row 12", "theta2_rad", "'inf'"]),
        (with("10,1,1,-3,12,ccw"), &["row 12", "load_nm", "'-3'"]),
        (with("10,1,1,10,,ccw"), &["row 12", "speed_rpm", "rpm"]),
        (with("10,1,1,10,12,up"), &["row 12", "direction", "'up'", "ccw or cw"]),
        (with("9,1,1,10,12,ccw"), &["row 12", "time_s", "9 s", "sort"]),
        (with("10,7.2,1,10,12,ccw"), &["row 12", "theta1_rad", "7.2", "unwrap"]),
        (with("10,1,1"), &["12", "fields"]),
        (format!("{HEAD}0,0,0,10,12,cw\n1,1,1,10,12,cw\n"), &["rows 2 to 3", "theta1_rad", "cw", "sign"]),
        (format!("{HEAD}0,0,0,10.1,12,ccw\n1,1,1,10.2,12,ccw\n"), &["row 3", "load_nm", "10.2", "--load"]),
        (format!("{HEAD}0,1e9,1e9,10,12,ccw\n"), &["row 2", "theta1_rad", "1000000000", "--counts-per-rev"]),
        (HEAD.to_owned(), &["no row"]),
        ("time_s,theta1_rad,load_nm\n0,0,0\n".to_owned(), &["theta2_rad", "time_s, theta1_rad, load_nm"]),
    ];
    for (text, needles) in cases {
        let table = desk.write("bad.csv", &text);
        let output = desk.import(&table, &[]);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("bad.csv") && !said.contains("panicked"), "{said}");
        for needle in needles {
            assert!(said.contains(needle), "no '{needle}' in: {said}");
        }
        let left: Vec<_> = std::fs::read_dir(desk.directory.path()).expect("a directory").collect();
        assert_eq!(left.len(), 2, "{said}: {left:?}");
    }
}

#[test]
fn bad_usage_is_refused_before_anything_is_written() {
    let desk = Desk::new();
    let table = desk.write("drive.csv", &desk.table(&desk.rows([0.0, 60.0])));
    let refuse = |table: &str, more: &[&str], needles: &[&str]| {
        let output = desk.import(table, more);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        for needle in needles {
            assert!(said.contains(needle), "no '{needle}' in: {said}");
        }
        assert!(!Path::new(&desk.path("drive.mcap")).exists() && !said.contains("panicked"));
    };
    refuse("/nowhere/drive.csv", &[], &["/nowhere/drive.csv", "No such file"]);
    refuse("/nowhere/drive.xlsx", &[], &[".csv or .parquet"]);
    refuse(&table, &["--load", "10"], &["no unit", "10Nm"]);
    refuse(&table, &["--counts-per-rev", "7"], &["2^26"]);
    refuse(&table, &["--direction", "up"], &["ccw"]);
    let taken = desk.write("taken.mcap", "something else");
    refuse(&table, &["--out", &taken], &["taken.mcap", "exists already"]);
    assert_eq!(std::fs::read_to_string(&taken).expect("still there"), "something else");
    let broken = desk.write("broken.toml", "kind = ");
    let output = rigd(&["import", &table, "--pair", &broken]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("line 1"));
    assert_eq!(rigd(&["import", &table]).status.code(), Some(2), "a log without its pair could not be analysed");
}

#[cfg(not(feature = "parquet"))]
#[test]
fn parquet_names_the_feature_to_build_with() {
    let desk = Desk::new();
    let output = desk.import(&desk.write("drive.parquet", "PAR1"), &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("--features parquet"), "{}", said(&output));
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_gives_the_same_log_as_csv() {
    use std::sync::Arc;

    use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::parser::parse_message_type;

    let desk = Desk::new();
    let rows = desk.rows([0.0, 60.0]);
    let schema = "message rows { REQUIRED DOUBLE time_s; REQUIRED DOUBLE theta1_rad; OPTIONAL DOUBLE theta2_rad; \
                  REQUIRED BYTE_ARRAY direction (UTF8); }";
    let schema = Arc::new(parse_message_type(schema).expect("a schema"));
    let table = desk.path("columns.parquet");
    let file = std::fs::File::create(&table).expect("a file");
    let mut writer = SerializedFileWriter::new(file, schema, Arc::default()).expect("a writer");
    let mut group = writer.next_row_group().expect("a group");
    let columns: [Vec<f64>; 3] = [
        rows.iter().map(|row| row.1).collect(),
        rows.iter().map(|row| row.2).collect(),
        rows.iter().map(|row| row.3).collect(),
    ];
    for (index, values) in columns.iter().enumerate() {
        let levels = vec![1; values.len()];
        let mut column = group.next_column().expect("a column").expect("one more");
        let levels = (index == 2).then_some(levels.as_slice());
        column.typed::<DoubleType>().write_batch(values, levels, None).expect("written");
        column.close().expect("closed");
    }
    let senses: Vec<ByteArray> = rows.iter().map(|row| ByteArray::from(row.0.as_str())).collect();
    let mut column = group.next_column().expect("a column").expect("one more");
    column.typed::<ByteArrayType>().write_batch(&senses, None, None).expect("written");
    column.close().expect("closed");
    group.close().expect("closed");
    writer.close().expect("closed");

    let hash = |table: &str, more: &[&str]| {
        let output = desk.import(table, &[&["--json"], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        serde_json::from_slice::<Value>(&output.stdout).expect("JSON")["te_hash"].clone()
    };
    let csv = hash(&desk.write("drive.csv", &desk.table(&rows)), &[]);
    assert_eq!(hash(&table, &["--load", "10Nm", "--rpm", "12"]), csv);
}
