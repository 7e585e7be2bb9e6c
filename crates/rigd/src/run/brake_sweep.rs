//! The brake's calibration on the rig: the servo's mean torque over whole turns, at currents up to a largest and back to none.

use std::cell::RefCell;
use std::f64::consts::TAU;
use std::rc::Rc;

use gearmodel::Direction;
use gearmodel::calibration::{Sweep, TorqueReading};
use riglog::proto::{Level, Phase};

use super::admission::{Terms, admit_heat};
use super::connected_rig::ConnectedRig;
use super::job::Job;
use super::limits::Limit;
use super::plan::RunPlan;
use super::sequence;
use super::stop_reason::StopReason;
use crate::device::DeviceError;

/// The coil is given this long for each new current, in times of the profile's `load_s`.
const SETTLE: f64 = 2.0;

/// How the brake is swept.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPlan {
    /// Currents above 0, rising, A.
    pub currents_a: Vec<f64>,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Whole turns of the driver that are averaged at each current.
    pub turns: u32,
    /// Ways up and down.
    pub repeats: u32,
    /// Rated torque of the motor, N·m.
    pub rated_torque_nm: f64,
    /// Sampling, Hz.
    pub rate_hz: f64,
}

/// What a sweep gave.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Swept {
    /// The ways up and down.
    pub sweeps: Vec<Sweep>,
    /// Step of the servo's torque at the driver shaft, N·m.
    pub resolution_nm: f64,
    /// Temperature of the brake's driver at the end, °C.
    pub temperature_c: f64,
}

/// Sweeps the brake; what was measured is in `swept`, even where the sweep ends early.
///
/// # Errors
/// [`StopReason`] says why it ended; the caller switches off.
pub async fn execute(rig: &mut ConnectedRig, plan: &SweepPlan, swept: &Rc<RefCell<Swept>>) -> Result<(), StopReason> {
    let turning = RunPlan {
        directions: vec![Direction::Ccw],
        loads_nm: vec![0.0],
        speed_rpm: plan.speed_rpm,
        revolutions: f64::from(plan.turns),
        rate_hz: plan.rate_hz,
        accept_no_watchdog: false,
    };
    // The currents go up to what loads the gear to its limit.
    admit_heat(&rig.profile, Terms::SET_POINTS, rig.profile.limits.load_nm, plan.speed_rpm)?;
    sequence::prepare(rig, &Job::of(&turning)).await?;
    rig.enter(Phase::Approach);
    rig.set_coil_current(0.0).await?;
    rig.set_speed(Some(Direction::Ccw), plan.speed_rpm).await?;
    let (speed, patience) = (plan.speed_rpm, rig.ramp_s(plan.speed_rpm) + 2.0);
    rig.until("the ramp to speed", patience, move |a| (a.latest.speed_rpm - speed).abs() < 0.05 * speed).await?;
    let up = plan.currents_a.iter().copied();
    let way: Vec<f64> = [0.0].into_iter().chain(up.clone()).chain(up.rev().skip(1)).chain([0.0]).collect();
    for repeat in 0..plan.repeats {
        rig.acquisition.borrow().event(Level::Info, "calibration", format!("way {} of {}", repeat + 1, plan.repeats));
        let mut readings = Vec::new();
        for &current_a in &way {
            rig.enter(Phase::Settle);
            rig.set_coil_current(current_a).await?;
            rig.hold(SETTLE * rig.profile.sequence.load_s).await?;
            let reading = read(rig, plan, current_a, swept).await?;
            rig.acquisition.borrow().event(
                Level::Info,
                "calibration",
                format!("{current_a:.4} A: {:.4} N·m at the driver over {} turns", reading.torque_nm, reading.turns),
            );
            readings.push(reading);
        }
        swept.borrow_mut().sweeps.push(Sweep { readings });
    }
    swept.borrow_mut().temperature_c = rig.acquisition.borrow().status.brake_temperature_c;
    Ok(())
}

/// Mean torque over whole turns: ∮T dθ1 / 2π, by the trapezium rule over the angles at which the torque was asked for.
async fn read(
    rig: &mut ConnectedRig,
    plan: &SweepPlan,
    current_a: f64,
    swept: &Rc<RefCell<Swept>>,
) -> Result<TorqueReading, StopReason> {
    let mut means = Vec::new();
    let (mut angle, mut torque) = ask(rig, plan, swept).await?;
    let (mut least, mut most) = (torque, torque);
    let (mut from, mut work) = (angle, 0.0);
    let deadline = tokio::time::Instant::now()
        + tokio::time::Duration::from_secs_f64(60.0 / plan.speed_rpm * f64::from(plan.turns + 1) * 1.5 + 2.0);
    while means.len() < plan.turns as usize {
        if tokio::time::Instant::now() > deadline {
            let now = format!("{:.2} rpm", rig.acquisition.borrow().latest.speed_rpm);
            return Err(StopReason::TooLong {
                what: "the turns of a calibration point",
                seconds: 60.0 / plan.speed_rpm * f64::from(plan.turns),
                now,
            });
        }
        let (next_angle, next_torque) = ask(rig, plan, swept).await?;
        // A turn ends between two askings: the torque there lies on the line between them.
        let end = from + TAU;
        if next_angle >= end && next_angle > angle {
            let at_end = torque + (next_torque - torque) * (end - angle) / (next_angle - angle);
            work += 0.5 * (torque + at_end) * (end - angle);
            means.push(work / TAU);
            work = 0.5 * (at_end + next_torque) * (next_angle - end);
            from = end;
        } else {
            work += 0.5 * (torque + next_torque) * (next_angle - angle);
        }
        (angle, torque) = (next_angle, next_torque);
        (least, most) = (least.min(torque), most.max(torque));
    }
    let count = means.len() as f64;
    let mean = means.iter().sum::<f64>() / count;
    let square = means.iter().map(|one| (one - mean).powi(2)).sum::<f64>();
    let scatter_nm = if means.len() > 1 { (square / (count - 1.0)).sqrt() } else { 0.0 };
    Ok(TorqueReading { current_a, torque_nm: mean, scatter_nm, turns: plan.turns, swing_nm: 0.5 * (most - least) })
}

/// One poll of everything: the driver's angle and its torque, N·m.
async fn ask(rig: &mut ConnectedRig, plan: &SweepPlan, swept: &Rc<RefCell<Swept>>) -> Result<(f64, f64), StopReason> {
    rig.tick().await?;
    let torque = rig.servo.motor_torque_percent().await;
    let Some((percent, step)) = rig.note(torque)? else {
        return Err(StopReason::Device(DeviceError::NoTorque { port: rig.profile.servo.port.clone() }));
    };
    let at_driver = |percent: f64| percent / 100.0 * plan.rated_torque_nm * rig.profile.servo.reduction;
    swept.borrow_mut().resolution_nm = at_driver(step);
    let torque_nm = f64::from(rig.profile.servo.sense) * at_driver(percent);
    let limit_nm = rig.profile.limits.load_nm * LARGEST_RATIO;
    Limit::SweepTorque.check(torque_nm.abs(), limit_nm)?;
    Ok((rig.acquisition.borrow().latest.theta1_rad, torque_nm))
}

/// The ratio of a non-circular pair rises to some 2 within a turn, and friction comes on top.
const LARGEST_RATIO: f64 = 3.0;
