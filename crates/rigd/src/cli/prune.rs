//! `rigd prune`: retention. Which old logs would go, and, when told so, their deletion.
//!
//! A log goes as a whole, with its parts and its picture. What is being written, cannot be read, or lacks its end stays: it may be all there
//! is of a run.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use riglog::{LogError, LogParts};
use serde_json::{Value, json};

use super::{Exit, fail, print};

/// List old logs, and delete them when told so
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Directory of the logs
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Keep what is younger, days
    #[arg(long, value_name = "DAYS", value_parser = positive)]
    keep_days: Option<f64>,
    /// Keep the youngest logs up to this size together, GB
    #[arg(long, value_name = "GB", value_parser = positive)]
    keep_gb: Option<f64>,
    /// Delete; without this nothing is touched
    #[arg(long)]
    delete: bool,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if f64::is_finite(value) && value > 0.0 => Ok(value),
        _ => Err("a number > 0".into()),
    }
}

/// A log and what retention looks at.
#[derive(Debug, Clone, PartialEq)]
struct Kept {
    files: Vec<PathBuf>,
    bytes: u64,
    /// When its last part was written.
    written: SystemTime,
    /// Why it must stay.
    stays: Option<String>,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    if args.keep_days.is_none() && args.keep_gb.is_none() {
        eprintln!("error: say what is to be kept: --keep-days 90, --keep-gb 200, or both");
        return Exit::BadInput;
    }
    let logs = match list(&args.directory) {
        Ok(logs) => logs,
        Err(error) => return fail(Exit::BadInput, &error),
    };
    let age = args.keep_days.map(|days| Duration::from_secs_f64(days * 86_400.0));
    let room = args.keep_gb.map(|gb| (gb * 1e9) as u64);
    let gone = choose(&logs, SystemTime::now(), age, room);
    let mut failed = false;
    for log in &gone {
        if args.delete
            && let Err(error) = delete(log)
        {
            failed = true;
            eprintln!("error: {error}");
        }
    }
    report(args, &logs, &gone);
    if failed { Exit::Failed } else { Exit::Done }
}

/// The logs of a directory, youngest first.
fn list(directory: &Path) -> Result<Vec<Kept>, LogError> {
    let list = |source| LogError::Io { action: "list", path: directory.to_owned(), source };
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(list)? {
        let path = entry.map_err(list)?.path();
        if path.extension().is_some_and(|extension| extension == "mcap") && path.is_file() {
            paths.push(path);
        }
    }
    paths.sort();
    let mut logs: Vec<Kept> = Vec::new();
    for path in paths {
        if logs.iter().any(|log| log.files.contains(&path)) {
            continue;
        }
        let parts = LogParts::of(&path);
        let files: Vec<PathBuf> =
            parts.as_ref().map_or(vec![path.clone()], |parts| parts.paths().map(Path::to_owned).collect());
        let facts: Vec<_> = files.iter().filter_map(|file| std::fs::metadata(file).ok()).collect();
        let stays = match parts {
            Err(error) => Some(error.to_string()),
            Ok(_) => files.iter().find_map(|file| unfinished(file)),
        };
        logs.push(Kept {
            bytes: facts.iter().map(std::fs::Metadata::len).sum(),
            // Where the file system does not say, the log counts as new.
            written: facts
                .iter()
                .map(|facts| facts.modified().unwrap_or_else(|_| SystemTime::now()))
                .max()
                .unwrap_or_else(SystemTime::now),
            files,
            stays,
        });
    }
    logs.sort_by(|a, b| (b.written, &b.files).cmp(&(a.written, &a.files)));
    Ok(logs)
}

/// Why a file must not go.
fn unfinished(path: &Path) -> Option<String> {
    let ended = || -> std::io::Result<bool> {
        let mut file = File::open(path)?;
        file.seek(SeekFrom::End(-(MAGIC.len() as i64)))?;
        let mut end = [0; MAGIC.len()];
        file.read_exact(&mut end)?;
        Ok(end == MAGIC)
    };
    let why = || format!("{} has no end: it is being written, or `rigd recover` gives it one", path.display());
    (!ended().unwrap_or(false)).then(why)
}

