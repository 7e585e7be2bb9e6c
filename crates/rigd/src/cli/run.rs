//! `rigd run`: drive the rig, record, and compute TE and backlash.

use std::path::{Path, PathBuf};

use riglog::LogError;
use tokio::task::LocalSet;

use super::simulator::Simulator;
use super::{Exit, fail, print};
use crate::clock::Clock;
use crate::plot;
use crate::profile::Profile;
use crate::quantity::{RATE, SPEED, TORQUE};
use crate::run::admission::{Terms, admit};
use crate::run::job::Job;
use crate::run::keys::Keys;
use crate::run::observer::NoObserver;
use crate::run::plan::RunPlan;
use crate::run::registry::Running;
use crate::run::run_job::Policy;
use crate::run::senses::Senses;
use crate::run::session::{self, JobSpec, Links, LogHead, Outcome, RunConfig};
use crate::run::stop::StopRequests;
use crate::simulated::{self, PlantSpec};
use crate::summary::{Origin, Summary};
use riglog::pair;

/// Slower slip than this makes powder brakes stick and slip, rpm.
const STICK_SLIP_RPM: f64 = 10.0;

/// Drive the rig, record a log, and compute TE and backlash.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Load at the driven gear: 10Nm, 5Nm,10Nm or 5..15Nm:5
    #[arg(long, value_name = "TORQUE", value_parser = loads)]
    load: Loads,
    /// Speed of the driver: 5 or 5rpm
    #[arg(long, value_name = "RPM", value_parser = |text: &str| SPEED.parse(text))]
    rpm: f64,
    /// Senses of rotation, in this order
    #[arg(long, value_enum, default_value = "both")]
    direction: Senses,
    /// Whole revolutions of the driver to record in each sense
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    revs: u32,
    /// Sampling of both encoders
    #[arg(long, value_name = "RATE", default_value = "10kHz", value_parser = |text: &str| RATE.parse(text))]
    rate: f64,
    /// The gear pair and its documented errors; the simulated rig is built to it [default: the built-in pair]
    #[arg(long, value_name = "FILE")]
    pair: Option<PathBuf>,
    /// A model that `rigd diagnose --write-model` saved: the rig is compared with it in place of --pair
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The rig [default: the simulated rig]
    #[arg(long, value_name = "FILE")]
    profile: Option<PathBuf>,
    /// Calibration that `rigd calibrate` wrote, in place of the profile's
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Directory of the logs
    #[arg(long, value_name = "DIR", default_value = "runs")]
    out: PathBuf,
    /// Seed of the simulated rig [default: 1]
    #[arg(long)]
    seed: Option<u64>,
    /// Simulated rig: `max` runs as fast as it can, `1` in real time over pseudo-terminals [default: max]
    #[arg(long, value_enum, conflicts_with = "profile")]
    time_scale: Option<TimeScale>,
    /// Simulated rig: an effect that the model does not know; may be repeated. `list` names them
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',')]
    undocumented: Vec<String>,
    /// Wait so long for a device that was unplugged, then do the interrupted run again [default: end the run]
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = seconds)]
    reconnect: f64,
    /// Drive a servo that has no watchdog of its own; somebody must stay at the emergency stop
    #[arg(long)]
    accept_no_watchdog: bool,
    /// Who runs it, for the log
    #[arg(long, default_value = "")]
    operator: String,
    /// What it is for, for the log
    #[arg(long, default_value = "")]
    note: String,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
    /// No progress line
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, Clone)]
struct Loads(Vec<f64>);

fn loads(text: &str) -> Result<Loads, crate::quantity::QuantityError> {
    TORQUE.parse_list(text).map(Loads)
}

/// A time of 0 s to a day.
pub fn seconds(text: &str) -> Result<f64, String> {
    let value: f64 =
        text.trim_end_matches('s').trim().parse().map_err(|_| format!("'{text}' is no time in s; write 30"))?;
    if (0.0..=86_400.0).contains(&value) { Ok(value) } else { Err(format!("{text} is not within 0 and 86400 s")) }
}

/// How fast the simulated rig runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum TimeScale {
    /// Real time.
    #[value(name = "1")]
    Real,
    /// As fast as it can.
    Max,
}

