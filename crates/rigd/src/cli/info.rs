//! `rigd info`: what is in a log.

use std::fmt::Write as _;
use std::path::PathBuf;

use riglog::LogInfo;
use serde_json::{Value, json};

use super::{Exit, fail, print};
use crate::summary::name;

/// Say what is in a log.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The log; of one that was split, any part
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let info = match riglog::info(&args.log) {
        Ok(info) => info,
        Err(error) => return fail(Exit::BadInput, &error),
    };
    print(&if args.json { json(&info).to_string() } else { text(&info) });
    let complete = info.completeness.is_complete();
    if !complete {
        eprintln!("warning: {}: {}", args.log.display(), info.completeness);
    }
    if info.losses_in_file > 0 {
        eprintln!("warning: {}: {} samples are missing", args.log.display(), info.losses_in_file);
    }
    if complete && info.losses_in_file == 0 { Exit::Done } else { Exit::Incomplete }
}

fn json(info: &LogInfo) -> Value {
    json!({
        "schema": "rigd.info/1",
        "log": info.path.display().to_string(),
        "parts": info.parts.iter().map(|part| part.display().to_string()).collect::<Vec<_>>(),
        "bytes": info.bytes,
        "library": info.library,
        "metadata": info.metadata,
        "attachments": info.attachments.iter().map(|a| json!({"name": a.name, "media_type": a.media_type, "bytes": a.bytes})).collect::<Vec<_>>(),
        "channels": info.channels.iter().map(|c| json!({"topic": c.topic, "schema": c.schema, "messages": c.messages})).collect::<Vec<_>>(),
        "runs": info.runs.iter().map(|run| json!({
            "direction": name(run.direction),
            "load_nm": run.load_nm,
            "speed_rpm": run.speed_rpm,
            "revolutions": run.revolutions,
            "samples": run.samples,
            "losses": run.losses,
        })).collect::<Vec<_>>(),
        "samples": info.samples,
        "losses": info.losses,
        "samples_in_file": info.samples_in_file,
        "losses_in_file": info.losses_in_file,
        "complete": info.completeness.is_complete(),
        "duration_s": info.duration_s,
    })
}

fn text(info: &LogInfo) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_text(info, &mut out);
    out.trim_end().to_owned()
}

fn write_text(info: &LogInfo, out: &mut String) -> std::fmt::Result {
    writeln!(
        out,
        "{}  {:.2} MB, {:.1} s, by {}",
        info.path.display(),
        info.bytes as f64 * 1e-6,
        info.duration_s,
        info.library
    )?;
    if info.parts.len() > 1 {
        let names = info.parts.iter().filter_map(|part| part.file_name()).map(|name| name.to_string_lossy());
        writeln!(out, "{} parts: {}", info.parts.len(), names.collect::<Vec<_>>().join(", "))?;
    }
    writeln!(out, "{}", info.completeness)?;
    for (record, entries) in &info.metadata {
        writeln!(out, "\n{record}")?;
        for (key, value) in entries.iter().filter(|(_, value)| !value.is_empty()) {
            writeln!(out, "  {key:<24} {value}")?;
        }
    }
    writeln!(out, "\nattachments")?;
    for attachment in &info.attachments {
        writeln!(out, "  {:<24} {} bytes", attachment.name, attachment.bytes)?;
    }
    writeln!(out, "\nchannels")?;
    for channel in &info.channels {
        writeln!(out, "  {:<24} {:>9} {}", channel.topic, channel.messages, channel.schema)?;
    }
    writeln!(out, "\nruns")?;
    for run in &info.runs {
        let revolutions = run.revolutions.map_or("?".into(), |count| format!("{count:.2}"));
        writeln!(
            out,
            "  {:<4} {:>6} N·m {:>7} rpm {revolutions:>7} revolutions {:>10} samples {:>6} lost",
            name(run.direction),
            run.load_nm,
            run.speed_rpm,
            run.samples,
            run.losses
        )?;
    }
    Ok(())
}
