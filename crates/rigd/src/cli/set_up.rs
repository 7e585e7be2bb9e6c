//! What `rigd jog` and `rigd brake` share: the rig, the log, what is refused, and how they end.

use std::path::PathBuf;

use riglog::RunMetadata;
use serde_json::{Value, json};

use super::on_rig::on_rig;
use super::run::seconds;
use super::{Exit, fail, print};
use crate::profile::Profile;
use crate::run::connected_rig::ConnectedRig;
use crate::run::registry::Running;
use crate::run::session::{self, LogHead, Outcome, RunConfig};
use crate::run::set_up::{LARGEST_RPM, RATE_HZ};
use crate::run::stop_reason::StopReason;
use riglog::pair;

/// Options of both.
#[derive(Debug, clap::Args)]
pub struct Common {
    /// End after so many seconds, whoever forgot it; Ctrl-C and `rigd stop` end it before
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds)]
    pub seconds: f64,
    /// The rig [default: the simulated rig]
    #[arg(long, value_name = "FILE")]
    profile: Option<PathBuf>,
    /// Seed of the simulated rig
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Directory of the logs
    #[arg(long, value_name = "DIR", default_value = "set-up")]
    logs: PathBuf,
    /// Who does it, for the log
    #[arg(long, default_value = "")]
    operator: String,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    pub json: bool,
    /// No progress line
    #[arg(long)]
    quiet: bool,
}

/// What is refused before anything is opened, moved or written.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The shaft turns only with consent.
    #[error("the shaft turns only with consent: clear the rig, keep hands off it, and say --turn")]
    NoConsent,
    /// Faster than is safe beside open teeth.
    #[error("--rpm {speed_rpm} rpm is over the limit {LARGEST_RPM} rpm (of set-up); lower it, or use rigd run")]
    TooFast {
        /// What was asked for, rpm of the driver.
        speed_rpm: f64,
    },
}

/// What is done, in words of the log and of the answer.
pub struct Task<'a> {
    /// `jog` or `brake`, with its conditions, for the log's name.
    pub name: String,
    /// Told before anything is opened.
    pub opening: String,
    /// For the log.
    pub conditions: RunMetadata,
    /// Schema of the JSON answer.
    pub schema: &'static str,
    /// Figures of the answer, once it is done.
    pub figures: &'a dyn Fn() -> Value,
    /// The same in words.
    pub words: &'a dyn Fn() -> String,
}

/// Reads the profile and checks its drivers.
///
/// # Errors
/// Bad input.
pub fn load(common: &Common) -> Result<Profile, Box<dyn std::error::Error>> {
    let profile = match &common.profile {
        Some(path) => Profile::load(path)?,
        None => Profile::simulated(),
    };
    session::check_drivers(&profile)?;
    Ok(profile)
}

/// Does it, and says how it ended.
pub fn execute(
    common: &Common,
    profile: Profile,
    task: &Task<'_>,
    body: impl AsyncFnOnce(&mut ConnectedRig) -> (Option<StopReason>, Vec<String>),
) -> Exit {
    let (pair_toml, model) = match pair::load(None) {
        Ok(pair) => pair,
        Err(error) => return fail(Exit::BadInput, &error),
    };
    if let Err(error) = std::fs::create_dir_all(&common.logs) {
        eprintln!("error: --logs {}: {error}; name a directory that you may write", common.logs.display());
        return Exit::BadInput;
    }
    if !common.json {
        print(&match profile.name.as_str() {
            "sim" => "SIMULATED RIG: real registers and frames, emulated hardware".to_owned(),
            name => format!("rig '{name}'"),
        });
        print(&task.opening);
    }
    let path = session::free_path(&common.logs, &task.name);
    let head = LogHead { operator: common.operator.clone(), note: task.name.clone(), pair_toml, plan_toml: None };
    let config = RunConfig {
        path: path.clone(),
        profile,
        model,
        head,
        conditions: task.conditions.clone(),
        quiet: common.quiet || common.json,
    };
    let running = Running::register();
    let outcome = on_rig(config, common.seed, RATE_HZ, body);
    drop(running);
    match outcome {
        Ok(outcome) => conclude(common, task, &path, &outcome),
        Err(error) => {
            eprintln!("error: {error}");
            Exit::Failed
        }
    }
}

fn conclude(common: &Common, task: &Task<'_>, path: &std::path::Path, outcome: &Outcome) -> Exit {
    let ended = outcome.stop_reason.as_ref().map_or_else(|| "done".into(), ToString::to_string);
    if common.json {
        let mut answer = json!({
            "schema": task.schema, "log": path.display().to_string(), "ended": ended, "troubles": outcome.troubles,
        });
        if let (Value::Object(answer), Value::Object(figures)) = (&mut answer, (task.figures)()) {
            answer.extend(figures);
        }
        print(&answer.to_string());
    } else {
        print(&(task.words)());
    }
    for trouble in &outcome.troubles {
        eprintln!("error: {trouble}");
    }
    match &outcome.stop_reason {
        None if outcome.troubles.is_empty() => Exit::Done,
        None => Exit::Halted,
        Some(reason @ StopReason::Operator) => {
            eprintln!("{reason}; the motor is off, the brake at zero");
            Exit::Stopped
        }
        Some(reason) => fail(Exit::Halted, reason),
    }
}