/// What is refused before anything is opened, moved or written.
#[derive(Debug, thiserror::Error)]
enum Refusal {
    #[error("--rate {rate_hz} Hz does not fit the clock of a counter: use 10 Hz to 1 MHz")]
    Rate { rate_hz: f64 },
    #[error("--undocumented '{name}' is not an effect of the simulated rig; it has: {known}")]
    Effect { name: String, known: String },
    #[error(
        "--model {model}: its gears are not those of the simulated rig, {pair}; give the pair that the model was made from with --pair"
    )]
    OtherGears { model: PathBuf, pair: String },
    #[error("{option} is the simulated rig's, and profile '{profile}' has real ports; leave it out")]
    SimulatedOnly { option: &'static str, profile: String },
    #[error("profile '{profile}' mixes port \"sim\" with real ports; all three devices are simulated, or none")]
    MixedPorts { profile: String },
}

/// What was read and checked before anything moves.
struct Prepared {
    config: RunConfig,
    plan: RunPlan,
    /// The simulated rig, where that is the rig.
    spec: Option<PlantSpec>,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    if args.undocumented.iter().any(|name| name == "list") {
        print(&simulated::describe_undocumented());
        return Exit::Done;
    }
    let prepared = match prepare(args) {
        Ok(prepared) => prepared,
        Err(error) => return fail(Exit::BadInput, error.as_ref()),
    };
    if let Err(error) = std::fs::create_dir_all(&args.out) {
        eprintln!("error: --out {}: {error}; name a directory that you may write", args.out.display());
        return Exit::BadInput;
    }
    recover(&args.out);
    if !args.json {
        announce(args, &prepared);
    }
    let running = Running::register();
    let exit = execute(args, prepared);
    drop(running);
    exit
}

fn prepare(args: &Args) -> Result<Prepared, Box<dyn std::error::Error>> {
    let mut profile = match &args.profile {
        Some(path) => Profile::load(path)?,
        None => Profile::simulated(),
    };
    if let Some(calibration) = &args.calibration {
        profile.calibrate(calibration)?;
    }
    session::check_drivers(&profile)?;
    let (pair_toml, model) = pair::load(args.model.as_deref().or(args.pair.as_deref()))?;
    let plan = RunPlan {
        directions: args.direction.list(),
        loads_nm: args.load.0.clone(),
        speed_rpm: args.rpm,
        revolutions: f64::from(args.revs),
        rate_hz: args.rate,
        accept_no_watchdog: args.accept_no_watchdog,
    };
    refuse(&profile, &plan)?;
    if let Some(name) = args.undocumented.iter().find(|name| !simulated::is_undocumented(name)) {
        return Err(Box::new(Refusal::Effect {
            name: name.clone(),
            known: simulated::undocumented_names().join(", "),
        }));
    }
    let simulated = [&profile.servo.port, &profile.brake.port, &profile.counter.port]
        .iter()
        .filter(|port| port.as_str() == "sim")
        .count();
    if simulated == 1 || simulated == 2 {
        return Err(Box::new(Refusal::MixedPorts { profile: profile.name }));
    }
    for (option, given) in [("--seed", args.seed.is_some()), ("--undocumented", !args.undocumented.is_empty())] {
        if given && !profile.in_process() {
            return Err(Box::new(Refusal::SimulatedOnly { option, profile: profile.name }));
        }
    }
    // The simulated rig's gears are those of the pair, with its documented errors and what is left undocumented; a model is
    // what it is compared with, and changes nothing on it.
    let spec = if profile.in_process() {
        let (plant_toml, plant) = pair::load(args.pair.as_deref())?;
        same_gears(args, &plant_toml, &pair_toml)?;
        let mut spec = simulated::spec(&plant, &args.undocumented)?;
        simulated::mount_discs(&mut spec, &profile);
        Some(spec)
    } else {
        None
    };
    let config = RunConfig {
        path: session::log_path(&args.out, &plan),
        profile,
        model,
        head: LogHead { operator: args.operator.clone(), note: args.note.clone(), pair_toml, plan_toml: None },
        conditions: plan.conditions(),
        quiet: args.quiet,
    };
    Ok(Prepared { config, plan, spec })
}

