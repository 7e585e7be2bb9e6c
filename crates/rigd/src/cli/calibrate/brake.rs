//! `rigd calibrate brake`.

use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;

use gearmodel::Direction;
use gearmodel::calibration::{BrakePoint, COVERAGE, Stated, brake_curves};
use riglog::RunMetadata;
use serde_json::json;

use super::super::on_rig::on_rig;
use super::super::{Exit, fail};
use super::{Output, date};
use crate::calibration::{BrakeCalibration, Calibration};
use crate::profile::Profile;
use crate::quantity::{SPEED, TORQUE};
use crate::run::admission::{Terms, admit_heat, admit_speed};
use crate::run::brake_sweep::{self, SweepPlan, Swept};
use crate::run::connected_rig::ConnectedRig;
use crate::run::plan::RunPlan;
use crate::run::registry::Running;
use crate::run::session::{self, LogHead, Outcome, RunConfig};
use crate::run::stop_reason::StopReason;
use riglog::pair;

/// Sampling while the torque is what counts, Hz.
const RATE_HZ: f64 = 1000.0;

/// Torque over coil current, both branches
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Rated torque of the servo motor, from its name plate, as 2.39Nm
    #[arg(long, value_name = "TORQUE", value_parser = |text: &str| TORQUE.parse(text))]
    rated_torque: f64,
    /// Uncertainty of the motor's torque, percent: from its maker, 5 where nothing is known
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0)]
    torque_uncertainty: f64,
    /// Torque of the brake without current at its shaft, from its maker or from a turn without it [default: the profile's]
    #[arg(long, value_name = "TORQUE", value_parser = |text: &str| TORQUE.parse(text))]
    drag: Option<f64>,
    /// Its uncertainty
    #[arg(long, value_name = "TORQUE", default_value = "0.1Nm", value_parser = |text: &str| TORQUE.parse(text))]
    drag_uncertainty: f64,
    /// Speed of the driver
    #[arg(long, value_name = "RPM", default_value = "25", value_parser = |text: &str| SPEED.parse(text))]
    rpm: f64,
    /// Largest coil current, A [default: what the profile's curve says loads the gear to limits.load_nm]
    #[arg(long, value_name = "A")]
    max_current: Option<f64>,
    /// Currents on the way up
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u32).range(3..=100))]
    points: u32,
    /// Turns of the driver that are averaged at each
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=100))]
    turns: u32,
    /// Ways up and down
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=20))]
    repeats: u32,
    /// The rig [default: the simulated rig]
    #[arg(long, value_name = "FILE")]
    profile: Option<PathBuf>,
    /// Seed of the simulated rig
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Directory of the log of the calibration
    #[arg(long, value_name = "DIR", default_value = "runs")]
    logs: PathBuf,
    /// Who does it, for the log
    #[arg(long, default_value = "")]
    operator: String,
    #[command(flatten)]
    output: Output,
}

/// What is refused before anything moves.
#[derive(Debug, thiserror::Error)]
enum Refusal {
    #[error("{option} {value} {unit} must be {expected}")]
    Value { option: &'static str, value: f64, unit: &'static str, expected: String },
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let (config, plan) = match prepare(args) {
        Ok(prepared) => prepared,
        Err(error) => return fail(Exit::BadInput, error.as_ref()),
    };
    let rig = config.profile.clone();
    let mean_ratio = config.model.pair.closure();
    let running = Running::register();
    let swept = Rc::new(RefCell::new(Swept::default()));
    let outcome = execute(args, config, &plan, &swept);
    drop(running);
    match outcome {
        Err(error) => {
            eprintln!("error: {error}");
            Exit::Failed
        }
        Ok(outcome) => {
            outcome.troubles.iter().for_each(|trouble| eprintln!("error: {trouble}"));
            match &outcome.stop_reason {
                Some(reason @ StopReason::Operator) => fail(Exit::Stopped, reason),
                Some(reason) => fail(Exit::Halted, reason),
                None => conclude(args, &rig, &plan, mean_ratio, &swept.borrow()),
            }
        }
    }
}

