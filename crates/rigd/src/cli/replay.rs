//! `rigd replay`: recompute TE and backlash from logs.

use super::recorded::Recorded;
use super::{Exit, fail, print};
use crate::analysis::Analysis;
use crate::replay;
use crate::summary::{Origin, Summary};

/// Recompute TE and backlash from logs.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    recorded: Recorded,
    /// `1` for real time, `2` for twice that, `max` for as fast as it goes
    #[arg(long, default_value = "max", value_parser = speed)]
    speed: Speed,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy)]
struct Speed(Option<f64>);

fn speed(text: &str) -> Result<Speed, String> {
    if text == "max" {
        return Ok(Speed(None));
    }
    match text.parse::<f64>() {
        Ok(speed) if speed.is_finite() && speed > 0.0 => Ok(Speed(Some(speed))),
        _ => Err("a speed is a number > 0 (1 is real time), or max".into()),
    }
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    match run(args) {
        Ok(exit) => exit,
        Err(error) => fail(Exit::BadInput, error.as_ref()),
    }
}

fn run(args: &Args) -> Result<Exit, Box<dyn std::error::Error>> {
    let (model, backend) = replay::model_for(&args.recorded.logs[0], args.recorded.pair.as_deref())?;
    let mut analysis = Analysis::new(model);
    let mut replayed = replay::replay(&args.recorded.logs, &mut analysis, args.speed.0)?;
    if analysis.runs().is_empty() {
        replayed.incomplete.push("no recorded run: TE and backlash need a stretch of phase RECORD".into());
    }
    let summary = Summary::of(
        &analysis,
        Origin {
            schema: "rigd.replay/1",
            log: args.recorded.logs.iter().map(|path| path.display().to_string()).collect(),
            backend,
            losses: replayed.losses,
            ended: "done".into(),
            warnings: replayed.incomplete.clone(),
        },
    );
    if args.json {
        print(&serde_json::to_string_pretty(&summary)?);
    } else {
        print(summary.text().trim_start_matches('\n'));
    }
    for line in &replayed.incomplete {
        eprintln!("warning: {line}");
    }
    Ok(if replayed.incomplete.is_empty() { Exit::Done } else { Exit::Incomplete })
}
