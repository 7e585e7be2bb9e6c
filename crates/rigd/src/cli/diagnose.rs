//! `rigd diagnose`: where model and logs disagree, which effect causes it, and how far the gap shrinks with it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use diagnosis::{Diagnosis, GapError, Options};
use gearmodel::PairFile;

use super::{Exit, fail, print};
use diagnosis::logs::{Diagnosed, Logs, LogsError};

/// Residual over floor from which there is a gap that an answer is owed for.
const CLEAR_GAP: f64 = 1.2;

/// Say where model and logs disagree, which effect causes it, and how far the gap shrinks once that is added.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The logs of one campaign, in any order
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// The gear pair with its documented errors [default: the one in the earliest log]
    #[arg(long, value_name = "FILE")]
    pair: Option<PathBuf>,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
    /// Write the report as a page that needs nothing else
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write the pair with the found effects under [documented], for `rigd run --model` and `rigd verify --model`
    #[arg(long, value_name = "FILE")]
    write_model: Option<PathBuf>,
    /// Write the plan of the experiment that separates best what is still confused
    #[arg(long, value_name = "FILE")]
    plan_next: Option<PathBuf>,
    /// An effect that is there: always in the model; may be repeated
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    known: Vec<String>,
    /// An effect that is not; may be repeated
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    exclude: Vec<String>,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let options = Options { known: args.known.clone(), exclude: args.exclude.clone(), ..Options::default() };
    let answered = Logs::open(&args.logs, args.pair.as_deref()).and_then(|logs| {
        let diagnosed = logs.diagnose(&options)?;
        Ok((logs, diagnosed))
    });
    let (logs, diagnosed) = match answered {
        Ok(answered) => answered,
        // The logs are sound, but they cannot answer.
        Err(error @ LogsError::Gap(GapError::TooShort { .. })) => return fail(Exit::Incomplete, &error),
        Err(error) => return fail(Exit::BadInput, &error),
    };
    let Diagnosed { diagnosis, incomplete } = &diagnosed;
    print(&if args.json { diagnosis.to_json() } else { diagnosis::summary::text(diagnosis).trim_end().to_owned() });
    for line in logs.notes.iter().chain(incomplete) {
        eprintln!("warning: {line}");
    }
    if let Err(exit) = write_files(args, &logs.pair, diagnosis) {
        return exit;
    }
    if !incomplete.is_empty() {
        return Exit::Incomplete;
    }
    if unanswered(diagnosis) {
        eprintln!(
            "warning: there is a gap, and this data does not tell its cause: see the warnings and the next experiments"
        );
        return Exit::Incomplete;
    }
    Exit::Done
}

/// A clear gap of which nothing can be said, not even that it lies outside the library.
fn unanswered(diagnosis: &Diagnosis) -> bool {
    let gap = &diagnosis.gap;
    diagnosis.verdict.is_empty() && !diagnosis.warnings.is_empty() && gap.before_rad > CLEAR_GAP * gap.floor_rad
}

fn write_files(args: &Args, pair: &PairFile, diagnosis: &Diagnosis) -> Result<(), Exit> {
    if let Some(path) = &args.html {
        write("--html", path, &diagnosis::html::page(diagnosis))?;
    }
    if let Some(path) = &args.write_model {
        let (model, left_out) = match pair.with_found(&diagnosis.found) {
            Ok(model) => model,
            Err(error) => {
                eprintln!(
                    "error: --write-model {}: the pair with the found effects is no model: {error}",
                    path.display()
                );
                return Err(Exit::Failed);
            }
        };
        write("--write-model", path, &model_text(args, &model, diagnosis, &left_out))?;
        for line in left_out {
            eprintln!("warning: not written into the model: {line}");
        }
    }
    if let Some(path) = &args.plan_next {
        match diagnosis.next.iter().find(|experiment| !experiment.toml.is_empty()) {
            Some(experiment) => {
                let mut text = String::new();
                // Writing to a String cannot fail.
                let _ = writeln!(text, "# {}", experiment.action);
                if !experiment.separates.is_empty() {
                    let _ = writeln!(text, "# separates: {}", experiment.separates.join(", "));
                }
                let _ = writeln!(text, "# {:.0} min of rig time\n", experiment.minutes);
                text.push_str(&experiment.toml);
                write("--plan-next", path, &text)?;
            }
            None => eprintln!("--plan-next {}: not written: no experiment is needed", path.display()),
        }
    }
    Ok(())
}

/// The model's file with what was added and how sure that is.
fn model_text(args: &Args, model: &PairFile, diagnosis: &Diagnosis, left_out: &[String]) -> String {
    let mut text = String::from("# The nominal model with the effects that rigd diagnose found\n");
    for log in &args.logs {
        let _ = writeln!(text, "# in {}", log.display());
    }
    for found in &diagnosis.found.effects {
        let name = found.effect.name();
        let probability = diagnosis.effects.iter().find(|effect| effect.name == name).map_or(0.0, |e| e.probability);
        let _ = writeln!(text, "# {name}: p = {probability:.3}");
        for group in diagnosis.groups.iter().filter(|group| group.members.iter().any(|member| member == name)) {
            let _ = writeln!(
                text,
                "#   stands for one of {}, which this data cannot tell apart (p = {:.3} together)",
                group.members.join(", "),
                group.probability
            );
        }
    }
    if diagnosis.found.effects.is_empty() {
        text.push_str("# none: the nominal model suffices\n");
    }
    for line in left_out {
        let _ = writeln!(text, "# left out: {line}");
    }
    text.push('\n');
    text.push_str(&model.to_toml());
    text
}

fn write(option: &str, path: &Path, text: &str) -> Result<(), Exit> {
    std::fs::write(path, text).map_err(|error| {
        eprintln!("error: {option} {}: {error}; name a file that you may write", path.display());
        Exit::Failed
    })
}
