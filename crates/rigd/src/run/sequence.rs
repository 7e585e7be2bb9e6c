//! The sequence of a job: prepare → home → for each run: approach, settle, record. The caller switches off.

use std::time::Duration;

use gearmodel::Direction;
use gearmodel::measure::RunConditions;
use riglog::proto::Level;
use riglog::proto::Phase;

use super::admission::admit_job;
use super::connected_rig::ConnectedRig;
use super::job::{Job, Kind, RunSpec, Settle};
use super::observer::RunObserver;
use super::settle::SettleMonitor;
use super::stop_reason::StopReason;
use super::supervisor::Event;
use crate::device::{CounterIdentity, DeviceError, DeviceKind};

/// Room on a serial line for a sample of both encoders: two bytes each at speed, and the frame's share.
const BYTES_A_SAMPLE: f64 = 5.0;

/// Runs what is left of the job on a rig that is off. The caller switches off afterwards, whatever came back.
///
/// # Errors
/// [`StopReason`] says why the job was not finished; [`StopReason::Paused`] when a pause is due.
pub async fn execute(rig: &mut ConnectedRig, job: &mut Job, observer: &mut dyn RunObserver) -> Result<(), StopReason> {
    prepare(rig, job).await?;
    home(rig).await?;
    while let Some((index, run)) = job.current() {
        check_pause(rig)?;
        if !job.is_partial() {
            observer.begins(rig, index, &run).await?;
        }
        approach(rig, &run, job.settle).await?;
        check_pause(rig)?;
        let complete = if run.kind == Kind::WarmUp {
            warm_up(rig, &run).await?;
            true
        } else {
            let recorded = record(rig, &run, job.missing_revolutions()).await?;
            job.book(recorded)
        };
        if complete {
            job.advance();
            observer.ended(rig, index, &run).await?;
        }
    }
    Ok(())
}

fn check_pause(rig: &ConnectedRig) -> Result<(), StopReason> {
    if rig.stop.paused() { Err(StopReason::Paused) } else { Ok(()) }
}

/// Admits the job, identifies the devices, starts the encoders, and arms the drive's watchdog before it is enabled: whatever turns the
/// motor comes through here.
///
/// # Errors
/// [`StopReason`], among them [`StopReason::Refused`] for a run beyond the profile's limits, and [`DeviceError::NoWatchdog`] for a drive that
/// has none.
pub async fn prepare(rig: &mut ConnectedRig, job: &Job) -> Result<(), StopReason> {
    admit_job(&rig.profile, job)?;
    identify_devices(rig, job).await?;
    // Last, for the drive's watchdog runs from here on.
    arm_watchdog(rig, job.accept_no_watchdog).await?;
    rig.heard = tokio::time::Instant::now();
    rig.set_speed(None, 0.0).await?;
    rig.check_stop()?;
    let enabled = rig.servo.set_enabled(true).await;
    // It may be on even where that could not be confirmed; a stop then takes the longer way.
    rig.apply_event(Event::ServoOn);
    rig.note(enabled)?;
    // Switching on takes its time and asks the drive all along.
    rig.heard = tokio::time::Instant::now();
    await_samples(rig).await
}

/// Identifies the devices, starts the encoders and prepares the brake; the motor stays off.
///
/// # Errors
/// [`StopReason`].
pub async fn identify_devices(rig: &mut ConnectedRig, job: &Job) -> Result<(), StopReason> {
    rig.enter(Phase::Idle);
    let servo = rig.servo.identify().await;
    let servo = rig.note(servo)?;
    let brake = rig.brake.identify().await;
    let brake = rig.note(brake)?;
    let event = |rig: &ConnectedRig, text: String| rig.acquisition.borrow().event(Level::Info, "identity", text);
    refuse_over_limit(rig, job).await?;
    // A counter that has gone on streaming while the rig was off is left alone.
    if let Some(mut counter) = rig.counter.take() {
        let encoders = counter.identify().await;
        let encoders = rig.note(encoders)?;
        let signs = [rig.profile.counter.input_sign, rig.profile.counter.output_sign];
        rig.acquisition.borrow_mut().set_encoders(&encoders, signs, &rig.profile.counter.port)?;
        let mounted_deg = [rig.profile.counter.input_mounted_deg, rig.profile.counter.output_mounted_deg];
        rig.acquisition.borrow_mut().set_mounting(mounted_deg);
        event(rig, format!("servo {}; brake {}; counter {}", servo.text, brake.text, encoders.text));
        refuse_rate(rig, &encoders, job.rate_hz)?;
        let started = counter.start(job.rate_hz).await;
        rig.note(started)?;
        rig.stream_from(counter);
    } else {
        event(rig, format!("servo {}; brake {}", servo.text, brake.text));
    }
    let prepared = rig.brake.prepare(rig.profile.brake.voltage_v).await;
    rig.note(prepared)
}