/// Refuses a model of other gears than the simulated rig has.
fn same_gears(args: &Args, plant_toml: &str, model_toml: &str) -> Result<(), Refusal> {
    let gears = |text: &str| gearmodel::PairFile::parse(text).ok().map(|file| file.gears);
    match &args.model {
        Some(model) if gears(plant_toml) != gears(model_toml) => Err(Refusal::OtherGears {
            model: model.clone(),
            pair: args.pair.as_ref().map_or_else(|| "the built-in pair".into(), |pair| pair.display().to_string()),
        }),
        _ => Ok(()),
    }
}

fn refuse(profile: &Profile, plan: &RunPlan) -> Result<(), Box<dyn std::error::Error>> {
    for &load_nm in &plan.loads_nm {
        admit(profile, Terms::OPTIONS, load_nm, plan.speed_rpm)?;
    }
    if !(10.0..=1e6).contains(&plan.rate_hz) {
        return Err(Box::new(Refusal::Rate { rate_hz: plan.rate_hz }));
    }
    Ok(())
}

/// Finalises what an earlier, killed run left behind.
pub fn recover(directory: &Path) {
    match riglog::recover_directory(directory) {
        Ok(logs) => {
            for (path, outcome) in logs {
                match outcome {
                    Ok(log) if log.already_complete => {}
                    Ok(log) => eprintln!(
                        "recovered {}: {} messages kept, {} bytes of a cut chunk dropped",
                        path.display(),
                        log.kept_messages,
                        log.dropped_bytes
                    ),
                    // Another run is writing it.
                    Err(LogError::Locked { .. }) => {}
                    Err(error) => eprintln!("warning: not recovered: {error}"),
                }
            }
        }
        Err(error) => eprintln!("warning: earlier logs were not checked: {error}"),
    }
}

fn announce(args: &Args, prepared: &Prepared) {
    let profile = &prepared.config.profile;
    if profile.name == "sim" {
        let how = if args.time_scale == Some(TimeScale::Real) { "in real time" } else { "faster than real time" };
        print(&format!("SIMULATED RIG, {how} (no --profile given): real registers and frames, emulated hardware"));
    } else {
        print(&format!("rig '{}'", profile.name));
    }
    for warning in warnings(prepared) {
        eprintln!("warning: {warning}");
    }
}

/// What one should know before believing the numbers.
fn warnings(prepared: &Prepared) -> Vec<String> {
    let Prepared { config: RunConfig { profile, model, .. }, plan, .. } = prepared;
    let mut warnings = Vec::new();
    let slip = plan.speed_rpm * profile.brake.step_up;
    if slip < STICK_SLIP_RPM {
        warnings.push(format!(
            "the brake slips at {slip} rpm; makers recommend {STICK_SLIP_RPM} rpm or more, below it the torque sticks and slips (a step-up before the brake, brake.step_up, helps)"
        ));
    }
    if profile.in_process() && !model.effects.is_empty() {
        let names: Vec<&str> = model.effects.terms().iter().map(|term| term.effect.name()).collect();
        warnings.push(format!(
            "the model has {}: the simulated rig has them only where --undocumented puts them there",
            names.join(", ")
        ));
    }
    let drag = profile.brake.drag_nm();
    for load in plan.loads_nm.iter().filter(|load| **load < drag) {
        warnings.push(format!("load {load} N·m is below the brake's drag of {drag} N·m; the drag remains"));
    }
    warnings
}

fn execute(args: &Args, prepared: Prepared) -> Exit {
    let seed = args.seed.unwrap_or(1);
    match &prepared.spec {
        None => in_runtime(args, prepared, Time::Real, |_| Ok((Links::default(), None))),
        Some(_) if args.time_scale == Some(TimeScale::Real) => in_runtime(args, prepared, Time::Real, |prepared| {
            let simulator = Simulator::start(seed, args.pair.as_deref(), &args.undocumented)?;
            let profile = &mut prepared.config.profile;
            *profile = Profile { name: profile.name.clone(), ..simulator.profile().clone() };
            Ok((Links::default(), Some(simulator)))
        }),
        Some(spec) => {
            let spec = spec.clone();
            in_runtime(args, prepared, Time::Simulated, move |prepared| {
                let rate_hz = prepared.plan.rate_hz;
                let links = simulated::start_in_process(&spec, rate_hz, seed).map_err(|error| error.to_string())?;
                Ok((links, None))
            })
        }
    }
}

