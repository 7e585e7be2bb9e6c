//! The connected rig: three devices, their limits, and the order in which they are switched off.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use gearmodel::Direction;
use riglog::proto::Level;
use riglog::proto::Phase;
use tokio::task::JoinHandle;
use tokio::time::{Instant, MissedTickBehavior, sleep};

use super::acquire::Acquisition;
use super::halt::Halt;
use super::progress::Progress;
use super::stop::StopRequests;
use crate::clock::Clock;
use crate::device::{Brake, Counter, DeviceError, Servo};
use crate::profile::Profile;

/// Slower than this the shafts stand still, rpm of the driver.
const STANDSTILL_RPM: f64 = 0.02;

/// The connected rig.
pub struct Rig {
    /// The profile in force.
    pub profile: Profile,
    /// The servo drive.
    pub servo: Box<dyn Servo>,
    /// The brake's driver.
    pub brake: Box<dyn Brake>,
    /// The acquisition; shared with the task that reads the counter.
    pub acquisition: Rc<RefCell<Acquisition>>,
    /// The host's clock.
    pub clock: Clock,
    /// The operator's wish to stop.
    pub stop: StopRequests,
    /// The progress line.
    pub progress: Progress,
    /// Revolutions recorded by finished runs.
    pub finished_revolutions: f64,
    stream: Option<Stream>,
    poll: tokio::time::Interval,
    slip_heat_j: f64,
    heat_updated: Instant,
    moving: bool,
}

/// The task that reads the counter.
struct Stream {
    task: JoinHandle<()>,
    failure: Rc<RefCell<Option<DeviceError>>>,
    end: Rc<tokio::sync::Notify>,
}

impl Rig {
    /// A rig of connected devices.
    #[must_use]
    pub fn new(
        profile: Profile,
        servo: Box<dyn Servo>,
        brake: Box<dyn Brake>,
        acquisition: Rc<RefCell<Acquisition>>,
        clock: Clock,
        stop: StopRequests,
        progress: Progress,
    ) -> Self {
        let mut poll = tokio::time::interval(profile.poll_period());
        poll.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Self {
            profile,
            servo,
            brake,
            acquisition,
            clock,
            stop,
            progress,
            finished_revolutions: 0.0,
            stream: None,
            poll,
            slip_heat_j: 0.0,
            heat_updated: Instant::now(),
            moving: false,
        }
    }

    /// Reads the counter in a task of its own from now on, so that no Modbus transaction ever holds it up.
    pub fn stream_from(&mut self, mut counter: Box<dyn Counter>) {
        let failure = Rc::new(RefCell::new(None));
        let end = Rc::new(tokio::sync::Notify::new());
        let (acquisition, failed, ended) = (Rc::clone(&self.acquisition), Rc::clone(&failure), Rc::clone(&end));
        let task = tokio::task::spawn_local(async move {
            loop {
                tokio::select! {
                    biased;
                    batch = counter.next() => match batch {
                        Ok(batch) => acquisition.borrow_mut().take(&batch),
                        Err(error) => {
                            *failed.borrow_mut() = Some(error);
                            return;
                        }
                    },
                    () = ended.notified() => break,
                }
            }
            // A box that does not hear its stop notices the closed line.
            if let Err(error) = counter.stop().await {
                tracing::warn!("{error}");
            }
        });
        self.stream = Some(Stream { task, failure, end });
    }

    /// One poll: renews the lease, reads both drives, writes the state, and checks every limit.
    ///
    /// # Errors
    /// [`Halt`] when the run has to end.
    pub async fn tick(&mut self) -> Result<(), Halt> {
        self.poll.tick().await;
        self.heed_stop()?;
        self.observe().await?;
        self.supervise()
    }

    /// Before anything that moves.
    ///
    /// # Errors
    /// [`Halt::Operator`] when a stop was asked for.
    pub fn heed_stop(&self) -> Result<(), Halt> {
        if self.stop.any() { Err(Halt::Operator) } else { Ok(()) }
    }

    /// Reads both drives and writes the state.
    async fn observe(&mut self) -> Result<(), Halt> {
        let servo = self.servo.status().await?;
        let lease_s = self.profile.sequence.lease_s;
        let brake = keep_lease(self.servo.as_mut(), lease_s, self.brake.status()).await?;
        {
            let mut rig = self.acquisition.borrow_mut();
            rig.status.servo_alarm = servo.alarm;
            rig.status.brake_current_a = brake.current_a;
            rig.status.brake_temperature_c = brake.temperature_c;
            rig.status.load_nm = self.profile.brake.load_nm(brake.current_a);
            rig.write_state();
            self.progress.show(&rig, self.finished_revolutions + rig.latest.revolutions);
        }
        if servo.alarm != 0 {
            return Err(Halt::Alarm { alarm: servo.alarm });
        }
        if brake.tripped {
            return Err(Halt::BrakeTripped);
        }
        Ok(())
    }

