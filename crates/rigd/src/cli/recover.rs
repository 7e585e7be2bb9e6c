//! `rigd recover`: give logs that a killed run left behind their end.

use std::path::{Path, PathBuf};

use riglog::{Completeness, LogError, Recovery};
use serde_json::{Value, json};

use super::{Exit, fail, print};

/// Give logs that a killed run left behind their end.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Logs, or directories of logs
    #[arg(required = true, value_name = "LOG|DIR")]
    logs: Vec<PathBuf>,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

type Outcome = (PathBuf, Result<Recovery, LogError>);

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let mut outcomes: Vec<Outcome> = Vec::new();
    for path in &args.logs {
        if path.is_dir() {
            match riglog::recover_directory(path) {
                Ok(logs) => outcomes.extend(logs),
                Err(error) => return fail(Exit::BadInput, &error),
            }
        } else {
            outcomes.push((path.clone(), riglog::recover(path)));
        }
    }
    if args.json {
        let logs: Vec<Value> = outcomes.iter().map(|(path, outcome)| json(path, outcome)).collect();
        print(&json!({"schema": "rigd.recover/1", "logs": logs}).to_string());
    } else {
        outcomes.iter().for_each(|(path, outcome)| print(&text(path, outcome)));
    }
    let mut exit = Exit::Done;
    for (_, outcome) in &outcomes {
        match outcome {
            Ok(done) if done.found.is_complete() => {}
            Ok(_) => exit = Exit::Incomplete,
            // What another process writes needs no end yet.
            Err(error @ LogError::Locked { .. }) => {
                eprintln!("warning: {error}");
            }
            Err(error) => return fail(Exit::BadInput, error),
        }
    }
    exit
}

fn json(path: &Path, outcome: &Result<Recovery, LogError>) -> Value {
    match outcome {
        Ok(done) => json!({
            "log": path.display().to_string(),
            "already_complete": done.already_complete,
            "kept_messages": done.kept_messages,
            "dropped_bytes": done.dropped_bytes,
            "found": done.found.to_string(),
            "damaged": matches!(done.found, Completeness::Damaged { .. }),
        }),
        Err(error) => json!({"log": path.display().to_string(), "error": error.to_string()}),
    }
}

fn text(path: &Path, outcome: &Result<Recovery, LogError>) -> String {
    let path = path.display();
    match outcome {
        Ok(done) if done.already_complete && done.found.is_complete() => {
            format!("{path}: whole, {} messages; left as it is", done.kept_messages)
        }
        Ok(done) if done.already_complete => format!("{path}: has its end and is left as it is; {}", done.found),
        Ok(done) => format!(
            "{path}: recovered, {} messages kept, {} bytes dropped; {}",
            done.kept_messages, done.dropped_bytes, done.found
        ),
        Err(error) => format!("{path}: {error}"),
    }
}