/// Whose time the runtime keeps.
#[derive(Clone, Copy, PartialEq)]
enum Time {
    Real,
    /// Jumps from timer to timer.
    Simulated,
}

/// Runs a session once `connect` has made the links; signals are heard before it, so that none is missed.
fn in_runtime(
    args: &Args,
    mut prepared: Prepared,
    time: Time,
    connect: impl FnOnce(&mut Prepared) -> Result<(Links, Option<Simulator>), String>,
) -> Exit {
    let simulated = time == Time::Simulated;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(simulated).build();
    let runtime = match runtime {
        Ok(runtime) => runtime,
        Err(error) => return fail(Exit::Failed, &error),
    };
    let path = prepared.config.path.clone();
    let backend = prepared.config.profile.name.clone();
    let warnings = warnings(&prepared);
    let outcome = LocalSet::new().block_on(&runtime, async move {
        let stop = StopRequests::listen().map_err(|error| format!("signals: {error}"))?;
        stop.listen_for_pause().map_err(|error| format!("signals: {error}"))?;
        let _keys = Keys::listen(&stop);
        let (links, _simulator) = connect(&mut prepared)?;
        let clock = if simulated { Clock::simulated() } else { Clock::real() };
        let job = Job::of(&prepared.plan);
        let policy = Policy { reconnect_s: args.reconnect, suspend: None };
        let context =
            prepared.config.begin(job.revolutions(), links, clock, stop).map_err(|error| error.to_string())?;
        Ok::<_, String>(session::execute_job(context, JobSpec { job, policy }, &mut NoObserver).await)
    });
    match outcome {
        Err(error) => {
            eprintln!("error: {error}");
            Exit::Failed
        }
        Ok(outcome) => conclude(args, &path, backend, warnings, &outcome),
    }
}

/// Summary, picture and exit code.
fn conclude(args: &Args, path: &Path, backend: String, warnings: Vec<String>, outcome: &Outcome) -> Exit {
    use crate::run::stop_reason::StopReason;
    let origin = Origin {
        schema: "rigd.run/1",
        log: vec![path.display().to_string()],
        backend,
        losses: outcome.lost + outcome.unwritten,
        ended: outcome.stop_reason.as_ref().map_or_else(|| "done".into(), ToString::to_string),
        warnings: warnings.into_iter().chain(outcome.troubles.iter().cloned()).collect(),
    };
    let mut summary = Summary::of(&outcome.analysis, origin);
    summary.lines.clone_from(&outcome.lines);
    summary.time_skew = outcome.time_skew;
    let picture = path.with_extension("svg");
    match plot::draw(&outcome.analysis, &picture) {
        Ok(true) => summary.plot = Some(picture.display().to_string()),
        Ok(false) => {}
        Err(error) => eprintln!("warning: {error}"),
    }
    if args.json {
        match serde_json::to_string_pretty(&summary) {
            Ok(json) => print(&json),
            Err(error) => return fail(Exit::Failed, &error),
        }
    } else {
        print(summary.text().trim_start_matches('\n'));
    }
    for trouble in &outcome.troubles {
        eprintln!("error: {trouble}");
    }
    match &outcome.stop_reason {
        None if summary.losses > 0 => {
            eprintln!(
                "error: {} samples never arrived or were not written; see /rig/events in the log",
                summary.losses
            );
            Exit::Incomplete
        }
        None if !outcome.troubles.is_empty() => Exit::Halted,
        None => Exit::Done,
        Some(reason @ StopReason::Operator) => {
            eprintln!("{reason}; the log is finalised: {}", path.display());
            Exit::Stopped
        }
        Some(reason) => fail(Exit::Halted, reason),
    }
}
