//! What serves setting a rig up: turning slowly, and holding a brake torque; only while asked, and under the supervisor as any run.

use std::cell::Cell;
use std::f64::consts::TAU;

use gearmodel::Direction;
use riglog::proto::{Level, Phase};
use tokio::time::Instant;

use super::admission::{Terms, admit_load};
use super::connected_rig::ConnectedRig;
use super::job::Job;
use super::limits::{Exceeded, Limit};
use super::plan::RunPlan;
use super::sequence;
use super::stop_reason::StopReason;

/// Fastest turning for set-up, rpm of the driver: slow enough to jump clear.
pub const LARGEST_RPM: f64 = 10.0;
/// Sampling while setting up, Hz.
pub const RATE_HZ: f64 = 1000.0;
/// Faster than this share of what was asked for, something between motor and gear is not what the profile says.
const TOO_FAST: f64 = 1.5;
/// Slower than this share, it does not turn.
const TOO_SLOW: f64 = 0.2;
/// Polls in a row that have to say the same before it is believed: a shaft may stick for an instant.
const FAST_POLLS: u32 = 2;
const SLOW_POLLS: u32 = 10;

/// Slow turning without load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jog {
    /// The driver's sense.
    pub direction: Direction,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Turns of the driver after which it ends; `None`: by time, or when a stop is asked for.
    pub turns: Option<f64>,
    /// Longest time, s.
    pub seconds: f64,
    /// The operator accepts a drive that has no watchdog of its own.
    pub accept_no_watchdog: bool,
}

/// Turns slowly until the turns or the time are over; `from_rad` takes θ1 at the start. The caller switches off.
///
/// # Errors
/// [`StopReason`], among them [`StopReason::Operator`] when the operator has seen enough, [`StopReason::Limit`] when the shaft turns faster than asked
/// for, and [`StopReason::TooLong`] when it does not turn.
pub async fn jog(rig: &mut ConnectedRig, jog: Jog, from_rad: &Cell<f64>) -> Result<(), StopReason> {
    let mut job = Job::of(&idle_plan(vec![jog.direction], 0.0, jog.speed_rpm));
    job.accept_no_watchdog = jog.accept_no_watchdog;
    sequence::prepare(rig, &job).await?;
    rig.enter(Phase::Approach);
    rig.set_load(0.0).await?;
    from_rad.set(rig.acquisition.borrow().latest.theta1_rad);
    rig.set_speed(Some(jog.direction), jog.speed_rpm).await?;
    let (begun, ramp_s) = (Instant::now(), rig.ramp_s(jog.speed_rpm));
    let (mut fast, mut slow) = (0, 0);
    loop {
        rig.tick().await?;
        let (speed_rpm, turned_rad) = {
            let latest = &rig.acquisition.borrow().latest;
            (latest.speed_rpm.abs(), (latest.theta1_rad - from_rad.get()).abs())
        };
        let elapsed_s = begun.elapsed().as_secs_f64();
        fast = if speed_rpm > jog.speed_rpm * TOO_FAST { fast + 1 } else { 0 };
        slow = if elapsed_s > ramp_s && speed_rpm < jog.speed_rpm * TOO_SLOW { slow + 1 } else { 0 };
        if fast >= FAST_POLLS {
            let exceeded = Exceeded { limit: Limit::SetUpSpeed, value: speed_rpm, allowed: jog.speed_rpm * TOO_FAST };
            return Err(StopReason::Limit(exceeded));
        }
        if slow >= SLOW_POLLS {
            let now = format!("{speed_rpm:.2} rpm");
            return Err(StopReason::TooLong { what: "turning at the speed asked for", seconds: elapsed_s, now });
        }
        if elapsed_s >= jog.seconds || jog.turns.is_some_and(|turns| turned_rad >= turns * TAU) {
            return Ok(());
        }
    }
}

/// Holds a load at the driven gear with the motor off, until the time is over. The caller sets the brake to zero.
///
/// # Errors
/// [`StopReason`], among them [`StopReason::Operator`], and [`StopReason::Limit`] when somebody turns the gear for longer than the brake's heat allows.
pub async fn hold_brake(rig: &mut ConnectedRig, load_nm: f64, seconds: f64) -> Result<(), StopReason> {
    admit_load(&rig.profile, Terms::SET_POINTS, load_nm)?;
    sequence::identify_devices(rig, &Job::of(&idle_plan(vec![Direction::Ccw], load_nm, 0.0))).await?;
    sequence::await_samples(rig).await?;
    rig.enter(Phase::Approach);
    rig.set_load(load_nm).await?;
    let current_a = rig.profile.brake.current_a(load_nm).unwrap_or(0.0);
    let what = format!("the brake holds {load_nm} N·m ({current_a:.3} A) for {seconds} s at most; the motor is off");
    rig.acquisition.borrow().event(Level::Info, "brake", what);
    rig.hold(seconds).await
}

/// Nothing is recorded; this is what the drives are asked whether they can do.
fn idle_plan(directions: Vec<Direction>, load_nm: f64, speed_rpm: f64) -> RunPlan {
    RunPlan {
        directions,
        loads_nm: vec![load_nm],
        speed_rpm,
        revolutions: 0.0,
        rate_hz: RATE_HZ,
        accept_no_watchdog: false,
    }
}