    fn supervise(&mut self) -> Result<(), Halt> {
        let rig = self.acquisition.borrow();
        if let Some(failure) = rig.recorder().take_failure() {
            return Err(Halt::Log(failure));
        }
        if let Some(stream) = &self.stream {
            if let Some(failure) = stream.failure.borrow_mut().take() {
                return Err(Halt::Device(failure));
            }
            let silent_ms = self.clock.now_ns().saturating_sub(rig.latest.arrived_ns) as f64 * 1e-6;
            let limit_ms = self.profile.limits.encoder_silence_ms;
            if rig.latest.arrived_ns > 0 && silent_ms > limit_ms {
                let port = self.profile.counter.port.clone();
                return Err(Halt::EncodersSilent { port, silent_ms, limit_ms });
            }
        }
        let limits = &self.profile.limits;
        let over = |quantity, value: f64, limit: f64, unit, key, advice| {
            if value > limit { Err(Halt::Limit { quantity, value, limit, unit, key, advice }) } else { Ok(()) }
        };
        // The ramp may overshoot a setpoint at the limit by a little.
        over(
            "driver speed",
            rig.latest.speed_rpm.abs(),
            limits.speed_rpm * 1.1,
            "rpm",
            "limits.speed_rpm, and a tenth",
            "check servo.reduction and the drive's tuning",
        )?;
        over(
            "brake temperature",
            rig.status.brake_temperature_c,
            limits.brake_temperature_c,
            "°C",
            "limits.brake_temperature_c",
            "let the brake cool, or lower load or speed",
        )?;
        over(
            "TE excursion",
            rig.latest.excursion_rad * 1e3,
            limits.te_excursion_mrad,
            "mrad",
            "limits.te_excursion_mrad",
            "inspect the teeth before the next run",
        )?;
        // Heat account: what goes in above the continuous power leaves at the same rate; a minute's worth is the limit.
        let seconds = self.heat_updated.elapsed().as_secs_f64();
        self.heat_updated = Instant::now();
        let power_w = slip_power_w(rig.status.load_nm, rig.latest.speed_rpm);
        self.slip_heat_j = (self.slip_heat_j + (power_w - limits.slip_power_w) * seconds).max(0.0);
        over(
            "brake heat account",
            self.slip_heat_j,
            limits.slip_power_w * 60.0,
            "J",
            "60 s of limits.slip_power_w",
            "lower load or speed, or pause between runs",
        )
    }

    /// Polls until `done`; an error when it takes longer than `seconds`.
    ///
    /// # Errors
    /// [`Halt`], among them [`Halt::TooLong`].
    pub async fn until(
        &mut self,
        what: &'static str,
        seconds: f64,
        mut done: impl FnMut(&Acquisition) -> bool,
    ) -> Result<(), Halt> {
        let deadline = Instant::now() + Duration::from_secs_f64(seconds);
        loop {
            self.tick().await?;
            let rig = self.acquisition.borrow();
            if done(&rig) {
                return Ok(());
            }
            if Instant::now() > deadline {
                let now = format!("{:.2} rpm, {:.2} N·m", rig.latest.speed_rpm, rig.status.load_nm);
                return Err(Halt::TooLong { what, seconds, now });
            }
        }
    }

    /// Polls for a time.
    ///
    /// # Errors
    /// [`Halt`].
    pub async fn hold(&mut self, seconds: f64) -> Result<(), Halt> {
        let end = Instant::now() + Duration::from_secs_f64(seconds);
        while Instant::now() < end {
            self.tick().await?;
        }
        Ok(())
    }

    /// Enters a phase and says so in the log.
    pub fn enter(&mut self, phase: Phase) {
        let mut rig = self.acquisition.borrow_mut();
        rig.status.phase = phase;
        rig.write_state();
    }

    /// Speed setpoint of the driver, rpm, + = ccw.
    ///
    /// # Errors
    /// [`Halt::Device`].
    pub async fn set_speed(&mut self, direction: Option<Direction>, speed_rpm: f64) -> Result<(), Halt> {
        {
            let mut rig = self.acquisition.borrow_mut();
            rig.status.speed_setpoint_rpm = speed_rpm;
            if direction.is_some() {
                rig.status.direction = direction;
            }
        }
        self.moving |= speed_rpm != 0.0;
        let sense = direction.map_or(0.0, Direction::sign) * f64::from(self.profile.servo.sense);
        Ok(self.servo.set_motor_rpm(sense * speed_rpm * self.profile.servo.reduction).await?)
    }

    /// Load setpoint at the driven gear, N·m, by the branch of the brake's curve on which the current then lies.
    ///
    /// # Errors
    /// [`Halt::Device`].
    pub async fn set_load(&mut self, load_nm: f64) -> Result<(), Halt> {
        let from_a = {
            let mut rig = self.acquisition.borrow_mut();
            rig.status.load_setpoint_nm = load_nm;
            rig.status.brake_current_a
        };
        let current = self.profile.brake.current_from_a(load_nm, from_a).unwrap_or(0.0);
        self.set_coil_current(current).await
    }

    /// Current of the brake's coil, A: for its calibration, which has no curve yet.
    ///
    /// # Errors
    /// [`Halt::Device`].
    pub async fn set_coil_current(&mut self, current: f64) -> Result<(), Halt> {
        let lease_s = self.profile.sequence.lease_s;
        Ok(keep_lease(self.servo.as_mut(), lease_s, self.brake.set_current_a(current)).await?)
    }

