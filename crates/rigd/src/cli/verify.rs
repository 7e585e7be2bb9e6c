//! `rigd verify`: logs against a model, run by run and sense by sense, within limits.

use std::fmt::Write as _;
use std::path::PathBuf;

use diagnosis::verify::{Verified, VerifiedRow};
use serde_json::json;

use super::{Exit, fail, print};
use diagnosis::logs::Logs;

/// Compare logs with a model: the residual of every run against the rig's repeatability.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The logs of one campaign, in any order
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// The model, as `rigd diagnose --write-model` saves it, or any pair.toml [default: the one in the earliest log]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Largest residual of a run that passes, in multiples of its repeatability
    #[arg(long, value_name = "RATIO", default_value_t = 1.5, value_parser = positive)]
    limit: f64,
    /// Largest residual of a run that passes in any case, in µrad RMS
    #[arg(long, value_name = "URAD", value_parser = positive)]
    within_urad: Option<f64>,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("a number > 0 is needed".to_owned()),
    }
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let verified = Logs::open(&args.logs, args.model.as_deref()).and_then(|logs| {
        let (verified, incomplete) = logs.verify()?;
        Ok((logs.notes, verified, incomplete))
    });
    let (notes, verified, incomplete) = match verified {
        Ok(verified) => verified,
        Err(error) => return fail(Exit::BadInput, &error),
    };
    for line in notes.iter().chain(&incomplete) {
        eprintln!("warning: {line}");
    }
    let Some(verified) = verified else {
        eprintln!("error: no recorded run: there is nothing to compare with the model");
        return Exit::Incomplete;
    };
    let failed = verified.runs.iter().filter(|row| !passes(args, row)).count();
    if args.json {
        let mut object = json!({
            "schema": "rigd.verify/1",
            "log": args.logs.iter().map(|path| path.display().to_string()).collect::<Vec<_>>(),
            "model": args.model.as_ref().map(|path| path.display().to_string()),
            "limit": args.limit,
            "within_rad": args.within_urad.map(|urad| urad * 1e-6),
            "passed": failed == 0,
        });
        if let (Some(object), Ok(serde_json::Value::Object(fields))) =
            (object.as_object_mut(), serde_json::to_value(&verified))
        {
            object.extend(fields);
        }
        print(&object.to_string());
    } else {
        print(&table(args, &verified));
    }
    if failed > 0 {
        eprintln!(
            "{failed} of {} runs are not within the limits: rigd diagnose says what the model lacks",
            verified.runs.len()
        );
    }
    if failed == 0 && incomplete.is_empty() { Exit::Done } else { Exit::Incomplete }
}

fn passes(args: &Args, row: &VerifiedRow) -> bool {
    row.ratio.is_some_and(|ratio| ratio <= args.limit)
        || args.within_urad.is_some_and(|urad| row.residual_rms_rad <= urad * 1e-6)
}

fn table(args: &Args, verified: &Verified) -> String {
    let mut text =
        String::from("sense  load N.m  speed rpm  revs   mean urad  residual urad rms  floor urad rms  ratio\n");
    let mut line = |row: &VerifiedRow, verdict: &str| {
        let number = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{:<5} {:>9} {:>10} {:>5.1} {:>11.2} {:>18.2} {:>15} {:>6}  {verdict}",
            row.direction,
            number(row.load_nm, 2),
            number(row.speed_rpm, 2),
            row.revolutions,
            row.mean_rad * 1e6,
            row.residual_rms_rad * 1e6,
            number(row.floor_rms_rad.map(|rad| rad * 1e6), 2),
            number(row.ratio, 2),
        );
    };
    for row in &verified.runs {
        line(
            row,
            if passes(args, row) {
                "within"
            } else if row.ratio.is_none() {
                "cannot say"
            } else {
                "BEYOND"
            },
        );
    }
    for row in &verified.directions {
        line(row, "all");
    }
    let limits = match args.within_urad {
        Some(urad) => format!("limits: {} x floor, or {urad} urad rms", args.limit),
        None => format!("limit: {} x floor", args.limit),
    };
    text + &limits
}
