//! The sequence of a run: prepare → home → for each load and sense: approach, settle, record → switch off.

use std::time::Duration;

use gearmodel::Direction;
use gearmodel::measure::RunConditions;
use riglog::proto::Level;
use riglog::proto::Phase;

use super::Plan;
use super::halt::Halt;
use super::rig::Rig;
use crate::device::{Counter, DeviceError};

/// Room on a serial line for a sample of both encoders: two bytes each at speed, and the frame's share.
const BYTES_A_SAMPLE: f64 = 5.0;

/// Runs the plan on a connected rig. The caller switches off afterwards, whatever came back.
///
/// # Errors
/// [`Halt`] says why the plan was not finished.
pub async fn execute(rig: &mut Rig, counter: Box<dyn Counter>, plan: &Plan) -> Result<(), Halt> {
    prepare(rig, counter, plan).await?;
    home(rig).await?;
    for &load_nm in &plan.loads_nm {
        for &direction in &plan.directions {
            approach(rig, plan, direction, load_nm).await?;
            record(rig, plan, direction, load_nm).await?;
        }
    }
    Ok(())
}

/// Identifies the devices, starts the encoders, and arms the drive's watchdog before it is enabled.
pub(super) async fn prepare(rig: &mut Rig, mut counter: Box<dyn Counter>, plan: &Plan) -> Result<(), Halt> {
    rig.enter(Phase::Idle);
    let servo = rig.servo.identify().await?;
    let brake = rig.brake.identify().await?;
    let encoders = counter.identify().await?;
    {
        let mut acquisition = rig.acquisition.borrow_mut();
        let signs = [rig.profile.counter.input_sign, rig.profile.counter.output_sign];
        acquisition.set_encoders(&encoders, signs);
        acquisition.set_mounting([rig.profile.counter.input_mounted_deg, rig.profile.counter.output_mounted_deg]);
        acquisition.event(
            Level::Info,
            "identity",
            format!("servo {}; brake {}; counter {}", servo.text, brake.text, encoders.text),
        );
    }
    refuse_over_limit(rig, &encoders, plan).await?;
    counter.start(plan.rate_hz).await?;
    rig.stream_from(counter);
    rig.brake.prepare(rig.profile.brake.voltage_v).await?;
    // Last, for the drive's watchdog runs from here on.
    let lease_s = rig.profile.sequence.lease_s;
    let (accel, decel) = (rig.profile.servo.accel_ms, rig.profile.servo.decel_ms);
    rig.servo.prepare(accel, decel, Duration::from_secs_f64(lease_s)).await?;
    rig.acquisition.borrow().event(
        Level::Info,
        "lease",
        format!("the drive's watchdog is armed and read back: it stops the motor {lease_s} s after the last request"),
    );
    rig.servo.set_motor_rpm(0.0).await?;
    rig.heed_stop()?;
    rig.servo.set_enabled(true).await?;
    rig.until("the first encoder samples", 2.0, |acquisition| acquisition.samples() > 0).await
}

/// What the devices themselves allow, read back from them.
async fn refuse_over_limit(rig: &mut Rig, encoders: &crate::device::CounterIdentity, plan: &Plan) -> Result<(), Halt> {
    let range = |device, port: &str, quantity, value: f64, limit: f64, unit| {
        if value <= limit {
            return Ok(());
        }
        Err(Halt::Device(DeviceError::Range { device, port: port.to_owned(), quantity, value, limit, unit }))
    };
    let allowed = rig.servo.max_motor_rpm().await?;
    let asked = plan.speed_rpm.max(rig.profile.sequence.home_rpm) * rig.profile.servo.reduction;
    range("servo", &rig.profile.servo.port, "motor speed", asked, allowed, "rpm")?;
    let current = plan.loads_nm.iter().filter_map(|load| rig.profile.brake.current_a(*load)).fold(0.0, f64::max);
    range("brake", &rig.profile.brake.port, "coil current", current, rig.brake.max_current_a(), "A")?;
    let counter = &rig.profile.counter;
    range("counter", &counter.port, "sample rate", plan.rate_hz, encoders.max_rate_hz, "Hz")?;
    // A serial line carries a tenth of its baud rate in bytes; sockets and pipes have no such bound.
    if counter.port.starts_with('/') {
        let limit = f64::from(counter.baud) / 10.0 / BYTES_A_SAMPLE;
        range("counter", &counter.port, "sample rate over its line", plan.rate_hz, limit, "Hz")?;
    }
    Ok(())
}

/// Turns ccw without load until both indices have passed; they are the zero of both angles.
async fn home(rig: &mut Rig) -> Result<(), Halt> {
    rig.enter(Phase::Homing);
    let speed = rig.profile.sequence.home_rpm;
    rig.set_load(0.0).await?;
    rig.acquisition.borrow_mut().forget_index();
    rig.set_speed(Some(Direction::Ccw), speed).await?;
    // Both indices pass within one turn of either gear; a half more forgives the ramp.
    let patience =
        rig.ramp_s(speed) + 60.0 / speed * 1.5 / rig.acquisition.borrow().analysis().model().pair.closure().min(1.0);
    let outcome = rig.until("homing", patience, super::acquire::Acquisition::index_seen).await;
    if let Err(halt) = outcome {
        let missing = rig.acquisition.borrow().missing_index();
        return Err(match (halt, missing) {
            (Halt::TooLong { .. }, Some(which)) => Halt::NoIndex { which, turns: patience * speed / 60.0 },
            (halt, _) => halt,
        });
    }
    rig.acquisition.borrow_mut().home();
    Ok(())
}

/// Reverses if need be, brings the load up on the rising branch at speed, and waits until both stand.
async fn approach(rig: &mut Rig, plan: &Plan, direction: Direction, load_nm: f64) -> Result<(), Halt> {
    rig.enter(Phase::Approach);
    let sense = direction.sign();
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
    rig.set_speed(Some(direction), plan.speed_rpm).await?;
    let speed = plan.speed_rpm;
    let patience = rig.ramp_s(speed) + 2.0;
    rig.until("the ramp to speed", patience, move |a| (signed(a.latest.speed_rpm) - speed).abs() < 0.05 * speed)
        .await?;
    rig.set_load(load_nm).await?;
    rig.hold(rig.profile.sequence.load_s).await?;

    rig.enter(Phase::Settle);
    let from = rig.acquisition.borrow().latest.theta1_rad;
    rig.hold(rig.profile.sequence.settle_s).await?;
    let turns = rig.profile.sequence.settle_turns * std::f64::consts::TAU;
    let patience = 60.0 / speed * (rig.profile.sequence.settle_turns + 0.5);
    rig.until("settling", patience, move |a| signed(a.latest.theta1_rad - from) >= turns).await
}

/// Records whole revolutions.
async fn record(rig: &mut Rig, plan: &Plan, direction: Direction, load_nm: f64) -> Result<(), Halt> {
    let conditions = RunConditions { direction, load_nm, speed_rpm: plan.speed_rpm };
    rig.acquisition.borrow_mut().arm(conditions, plan.revolutions);
    let patience = 60.0 / plan.speed_rpm * (plan.revolutions + 0.2) * 1.2 + 2.0;
    rig.until("recording", patience, super::acquire::Acquisition::recorded).await?;
    let mut acquisition = rig.acquisition.borrow_mut();
    rig.finished_revolutions += plan.revolutions;
    acquisition.latest.revolutions = 0.0;
    Ok(())
}