/// What stands at the end of every whole MCAP file.
const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

/// What goes: of those that may, what is older than `age` or does not fit into `room` behind what is younger.
fn choose(logs: &[Kept], now: SystemTime, age: Option<Duration>, room: Option<u64>) -> Vec<Kept> {
    let mut kept_bytes = 0u64;
    let mut gone = Vec::new();
    for log in logs {
        let old = age.is_some_and(|age| now.duration_since(log.written).is_ok_and(|since| since > age));
        let full = room.is_some_and(|room| kept_bytes.saturating_add(log.bytes) > room);
        if log.stays.is_none() && (old || full) {
            gone.push(log.clone());
        } else {
            kept_bytes = kept_bytes.saturating_add(log.bytes);
        }
    }
    gone
}

fn delete(log: &Kept) -> Result<(), LogError> {
    // The first part last: as long as it is there, the others are found again.
    for path in log.files.iter().rev() {
        std::fs::remove_file(path).map_err(|source| LogError::Io { action: "delete", path: path.clone(), source })?;
        // Not every log has a picture.
        let _ = std::fs::remove_file(path.with_extension("svg"));
    }
    Ok(())
}

fn report(args: &Args, logs: &[Kept], gone: &[Kept]) {
    let bytes: u64 = gone.iter().map(|log| log.bytes).sum();
    if args.json {
        let names = |log: &Kept| log.files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>();
        let chosen: Vec<Value> = gone.iter().map(|log| json!({"files": names(log), "bytes": log.bytes})).collect();
        let stay: Vec<Value> = logs
            .iter()
            .filter_map(|log| log.stays.as_ref().map(|why| json!({"files": names(log), "why": why})))
            .collect();
        let told = json!({"schema": "rigd.prune/1", "deleted": args.delete, "logs": logs.len(), "chosen": chosen, "bytes": bytes, "unfinished": stay});
        print(&told.to_string());
        return;
    }
    for log in gone {
        let parts =
            if log.files.len() > 1 { format!(" and {} more parts", log.files.len() - 1) } else { String::new() };
        print(&format!("{}{parts}  {:.2} MB", log.files[0].display(), log.bytes as f64 * 1e-6));
    }
    for why in logs.iter().filter_map(|log| log.stays.as_ref()) {
        eprintln!("kept: {why}");
    }
    let done = if args.delete { "deleted" } else { "would go; --delete deletes them" };
    print(&format!("{} of {} logs, {:.2} MB, {done}", gone.len(), logs.len(), bytes as f64 * 1e-6));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(name: &str, days_old: u64, bytes: u64, stays: bool) -> Kept {
        let written = SystemTime::UNIX_EPOCH + Duration::from_secs(1_790_000_000 - days_old * 86_400);
        Kept { files: vec![name.into()], bytes, written, stays: stays.then(|| "unfinished".into()) }
    }

    #[test]
    fn age_and_room_choose_the_oldest_and_never_what_is_unfinished() {
        let now = SystemTime::UNIX_EPOCH + Duration::from_secs(1_790_000_000);
        let logs = [log("a", 1, 50, false), log("b", 5, 30, true), log("c", 10, 30, false), log("d", 40, 10, false)];
        let names = |gone: Vec<Kept>| gone.iter().map(|log| log.files[0].display().to_string()).collect::<String>();
        let days = |days: u64| Some(Duration::from_secs(days * 86_400));
        assert_eq!(names(choose(&logs, now, days(30), None)), "d");
        assert_eq!(names(choose(&logs, now, days(3), None)), "cd");
        assert_eq!(names(choose(&logs, now, None, Some(90))), "c");
        assert_eq!(names(choose(&logs, now, None, Some(1))), "acd");
        assert_eq!(names(choose(&logs, now, days(1), Some(1000))), "cd");
        assert_eq!(names(choose(&logs, now, None, Some(1000))), "");
    }
}
