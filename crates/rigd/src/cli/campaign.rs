//! `rigd campaign`: many runs by a plan, taken up again where they ended.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use gearmodel::NominalModel;
use serde::Serialize;
use tokio::task::LocalSet;

use super::run::TimeScale;
use super::simulator::Simulator;
use super::{Exit, fail, print};
use crate::campaign::CampaignError;
use crate::campaign::estimate::{Estimate, estimate, time};
use crate::campaign::journal::Journal;
use crate::campaign::observer::{CampaignObserver, log_name, put_aside};
use crate::campaign::plan::CampaignPlan;
use crate::campaign::report::{Report, drift};
use crate::campaign::schedule::Schedule;
use crate::clock::Clock;
use crate::profile::Profile;
use crate::run::job::Job;
use crate::run::keys::Keys;
use crate::run::progress::Progress;
use crate::run::registry::Running;
use crate::run::run_job::Policy;
use crate::run::session::{self, JobSpec, Links, LogHead, Outcome, SessionContext};
use crate::run::stop::StopRequests;
use crate::run::stop_reason::StopReason;
use crate::simulated::{self, PlantSpec};
use riglog::pair;

const PLAN: &str = "A plan:
  name = \"…\"  operator = \"…\"  note = \"…\"  rate_hz = 10000.0  repeats = 1  order = \"as-written\" or \"random\"  seed = 1  reconnect_s = 300.0
  [warm_up]    direction = \"ccw\", \"cw\" or \"both\"  load_nm  speed_rpm  minutes
  [settle]     te_change_urad (largest change of TE a revolution)  turns_max
  [reference]  direction  load_nm  speed_rpm  revolutions             (first and last)
  [suspend]    cool_to_c  patience_min  after_emergency_stop = \"operator\" or \"release\"
  [[matrix]]   directions = [\"both\"]  loads_nm = [5.0]  speeds_rpm = [5.0]  revolutions = 4
  [[runs]]     direction  load_nm  speed_rpm  revolutions             (as rigd diagnose --plan-next writes them)
Key p or SIGUSR1 pauses at the end of a revolution, and goes on; Ctrl-C stops. The same command goes on at the first unfinished run.";

/// Measure by a plan: directions × loads × speeds, each run in a log of its own, resumed after a stop or a crash.
#[derive(Debug, clap::Args)]
#[command(after_help = PLAN)]
pub struct Args {
    /// The plan
    plan: PathBuf,
    /// Directory of logs and journal [default: campaigns/<name of the plan's file>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Only say how long it takes and how warm the brake gets
    #[arg(long)]
    dry_run: bool,
    /// The gear pair and its documented errors [default: the built-in pair]
    #[arg(long, value_name = "FILE")]
    pair: Option<PathBuf>,
    /// The rig [default: the simulated rig]
    #[arg(long, value_name = "FILE")]
    profile: Option<PathBuf>,
    /// Seed of the simulated rig [default: 1]
    #[arg(long, conflicts_with = "profile")]
    seed: Option<u64>,
    /// Simulated rig: `max` runs as fast as it can, `1` in real time over pseudo-terminals [default: max]
    #[arg(long, value_enum, conflicts_with = "profile")]
    time_scale: Option<TimeScale>,
    /// Simulated rig: an effect that the model does not know; may be repeated
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',', conflicts_with = "profile")]
    undocumented: Vec<String>,
    /// Drive a servo that has no watchdog of its own; somebody must stay at the emergency stop
    #[arg(long)]
    accept_no_watchdog: bool,
    /// Who runs it, for the logs [default: the plan's]
    #[arg(long)]
    operator: Option<String>,
    /// What it is for, for the logs [default: the plan's]
    #[arg(long)]
    note: Option<String>,
    /// One JSON object on stdout, nothing else
    #[arg(long)]
    json: bool,
    /// No progress line, and no line a run
    #[arg(long)]
    quiet: bool,
}

/// What was read and checked before anything moves.
struct Prepared {
    plan: CampaignPlan,
    plan_toml: String,
    profile: Profile,
    pair_toml: String,
    model: NominalModel,
    spec: Option<PlantSpec>,
    schedule: Schedule,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let prepared = match prepare(args) {
        Ok(prepared) => prepared,
        Err(error) => return fail(Exit::BadInput, error.as_ref()),
    };
    if args.dry_run {
        return dry_run(args, &prepared);
    }
    let directory = args.out.clone().unwrap_or_else(|| {
        Path::new("campaigns").join(args.plan.file_stem().map_or_else(|| "campaign".into(), ToOwned::to_owned))
    });
    if let Err(error) = std::fs::create_dir_all(&directory) {
        eprintln!("error: --out {}: {error}; name a directory that you may write", directory.display());
        return Exit::BadInput;
    }
    let journal = match Journal::open(&directory, &prepared.schedule.fingerprint) {
        Ok(journal) => journal,
        Err(error @ CampaignError::Io { .. }) => return fail(Exit::Failed, &error),
        Err(error) => return fail(Exit::BadInput, &error),
    };
    if let Err(exit) = clear_away(&directory, &journal) {
        return exit;
    }
    let running = Running::register();
    let exit = execute(args, prepared, &directory, journal);
    drop(running);
    exit
}