/// Until the encoders have sent something new.
///
/// # Errors
/// [`StopReason::TooLong`] when they do not.
pub async fn await_samples(rig: &mut ConnectedRig) -> Result<(), StopReason> {
    let before = rig.acquisition.borrow().samples();
    rig.until("the first encoder samples", 2.0, |acquisition| acquisition.samples() > before).await
}

/// Writes the drive's own watchdog and reads it back. A drive that has none is refused unless the operator accepts that.
async fn arm_watchdog(rig: &mut ConnectedRig, accept_none: bool) -> Result<(), StopReason> {
    let lease_s = rig.profile.sequence.lease_s;
    let (accel, decel) = (rig.profile.servo.accel_ms, rig.profile.servo.decel_ms);
    let prepared = rig.servo.prepare(accel, decel, Duration::from_secs_f64(lease_s)).await;
    let (level, what) = match prepared {
        Ok(()) => (
            Level::Info,
            format!(
                "the drive's watchdog is armed and read back: it stops the motor {lease_s} s after the last request"
            ),
        ),
        Err(error @ DeviceError::NoWatchdog { .. }) if accept_none => (
            Level::Warning,
            format!(
                "ACCEPTED WITHOUT A WATCHDOG by --accept-no-watchdog: {error}. Stay at the emergency stop while it turns"
            ),
        ),
        other => return rig.note(other),
    };
    if level == Level::Warning {
        tracing::warn!("{what}");
    }
    rig.acquisition.borrow().event(level, "lease", what);
    rig.apply_event(Event::WatchdogKnown);
    Ok(())
}

fn within(
    device: DeviceKind,
    port: &str,
    quantity: &'static str,
    value: f64,
    limit: f64,
    unit: &'static str,
) -> Result<(), StopReason> {
    if value <= limit {
        return Ok(());
    }
    Err(StopReason::Device(DeviceError::Range { device, port: port.to_owned(), quantity, value, limit, unit }))
}

/// What the drives themselves allow, read back from them.
async fn refuse_over_limit(rig: &mut ConnectedRig, job: &Job) -> Result<(), StopReason> {
    let allowed = rig.servo.max_motor_rpm().await;
    let allowed = rig.note(allowed)?;
    let asked = job.largest_speed_rpm().max(rig.profile.sequence.home_rpm) * rig.profile.servo.reduction;
    within(DeviceKind::Servo, &rig.profile.servo.port, "motor speed", asked, allowed, "rpm")?;
    let current = rig.profile.brake.current_a(job.largest_load_nm()).unwrap_or(0.0);
    within(DeviceKind::Brake, &rig.profile.brake.port, "coil current", current, rig.brake.max_current_a(), "A")
}

fn refuse_rate(rig: &ConnectedRig, encoders: &CounterIdentity, rate_hz: f64) -> Result<(), StopReason> {
    let counter = &rig.profile.counter;
    if encoders.own_rate {
        let what = format!("the encoders are sampled at {} Hz, their readers' own rate", encoders.max_rate_hz);
        rig.acquisition.borrow().event(Level::Info, "rate", what);
        return Ok(());
    }
    within(DeviceKind::Counter, &counter.port, "sample rate", rate_hz, encoders.max_rate_hz, "Hz")?;
    // A serial line carries a tenth of its baud rate in bytes; sockets and pipes have no such bound.
    if counter.port.starts_with('/') {
        let limit = f64::from(counter.baud) / 10.0 / BYTES_A_SAMPLE;
        within(DeviceKind::Counter, &counter.port, "sample rate over its line", rate_hz, limit, "Hz")?;
    }
    Ok(())
}

/// Turns ccw without load until both indices have passed; they are the zero of both angles.
async fn home(rig: &mut ConnectedRig) -> Result<(), StopReason> {
    rig.enter(Phase::Homing);
    let indexed = rig.acquisition.borrow().has_index();
    if !indexed {
        let homed = rig.acquisition.borrow_mut().home_without_index();
        return if homed { Ok(()) } else { Err(StopReason::ZeroLost { port: rig.profile.counter.port.clone() }) };
    }
    let speed = rig.profile.sequence.home_rpm;
    rig.set_load(0.0).await?;
    rig.acquisition.borrow_mut().forget_index();
    rig.set_speed(Some(Direction::Ccw), speed).await?;
    // Both indices pass within one turn of either gear; a half more forgives the ramp.
    let patience =
        rig.ramp_s(speed) + 60.0 / speed * 1.5 / rig.acquisition.borrow().analysis().model().pair.closure().min(1.0);
    let outcome = rig.until("homing", patience, |acquisition| acquisition.index_seen()).await;
    if let Err(reason) = outcome {
        let missing = rig.acquisition.borrow().missing_index();
        return Err(match (reason, missing) {
            (StopReason::TooLong { .. }, Some(which)) => StopReason::NoIndex { which, turns: patience * speed / 60.0 },
            (reason, _) => reason,
        });
    }
    rig.acquisition.borrow_mut().home();
    Ok(())
}