fn prepare(args: &Args) -> Result<(RunConfig, SweepPlan), Box<dyn std::error::Error>> {
    let profile = match &args.profile {
        Some(path) => Profile::load(path)?,
        None => Profile::simulated(),
    };
    session::check_drivers(&profile)?;
    let limits = &profile.limits;
    let refuse = |option, value, unit, expected: String| Err(Refusal::Value { option, value, unit, expected });
    let known = profile.brake.current_a(limits.load_nm).unwrap_or(profile.brake.current_limit_a);
    let max_a = args.max_current.unwrap_or(known);
    if !(max_a > 0.0 && max_a <= profile.brake.current_limit_a) {
        let expected = format!("over 0 and at most brake.current_limit_a = {}", profile.brake.current_limit_a);
        refuse("--max-current", max_a, "A", expected)?;
    }
    let terms = Terms { load: "limits.load_nm", ..Terms::OPTIONS };
    admit_speed(&profile, terms, args.rpm)?;
    if !(0.0..=50.0).contains(&args.torque_uncertainty) {
        refuse("--torque-uncertainty", args.torque_uncertainty, "%", "from 0 to 50".into())?;
    }
    if args.rated_torque <= 0.0 {
        refuse("--rated-torque", args.rated_torque, "N·m", "over 0".into())?;
    }
    admit_heat(&profile, terms, limits.load_nm, args.rpm)?;
    std::fs::create_dir_all(&args.logs)?;
    let (pair_toml, model) = pair::load(None)?;
    let sweep = SweepPlan {
        currents_a: (1..=args.points).map(|n| max_a * f64::from(n) / f64::from(args.points)).collect(),
        speed_rpm: args.rpm,
        turns: args.turns,
        repeats: args.repeats,
        rated_torque_nm: args.rated_torque,
        rate_hz: RATE_HZ,
    };
    let plan = RunPlan {
        directions: vec![Direction::Ccw],
        loads_nm: vec![0.0],
        speed_rpm: args.rpm,
        revolutions: f64::from(args.turns),
        rate_hz: RATE_HZ,
        accept_no_watchdog: false,
    };
    let note = "calibration of the brake".into();
    let config = RunConfig {
        path: session::log_path(&args.logs, &plan),
        profile,
        model,
        head: LogHead { operator: args.operator.clone(), note, pair_toml, plan_toml: None },
        conditions: RunMetadata {
            direction: Direction::Ccw.to_string(),
            speed_rpm: vec![args.rpm],
            ..RunMetadata::default()
        },
        quiet: true,
    };
    Ok((config, sweep))
}

fn execute(args: &Args, config: RunConfig, plan: &SweepPlan, swept: &Rc<RefCell<Swept>>) -> Result<Outcome, String> {
    let sweep = async |rig: &mut ConnectedRig| brake_sweep::execute(rig, plan, swept).await;
    on_rig(config, args.seed, RATE_HZ, async |rig| session::once(rig, sweep).await)
}

fn conclude(args: &Args, rig: &Profile, plan: &SweepPlan, mean_ratio: f64, swept: &Swept) -> Exit {
    let stated = Stated {
        drag_nm: args.drag.unwrap_or(rig.brake.rising[0][1]),
        drag_uncertainty_nm: args.drag_uncertainty,
        torque_uncertainty_ratio: args.torque_uncertainty / 100.0,
        resolution_nm: swept.resolution_nm,
        mean_ratio,
        step_up: rig.brake.step_up,
    };
    let curves = match brake_curves(&swept.sweeps, &stated) {
        Ok(curves) => curves,
        Err(error) => return fail(Exit::Incomplete, &error),
    };
    // A file that people read: more places than the uncertainty has would be noise.
    let places = |value: f64, places: i32| (value * 10f64.powi(places)).round() / 10f64.powi(places);
    let points = |branch: &[BrakePoint]| {
        branch
            .iter()
            .map(|p| [places(p.current_a, 5), places(p.torque_nm, 4), places(p.uncertainty_nm, 4)])
            .collect::<Vec<_>>()
    };
    let brake = BrakeCalibration {
        date: date(),
        rig: rig.name.clone(),
        method: format!(
            "mean torque of the servo (rated {} N·m, ±{} %) over {} whole turns a current, {} ways up and down; drag {} N·m ± {} N·m stated",
            args.rated_torque,
            args.torque_uncertainty,
            plan.turns,
            plan.repeats,
            stated.drag_nm,
            stated.drag_uncertainty_nm
        ),
        coverage_factor: COVERAGE,
        speed_rpm: plan.speed_rpm,
        temperature_c: swept.temperature_c,
        rising: points(&curves.rising),
        falling: points(&curves.falling),
    };
    let saved = Calibration::load_or_new(&args.output.out).and_then(|mut calibration| {
        calibration.brake = Some(brake.clone());
        calibration.save(&args.output.out)
    });
    if let Err(error) = saved {
        return fail(Exit::Failed, &error);
    }
    let told = json!({
        "schema": "rigd.calibrate/1", "what": "brake", "file": args.output.out.display().to_string(), "brake": brake,
    });
    let mut text = format!("{:>9}  {:>24}  {:>24}\n", "A", "rising, N·m", "falling, N·m");
    for (up, down) in brake.rising.iter().zip(&brake.falling) {
        text.push_str(&format!(
            "{:>9.4}  {:>14.3} ± {:>6.3}  {:>14.3} ± {:>6.3}\n",
            up[0], up[1], up[2], down[1], down[2]
        ));
    }
    text.push_str(&format!(
        "written to {}; name it in the profile: calibration = \"…\", or with rigd run --calibration",
        args.output.out.display()
    ));
    args.output.tell(&told, &text);
    Exit::Done
}
