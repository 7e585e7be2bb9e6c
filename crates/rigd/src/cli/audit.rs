//! `rigd audit`: checksums, sequence and clock of logs.

use std::path::PathBuf;

use riglog::{Audit, LogParts};
use serde_json::{Value, json};

use super::{Exit, fail, print};

/// Check logs: every checksum, every sample's and message's number, both clocks
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The logs; the parts of one that was split are taken as one
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let audits: Result<Vec<Audit>, _> =
        LogParts::group(&args.logs).and_then(|logs| logs.iter().map(riglog::audit).collect());
    let audits = match audits {
        Ok(audits) => audits,
        Err(error) => return fail(Exit::BadInput, &error),
    };
    let clean = audits.iter().all(Audit::is_clean);
    if args.json {
        let logs: Vec<Value> = audits.iter().map(json).collect();
        print(&json!({"schema": "rigd.audit/1", "clean": clean, "logs": logs}).to_string());
    } else {
        audits.iter().for_each(|audit| print(&text(audit)));
    }
    if clean { Exit::Done } else { Exit::Incomplete }
}

fn json(audit: &Audit) -> Value {
    json!({
        "log": audit.parts.first().map(|path| path.display().to_string()),
        "parts": audit.parts.iter().map(|path| path.display().to_string()).collect::<Vec<_>>(),
        "bytes": audit.bytes,
        "messages": audit.messages,
        "first_sample": audit.first_sample,
        "samples": audit.samples,
        "losses": audit.losses,
        "losses_told": audit.losses_told,
        "repeated": audit.repeated,
        "device_s": audit.device_s,
        "drift_ppm": audit.drift_ppm,
        "largest_delay_ms": audit.largest_delay_ms,
        "clean": audit.is_clean(),
        "findings": audit.findings.iter().map(|finding| json!({
            "kind": finding.kind.name(),
            "file": finding.path.display().to_string(),
            "what": finding.what,
        })).collect::<Vec<_>>(),
        "more_findings": audit.more_findings,
    })
}

fn text(audit: &Audit) -> String {
    let name = audit.parts.first().map(|path| path.display().to_string()).unwrap_or_default();
    let parts = if audit.parts.len() > 1 { format!(" in {} parts", audit.parts.len()) } else { String::new() };
    let drift = audit.drift_ppm.map_or("not told under a minute".into(), |ppm| format!("{ppm:+.1} ppm"));
    let mut lines = vec![
        format!("{name}{parts}: {}", if audit.is_clean() { "clean" } else { "NOT CLEAN" }),
        format!(
            "  {} samples over {:.1} s, {} lost, {} repeated; {} messages, {:.2} MB",
            audit.samples,
            audit.device_s,
            audit.losses,
            audit.repeated,
            audit.messages,
            audit.bytes as f64 * 1e-6
        ),
        format!("  clock: drift of the device {drift}, largest delay {:.1} ms", audit.largest_delay_ms),
    ];
    for finding in &audit.findings {
        let file = finding.path.file_name().unwrap_or_default().to_string_lossy();
        lines.push(format!("  {:<10} {file}: {}", finding.kind.name(), finding.what));
    }
    if audit.more_findings > 0 {
        lines.push(format!("  and {} more", audit.more_findings));
    }
    lines.join("\n")
}