    /// Time that the drive needs from one driver speed to another, and a little, s.
    #[must_use]
    pub fn ramp_s(&self, speed_rpm: f64) -> f64 {
        let servo = &self.profile.servo;
        1.0 + 1.5 * speed_rpm.abs() * servo.reduction / 3000.0 * servo.accel_ms.max(servo.decel_ms) * 1e-3
    }

    /// Switches off in the safe order: ramp to 0 under load, standstill by the encoders, brake to 0, servo off.
    ///
    /// Every step is tried whatever became of the one before. `hurried` skips the ramp. Returns what went wrong on the way.
    pub async fn switch_off(&mut self, hurried: bool) -> Vec<String> {
        let mut troubles = Vec::new();
        self.acquisition.borrow_mut().abandon();
        self.enter(Phase::Stopping);
        let servo_lost = match self.set_speed(None, 0.0).await {
            Ok(()) => false,
            Err(error) => {
                troubles.push(format!("speed 0 was not accepted: {error}"));
                true
            }
        };
        let mut still = !self.moving;
        if self.moving && !hurried {
            still = self.await_standstill(servo_lost, &mut troubles).await;
        }
        if servo_lost && !still {
            // The brake holds what the servo no longer does; only a person can take the power away.
            troubles.push("the servo does not answer and the shaft may turn: the brake keeps its load; press the emergency stop and switch the drive off by hand".into());
        } else {
            self.acquisition.borrow_mut().status.load_setpoint_nm = 0.0;
            let lease_s = self.profile.sequence.lease_s;
            if let Err(error) = keep_lease(self.servo.as_mut(), lease_s, self.brake.release()).await {
                troubles.push(format!("brake was not switched off: {error}; switch it off at its panel"));
            }
        }
        match self.servo.set_enabled(false).await {
            Err(error) if !servo_lost => {
                troubles.push(format!("servo was not switched off: {error}; switch it off by hand"));
            }
            Err(_) if still && self.moving => troubles.push(
                "the shafts stand still, but the servo does not answer and may be on: switch the drive off by hand before you touch the rig".into(),
            ),
            _ => {}
        }
        if let Some(mut stream) = self.stream.take() {
            stream.end.notify_one();
            // One batch is always on its way; a task that has ended does not wait.
            if tokio::time::timeout(Duration::from_secs(2), &mut stream.task).await.is_err() {
                troubles.push("counter did not acknowledge its stop".into());
                // It must not hold the acquisition any longer, for the log is finalised next.
                stream.task.abort();
                let _ = stream.task.await;
            }
        }
        self.enter(Phase::Idle);
        troubles
    }

    /// Waits until the encoders say that the shafts stand still.
    async fn await_standstill(&mut self, servo_lost: bool, troubles: &mut Vec<String>) -> bool {
        let speed = self.acquisition.borrow().latest.speed_rpm;
        // A drive that lost its master ramps down when its watchdog elapses.
        let lease = if servo_lost { self.profile.sequence.lease_s } else { 0.0 };
        let deadline = Instant::now() + Duration::from_secs_f64(self.ramp_s(speed) + lease + 1.0);
        loop {
            if let Err(error) = self.observe().await {
                tracing::debug!("while stopping: {error}");
            }
            sleep(self.profile.poll_period()).await;
            let rig = self.acquisition.borrow();
            let fresh = self.clock.now_ns().saturating_sub(rig.latest.arrived_ns) < 300_000_000;
            if fresh && rig.latest.speed_rpm.abs() < STANDSTILL_RPM {
                return true;
            }
            if self.stop.hurried() {
                troubles.push("the ramp was skipped at the operator's second request".into());
                return false;
            }
            if Instant::now() > deadline {
                let reason = if fresh {
                    format!("the driver still turns at {:.3} rpm", rig.latest.speed_rpm)
                } else {
                    "the encoders are silent".into()
                };
                troubles.push(format!("standstill could not be confirmed: {reason}"));
                rig.event(Level::Error, "stop", "standstill could not be confirmed".into());
                return false;
            }
        }
    }
}

/// Waits for `work` on another device and renews the servo's lease meanwhile: a device that no longer answers takes its
/// time-outs, and the servo shall be stopped by its ramp, not by its watchdog.
async fn keep_lease<T>(servo: &mut dyn Servo, lease_s: f64, work: impl Future<Output = T>) -> T {
    let mut work = std::pin::pin!(work);
    loop {
        // Half of the lease is left for the transaction that renews it.
        match tokio::time::timeout(Duration::from_secs_f64(0.5 * lease_s), &mut work).await {
            Ok(done) => return done,
            Err(_) => {
                if let Err(error) = servo.status().await {
                    tracing::debug!("while another device is awaited: {error}");
                }
            }
        }
    }
}

/// Power that the brake turns into heat: W = T·ω of the driven gear; its mean speed is the driver's.
#[must_use]
pub fn slip_power_w(load_nm: f64, speed_rpm: f64) -> f64 {
    load_nm * speed_rpm.abs() * std::f64::consts::TAU / 60.0
}