fn prepare(args: &Args) -> Result<Prepared, Box<dyn std::error::Error>> {
    let profile = match &args.profile {
        Some(path) => Profile::load(path)?,
        None => Profile::simulated(),
    };
    session::check_drivers(&profile)?;
    let (plan, plan_toml) = CampaignPlan::load(&args.plan)?;
    plan.check(&profile, &args.plan)?;
    let (pair_toml, model) = pair::load(args.pair.as_deref())?;
    let spec = if profile.in_process() {
        let mut spec = simulated::spec(&model, &args.undocumented)?;
        simulated::mount_discs(&mut spec, &profile);
        Some(spec)
    } else {
        None
    };
    let schedule = Schedule::of(&plan);
    Ok(Prepared { plan, plan_toml, profile, pair_toml, model, spec, schedule })
}

/// The answer of a dry run.
#[derive(Serialize)]
struct DryRun<'a> {
    schema: &'static str,
    runs: usize,
    #[serde(flatten)]
    estimate: &'a Estimate,
    slip_power_limit_w: f64,
}

fn dry_run(args: &Args, prepared: &Prepared) -> Exit {
    let Prepared { plan, profile, schedule, .. } = prepared;
    let found = estimate(&schedule.runs, plan.settle(), profile);
    let limit_w = profile.limits.slip_power_w;
    if args.json {
        let answer = DryRun {
            schema: "rigd.dry-run/1",
            runs: schedule.runs.len(),
            estimate: &found,
            slip_power_limit_w: limit_w,
        };
        return match serde_json::to_string_pretty(&answer) {
            Ok(json) => {
                print(&json);
                Exit::Done
            }
            Err(error) => fail(Exit::Failed, &error),
        };
    }
    for (n, (run, seconds)) in schedule.runs.iter().zip(&found.runs_s).enumerate() {
        print(&format!(
            "{:>4}  {:<9} {:<3} {:>6} N·m {:>6} rpm {:>6} revolutions  {}",
            n + 1,
            run.kind.name(),
            run.direction.to_string(),
            run.load_nm,
            run.speed_rpm,
            run.revolutions,
            time(*seconds)
        ));
    }
    print(&format!(
        "{} runs, {} in all, {} of it recorded",
        schedule.runs.len(),
        time(found.duration_s),
        time(found.recorded_s)
    ));
    print(&format!(
        "brake heat {:.1} kJ: {:.1} W on average, {:.1} W at most of {limit_w} W; {:.0} % of the heat account at most",
        found.heat_j * 1e-3,
        found.mean_power_w,
        found.largest_power_w,
        100.0 * found.heat_account
    ));
    Exit::Done
}

/// Finalises what a killed start left, and puts aside what is no finished run.
fn clear_away(directory: &Path, journal: &Journal) -> Result<(), Exit> {
    super::run::recover(directory);
    if journal.is_empty() {
        // No campaign was ever begun here: what lies here is somebody else's.
        return Ok(());
    }
    let files = std::fs::read_dir(directory).map(|entries| entries.flatten().collect::<Vec<_>>()).unwrap_or_default();
    // Each log once, however many parts it has.
    let logs: BTreeSet<_> = files.iter().filter_map(|entry| log_name(&entry.path())).collect();
    for log in logs.iter().filter(|log| !journal.finished.iter().any(|run| run.log == **log)) {
        let log = directory.join(log);
        eprintln!("{} is of a run that was not finished: put aside", log.display());
        put_aside(directory, &log).map_err(|error| fail(Exit::Failed, &error))?;
    }
    Ok(())
}