/// Reverses if need be, brings the load up on the rising branch at speed, and waits until both stand.
async fn approach(rig: &mut ConnectedRig, run: &RunSpec, settle: Option<Settle>) -> Result<(), StopReason> {
    rig.enter(Phase::Approach);
    let sense = run.direction.sign();
    let signed = move |speed: f64| speed * sense;
    let turning = rig.acquisition.borrow().latest.speed_rpm;
    if signed(turning) < 0.0 {
        rig.set_speed(None, 0.0).await?;
        let patience = rig.ramp_s(turning);
        rig.until("the ramp to standstill", patience, |a| a.latest.speed_rpm.abs() < 0.05).await?;
    }
    // From no current upwards, so that the torque lies on the branch that was calibrated.
    rig.set_load(0.0).await?;
    rig.hold(rig.profile.sequence.load_s).await?;
    rig.set_speed(Some(run.direction), run.speed_rpm).await?;
    let speed = run.speed_rpm;
    let patience = rig.ramp_s(speed) + 2.0;
    rig.until("the ramp to speed", patience, move |a| (signed(a.latest.speed_rpm) - speed).abs() < 0.05 * speed)
        .await?;
    rig.set_load(run.load_nm).await?;
    rig.hold(rig.profile.sequence.load_s).await?;

    rig.enter(Phase::Settle);
    let from = rig.acquisition.borrow().latest.theta1_rad;
    rig.hold(rig.profile.sequence.settle_s).await?;
    let turns = rig.profile.sequence.settle_turns * std::f64::consts::TAU;
    let patience = 60.0 / speed * (rig.profile.sequence.settle_turns + 0.5);
    rig.until("settling", patience, move |a| signed(a.latest.theta1_rad - from) >= turns).await?;
    match settle.filter(|_| run.kind != Kind::WarmUp) {
        Some(settle) => settle_by_measurement(rig, run, settle).await,
        None => Ok(()),
    }
}

/// Waits until TE repeats from revolution to revolution, or the patience of the plan is over; the log says which.
async fn settle_by_measurement(rig: &mut ConnectedRig, run: &RunSpec, settle: Settle) -> Result<(), StopReason> {
    let from = rig.acquisition.borrow().latest.theta1_rad;
    let mut monitor = SettleMonitor::new(settle, from);
    let longest = settle.turns_max * std::f64::consts::TAU;
    let patience = 60.0 / run.speed_rpm * (settle.turns_max + 0.5) * 1.2 + 2.0;
    let stop = rig.stop.clone();
    rig.until("settling by measurement", patience, |acquisition| {
        let latest = &acquisition.latest;
        monitor.push(latest.theta1_rad, latest.residual_rad);
        monitor.is_stable() || stop.paused() || (latest.theta1_rad - from).abs() >= longest
    })
    .await?;
    let rig = rig.acquisition.borrow();
    let turns = (rig.latest.theta1_rad - from).abs() / std::f64::consts::TAU;
    let change = monitor.change_rad().map_or("unknown".into(), |change| format!("{:.2} µrad", change * 1e6));
    let (level, verdict) = if monitor.is_stable() {
        (Level::Info, "settled")
    } else {
        (Level::Warning, "NOT settled, recorded all the same")
    };
    rig.event(level, "settle", format!("{verdict} after {turns:.2} turns: TE changes by {change} a revolution"));
    Ok(())
}

/// Turns under load without recording.
async fn warm_up(rig: &mut ConnectedRig, run: &RunSpec) -> Result<(), StopReason> {
    let from = rig.acquisition.borrow().latest.theta1_rad;
    let turns = run.revolutions * std::f64::consts::TAU;
    let patience = 60.0 / run.speed_rpm * (run.revolutions + 0.2) * 1.2 + 2.0;
    let stop = rig.stop.clone();
    rig.until("warming up", patience, move |a| stop.paused() || (a.latest.theta1_rad - from).abs() >= turns).await?;
    // An interrupted warm-up is done again, for meanwhile the rig has cooled.
    check_pause(rig)
}

/// Records whole revolutions: as many as are wanted, or up to the end of the one in which a pause was asked for.
async fn record(rig: &mut ConnectedRig, run: &RunSpec, revolutions: f64) -> Result<f64, StopReason> {
    let conditions = RunConditions { direction: run.direction, load_nm: run.load_nm, speed_rpm: run.speed_rpm };
    rig.acquisition.borrow_mut().arm(conditions, revolutions);
    let patience = 60.0 / run.speed_rpm * (revolutions + 0.2) * 1.2 + 2.0;
    let stop = rig.stop.clone();
    let mut asked = false;
    rig.until("recording", patience, |acquisition| {
        if stop.paused() && !std::mem::replace(&mut asked, true) {
            acquisition.end_with_revolution();
        }
        acquisition.recorded()
    })
    .await?;
    let mut acquisition = rig.acquisition.borrow_mut();
    let recorded = acquisition.recorded_revolutions();
    rig.finished_revolutions += recorded;
    acquisition.latest.revolutions = 0.0;
    Ok(recorded)
}
