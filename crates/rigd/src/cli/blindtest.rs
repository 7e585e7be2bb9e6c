//! `rigd blindtest`: withheld cases made, diagnosed and scored.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use super::{Exit, fail, print};
use blindtest::case_score::{CaseScore, score_case};
use blindtest::family::Family;
use blindtest::generate::Baselines;
use blindtest::score::Score;
use blindtest::seal::Sealed;
use blindtest::set::SetPlan;
use blindtest::{log, page, query, report};
use riglog::pair;

/// Make withheld cases on the simulated rig, diagnose them, and score what was said against what was wrong.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Number of cases; a whole set has 335
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    cases: u32,
    /// Seed of all draws
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only cases of one family [default: all of them, mixed]
    #[arg(long, value_enum)]
    family: Option<Family>,
    /// The gear pair [default: the built-in pair]
    #[arg(long, value_name = "FILE")]
    pair: Option<PathBuf>,
    /// Keep logs and labels here; cases that are there already are used as they are [default: a directory that is cleared away]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Cases under way at a time [default: one a core]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=256))]
    jobs: Option<u32>,
    /// Write the score as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the score as a page
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let pair_toml = match pair::load(args.pair.as_deref()) {
        Ok((text, _)) => text,
        Err(error) => return fail(Exit::BadInput, &error),
    };
    let (directory, temporary) = match &args.data {
        Some(directory) => (directory.clone(), false),
        None => (std::env::temp_dir().join(format!("rigd-blindtest-{}", uuid::Uuid::new_v4().simple())), true),
    };
    if let Err(error) = std::fs::create_dir_all(&directory) {
        eprintln!("error: --data {}: {error}; name a directory that you may write", directory.display());
        return Exit::BadInput;
    }
    let plan = SetPlan { seed: args.seed, family: args.family, pair_toml, baselines: Baselines::default() };
    let score = go_through(args, &plan, &directory, temporary);
    if temporary {
        // It was made for this test alone.
        let _ = std::fs::remove_dir_all(&directory);
    }
    print(&report::text(&score));
    conclude(args, &score)
}

/// Generates, diagnoses and scores every case, several at a time.
fn go_through(args: &Args, plan: &SetPlan, directory: &Path, temporary: bool) -> Score {
    let cases = args.cases as usize;
    let jobs = args.jobs.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), |n| n as usize);
    let progress = ProgressBar::new(cases as u64);
    if let Ok(style) = ProgressStyle::with_template("{pos}/{len} cases  {wide_bar}  {eta} left") {
        progress.set_style(style);
    }
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<(usize, Result<CaseScore, String>)>> = Mutex::default();
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(cases) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= cases {
                        break;
                    }
                    let result = one(plan, directory, number).map_err(|error| error.to_string());
                    if temporary {
                        let _ = std::fs::remove_file(log::path(directory, number));
                    }
                    results.lock().unwrap_or_else(PoisonError::into_inner).push((number, result));
                    progress.inc(1);
                }
            });
        }
    });
    progress.finish_and_clear();
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|(number, _)| *number);
    let (mut outcomes, mut failed) = (Vec::new(), Vec::new());
    for (number, result) in results {
        match result {
            Ok(outcome) => outcomes.push(outcome),
            Err(reason) => failed.push((number, reason)),
        }
    }
    Score::of(outcomes, failed)
}

fn one(plan: &SetPlan, directory: &Path, number: usize) -> Result<CaseScore, Box<dyn std::error::Error>> {
    let path = log::path(directory, number);
    if !path.exists() {
        plan.generate(directory, number)?;
    }
    // What the diagnosis shall do without is part of the question, not of the answer; nothing else of the label is used before it.
    let label = Sealed::open(directory, number, &log::sealed_hash(&path)?)?;
    let started = Instant::now();
    Ok(match query::diagnose(&path, &label.exclude) {
        Ok(answer) => score_case(&label, &answer, started.elapsed().as_secs_f64()),
        Err(error) => CaseScore::unanswered(&label, error.to_string()),
    })
}

fn conclude(args: &Args, score: &Score) -> Exit {
    let title = format!("Blind test: {} cases, seed {}", args.cases, args.seed);
    let write = |path: &Path, text: &str| {
        std::fs::write(path, text)
            .map_err(|error| eprintln!("error: {}: {error}; name a file that you may write", path.display()))
    };
    if let Some(path) = &args.html
        && write(path, &page::page(score, &title)).is_err()
    {
        return Exit::Failed;
    }
    if let Some(path) = &args.json {
        match serde_json::to_string_pretty(score) {
            Ok(text) if write(path, &text).is_ok() => {}
            Ok(_) => return Exit::Failed,
            Err(error) => return fail(Exit::Failed, &error),
        }
    }
    match score.failed.first() {
        None => Exit::Done,
        Some((case, reason)) => {
            eprintln!("error: {} of {} cases have no answer; case {case}: {reason}", score.failed.len(), score.cases);
            if score.failed.len() == score.cases { Exit::Failed } else { Exit::Incomplete }
        }
    }
}