fn execute(args: &Args, prepared: Prepared, directory: &Path, journal: Journal) -> Exit {
    let Prepared { plan, plan_toml, mut profile, pair_toml, model, spec, schedule } = prepared;
    let first = journal.first_unfinished(schedule.runs.len());
    let indices = schedule.from(first);
    if indices.is_empty() {
        eprintln!("all {} runs are complete already", schedule.runs.len());
        let report = report(&plan, directory, schedule.runs.len(), &journal.finished, Vec::new(), None);
        return conclude(args, &report, None);
    }
    let in_process = spec.is_some() && args.time_scale != Some(TimeScale::Real);
    let runs: Vec<_> = indices.iter().map(|index| schedule.runs[*index]).collect();
    let found = estimate(&runs, plan.settle(), &profile);
    if !args.json {
        announce(&profile, first, &schedule, &found);
    }
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(in_process).build();
    let runtime = match runtime {
        Ok(runtime) => runtime,
        Err(error) => return fail(Exit::Failed, &error),
    };
    let seed = args.seed.unwrap_or(1);
    let last_ns = journal.finished.iter().map(|run| run.ended_ns).max().unwrap_or(0);
    let planned = schedule.runs.len();
    let outcome: Result<(Outcome, CampaignObserver), String> = LocalSet::new().block_on(&runtime, async {
        let stop = StopRequests::listen().map_err(|error| format!("signals: {error}"))?;
        stop.listen_for_pause().map_err(|error| format!("signals: {error}"))?;
        let _keys = Keys::listen(&stop);
        let mut simulator = None;
        let links = match &spec {
            Some(spec) if in_process => {
                simulated::start_in_process(spec, plan.rate_hz, seed).map_err(|error| error.to_string())?
            }
            Some(_) => {
                let started = Simulator::start(seed, args.pair.as_deref(), &args.undocumented)?;
                profile = Profile { name: profile.name.clone(), ..started.profile().clone() };
                simulator = Some(started);
                Links::default()
            }
            None => Links::default(),
        };
        // One time for all logs of a campaign: simulated time goes on where an earlier start ended.
        let clock = if in_process { Clock::simulated_after(last_ns) } else { Clock::real() };
        let head = LogHead {
            operator: args.operator.clone().unwrap_or_else(|| plan.operator.clone()),
            note: args.note.clone().unwrap_or_else(|| plan.note.clone()),
            pair_toml,
            plan_toml: Some(plan_toml),
        };
        let quiet = args.quiet || args.json;
        let parts = (schedule, indices, found);
        let mut observer = CampaignObserver::new((directory, journal), profile.clone(), head, clock, parts, quiet);
        let recorder = observer.begin().map_err(|error| error.to_string())?;
        let mut job = Job::new(runs, plan.rate_hz, 0);
        (job.settle, job.accept_no_watchdog) = (plan.settle(), args.accept_no_watchdog);
        let policy = Policy { reconnect_s: plan.reconnect_s, suspend: plan.suspend() };
        let progress = Progress::new(job.revolutions(), args.quiet);
        let context = SessionContext { profile, model, recorder, progress, links, clock, stop };
        let mut outcome = session::execute_job(context, JobSpec { job, policy }, &mut observer).await;
        if let Err(error) = observer.conclude(outcome.finalised, outcome.stop_reason.as_ref()) {
            outcome.stop_reason.get_or_insert(StopReason::Journal(error));
        }
        drop(simulator);
        Ok((outcome, observer))
    });
    match outcome {
        Err(error) => {
            eprintln!("error: {error}");
            Exit::Failed
        }
        Ok((outcome, observer)) => {
            for trouble in &outcome.troubles {
                eprintln!("error: {trouble}");
            }
            let finished = observer.all_finished();
            let interruptions = observer.interruptions.clone();
            let report = report(&plan, directory, planned, finished, interruptions, outcome.stop_reason.as_ref());
            conclude(args, &report, outcome.stop_reason.as_ref())
        }
    }
}

fn announce(profile: &Profile, first: usize, schedule: &Schedule, found: &Estimate) {
    if profile.name == "sim" {
        print("SIMULATED RIG: real registers and frames, emulated hardware");
    } else {
        print(&format!("rig '{}'", profile.name));
    }
    if first > 0 {
        print(&format!("taken up again at run {} of {}", first + 1, schedule.runs.len()));
    }
    print(&format!("{} runs, about {} of the rig's time", schedule.runs.len() - first, time(found.duration_s)));
}

fn report(
    plan: &CampaignPlan,
    directory: &Path,
    planned: usize,
    finished: &[crate::campaign::journal::FinishedRun],
    interruptions: Vec<String>,
    reason: Option<&StopReason>,
) -> Report {
    // A warm-up that was done again counts once.
    let mut runs: Vec<_> = finished.to_vec();
    runs.sort_by_key(|run| run.run);
    runs.dedup_by_key(|run| run.run);
    Report {
        schema: "rigd.campaign/1",
        name: plan.name.clone(),
        directory: directory.display().to_string(),
        planned,
        losses: runs.iter().map(|run| run.losses).sum(),
        drift: drift(&runs),
        runs,
        interruptions,
        ended: reason.map_or_else(|| "done".into(), ToString::to_string),
    }
}

fn conclude(args: &Args, report: &Report, reason: Option<&StopReason>) -> Exit {
    if args.json {
        match serde_json::to_string_pretty(report) {
            Ok(json) => print(&json),
            Err(error) => return fail(Exit::Failed, &error),
        }
    } else {
        print(report.text().trim_start_matches('\n'));
    }
    match reason {
        Some(reason @ StopReason::Operator) => {
            eprintln!("{reason}; the same command goes on at the first unfinished run");
            Exit::Stopped
        }
        Some(reason) => {
            let exit = fail(Exit::Halted, reason);
            eprintln!("the logs are finalised; the same command goes on at the first unfinished run");
            exit
        }
        None if report.losses > 0 => {
            eprintln!("error: {} samples never arrived; see /rig/events in the logs", report.losses);
            Exit::Incomplete
        }
        None => Exit::Done,
    }
}
