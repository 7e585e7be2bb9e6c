//! The connected rig: three devices, polled and supervised. What may turn is the supervisor's; how it stops is in `stopping.rs`.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use gearmodel::Direction;
use riglog::proto::Phase;
use tokio::task::JoinHandle;
use tokio::time::{Instant, MissedTickBehavior};

use super::acquire::Acquisition;
use super::dialer::Dialer;
use super::limits::{self, HeatAccount, Observed};
use super::progress::Progress;
use super::stop::StopRequests;
use super::stop_reason::{StopReason, lost_device};
use super::supervisor::{Event, State};
use crate::clock::Clock;
use crate::device::{Brake, BrakeStatus, Counter, DeviceError, DeviceKind, Servo, ServoStatus};
use crate::profile::Profile;

/// The three drivers.
pub struct Devices {
    /// The servo drive.
    pub servo: Box<dyn Servo>,
    /// The brake's driver.
    pub brake: Box<dyn Brake>,
    /// The reader of the encoders.
    pub counter: Box<dyn Counter>,
}

/// The connected rig.
pub struct ConnectedRig {
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
    /// The operator's wish to stop or to pause.
    pub stop: StopRequests,
    /// The progress line.
    pub progress: Progress,
    /// Revolutions recorded by finished runs.
    pub finished_revolutions: f64,
    /// The brake's heat above what it sheds.
    pub heat: HeatAccount,
    pub(super) state: State,
    /// Connected, but not streaming.
    pub(super) counter: Option<Box<dyn Counter>>,
    pub(super) stream: Option<Stream>,
    pub(super) dialer: Dialer,
    /// Devices that do not answer, in the order of [`DeviceKind::ALL`].
    pub(super) lost: [bool; 3],
    poll: tokio::time::Interval,
    heat_updated: Instant,
    /// When the servo last took a command.
    pub(super) heard: Instant,
}

/// The task that reads the counter.
pub(super) struct Stream {
    pub(super) task: JoinHandle<()>,
    pub(super) failure: Rc<RefCell<Option<DeviceError>>>,
    pub(super) end: Rc<tokio::sync::Notify>,
}

impl ConnectedRig {
    /// A rig of connected devices.
    #[must_use]
    pub fn new(
        profile: Profile,
        devices: Devices,
        dialer: Dialer,
        acquisition: Rc<RefCell<Acquisition>>,
        clock: Clock,
        stop: StopRequests,
        progress: Progress,
    ) -> Self {
        let mut poll = tokio::time::interval(profile.poll_period());
        poll.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Self {
            profile,
            servo: devices.servo,
            brake: devices.brake,
            counter: Some(devices.counter),
            acquisition,
            clock,
            stop,
            progress,
            finished_revolutions: 0.0,
            heat: HeatAccount::default(),
            state: State::Off,
            stream: None,
            dialer,
            lost: [false; 3],
            poll,
            heat_updated: Instant::now(),
            heard: Instant::now(),
        }
    }

    /// What the supervisor allows.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// Tells the supervisor an event of starting or running; stops go through [`ConnectedRig::switch_off`], which performs their actions.
    pub(super) fn apply_event(&mut self, event: Event) {
        debug_assert!(!event.is_stop(), "{event:?} has actions");
        self.state = self.state.on(event).0;
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
                        Ok(batch) => {
                            let mut acquisition = acquisition.borrow_mut();
                            acquisition.note_clocks(counter.clocks());
                            acquisition.take(&batch);
                        }
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

    /// Ends the counter's stream; what went wrong with that.
    pub async fn end_stream(&mut self) -> Option<String> {
        let mut stream = self.stream.take()?;
        stream.end.notify_one();
        // One batch is always on its way; a task that has ended does not wait.
        if tokio::time::timeout(Duration::from_secs(2), &mut stream.task).await.is_ok() {
            return None;
        }
        // It must not hold the acquisition any longer, for the log is finalised next.
        stream.task.abort();
        let _ = stream.task.await;
        Some("counter did not acknowledge its stop".into())
    }

    /// One poll: renews the lease, reads both drives, writes the state, and checks every limit.
    ///
    /// # Errors
    /// [`StopReason`] when the run has to end.
    pub async fn tick(&mut self) -> Result<(), StopReason> {
        self.poll.tick().await;
        self.check_stop()?;
        self.check_lease()?;
        self.observe().await?;
        self.supervise()
    }

    /// Before anything that moves.
    ///
    /// # Errors
    /// [`StopReason::Operator`] when a stop was asked for.
    pub fn check_stop(&self) -> Result<(), StopReason> {
        if self.stop.any() { Err(StopReason::Operator) } else { Ok(()) }
    }

    /// A process that was frozen finds that its lease has run out: what it believed of the rig is old.
    fn check_lease(&self) -> Result<(), StopReason> {
        let (silent_s, lease_s) = (self.heard.elapsed().as_secs_f64(), self.profile.sequence.lease_s);
        let held = matches!(self.state, State::Standing | State::Turning);
        if held && silent_s > lease_s { Err(StopReason::LeaseExpired { silent_s, lease_s }) } else { Ok(()) }
    }

    /// Remembers whether a device answers.
    pub(super) fn note<T>(&mut self, outcome: Result<T, DeviceError>) -> Result<T, StopReason> {
        if let Err(error) = &outcome
            && let Some(device) = lost_device(error)
        {
            self.lose(device);
        }
        Ok(outcome?)
    }

    pub(super) fn lose(&mut self, device: DeviceKind) {
        self.lost[device as usize] = true;
    }

    /// Reads the servo, and renews its lease by that.
    async fn servo_status(&mut self) -> Result<ServoStatus, StopReason> {
        let status = self.servo.status().await;
        if status.is_ok() {
            self.heard = Instant::now();
        }
        self.note(status)
    }

    /// Reads the brake's driver, and renews the servo's lease if that takes long.
    pub(super) async fn brake_status(&mut self) -> Result<BrakeStatus, StopReason> {
        let lease_s = self.profile.sequence.lease_s;
        let status = keep_lease(self.servo.as_mut(), &mut self.heard, lease_s, self.brake.status()).await;
        let status = self.note(status)?;
        let mut rig = self.acquisition.borrow_mut();
        rig.status.brake_current_a = status.current_a;
        rig.status.brake_temperature_c = status.temperature_c;
        rig.status.load_nm = self.profile.brake.load_nm(status.current_a);
        Ok(status)
    }

    /// Reads both drives and writes the state.
    pub(super) async fn observe(&mut self) -> Result<(), StopReason> {
        let servo = self.servo_status().await?;
        self.acquisition.borrow_mut().status.servo_alarm = servo.alarm;
        let brake = self.brake_status().await?;
        self.book_heat();
        {
            let rig = self.acquisition.borrow();
            rig.write_state();
            self.progress.show(&rig, self.finished_revolutions + rig.latest.revolutions);
        }
        if self.servo.is_emergency_stop(servo.alarm) {
            return Err(StopReason::EmergencyStop { alarm: servo.alarm });
        }
        if servo.alarm != 0 {
            return Err(StopReason::Alarm { alarm: servo.alarm });
        }
        if brake.tripped {
            return Err(StopReason::BrakeTripped);
        }
        Ok(())
    }

    /// Books the slip since the last time.
    pub(super) fn book_heat(&mut self) {
        let seconds = self.heat_updated.elapsed().as_secs_f64();
        self.heat_updated = Instant::now();
        let rig = self.acquisition.borrow();
        self.heat.book(&self.profile.limits, rig.status.load_nm, rig.latest.speed_rpm, seconds);
    }

    fn supervise(&mut self) -> Result<(), StopReason> {
        self.log_works()?;
        self.encoders_live()?;
        let observed = {
            let rig = self.acquisition.borrow();
            Observed {
                speed_rpm: rig.latest.speed_rpm,
                load_nm: rig.status.load_nm,
                brake_temperature_c: rig.status.brake_temperature_c,
                excursion_rad: rig.latest.excursion_rad,
            }
        };
        limits::check(&self.profile.limits, &observed)?;
        Ok(self.heat.check(&self.profile.limits)?)
    }

    /// The log is still being written.
    pub(super) fn log_works(&self) -> Result<(), StopReason> {
        let rig = self.acquisition.borrow();
        match rig.recorder().take_failure() {
            Some(failure) => Err(StopReason::Log(failure)),
            None if rig.recorder().unwritten() > 0 => Err(StopReason::Panic { what: "the recorder has ended".into() }),
            None => Ok(()),
        }
    }

    /// The encoders' stream is alive and fresh.
    pub(super) fn encoders_live(&mut self) -> Result<(), StopReason> {
        let Some(stream) = &self.stream else { return Ok(()) };
        let failure = stream.failure.borrow_mut().take();
        if let Some(failure) = failure {
            return self.note(Err(failure));
        }
        let arrived_ns = self.acquisition.borrow().latest.arrived_ns;
        let silent_ms = self.clock.now_ns().saturating_sub(arrived_ns) as f64 * 1e-6;
        let limit_ms = self.profile.limits.encoder_silence_ms;
        if arrived_ns > 0 && silent_ms > limit_ms {
            self.lose(DeviceKind::Counter);
            let port = self.profile.counter.port.clone();
            return Err(StopReason::EncodersSilent { port, silent_ms, limit_ms });
        }
        Ok(())
    }

    /// Polls until `done`; an error when it takes longer than `seconds`.
    ///
    /// # Errors
    /// [`StopReason`], among them [`StopReason::TooLong`].
    pub async fn until(
        &mut self,
        what: &'static str,
        seconds: f64,
        mut done: impl FnMut(&mut Acquisition) -> bool,
    ) -> Result<(), StopReason> {
        let deadline = Instant::now() + Duration::from_secs_f64(seconds);
        loop {
            self.tick().await?;
            let mut rig = self.acquisition.borrow_mut();
            if done(&mut rig) {
                return Ok(());
            }
            if Instant::now() > deadline {
                let now = format!("{:.2} rpm, {:.2} N·m", rig.latest.speed_rpm, rig.status.load_nm);
                return Err(StopReason::TooLong { what, seconds, now });
            }
        }
    }

    /// Polls for a time.
    ///
    /// # Errors
    /// [`StopReason`].
    pub async fn hold(&mut self, seconds: f64) -> Result<(), StopReason> {
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

    /// Speed setpoint of the driver, rpm, + = ccw; any but 0 only where the supervisor allows motion.
    ///
    /// # Errors
    /// [`StopReason::NotPermitted`], [`StopReason::Device`].
    pub async fn set_speed(&mut self, direction: Option<Direction>, speed_rpm: f64) -> Result<(), StopReason> {
        if speed_rpm != 0.0 {
            self.apply_event(Event::Motion);
            if self.state != State::Turning {
                return Err(StopReason::NotPermitted { speed_rpm, state: self.state });
            }
        }
        {
            let mut rig = self.acquisition.borrow_mut();
            rig.status.speed_setpoint_rpm = speed_rpm;
            if direction.is_some() {
                rig.status.direction = direction;
            }
        }
        let sense = direction.map_or(0.0, Direction::sign) * f64::from(self.profile.servo.sense);
        let set = self.servo.set_motor_rpm(sense * speed_rpm * self.profile.servo.reduction).await;
        if set.is_ok() {
            self.heard = Instant::now();
        }
        self.note(set)
    }

    /// Load setpoint at the driven gear, N·m, by the branch of the brake's curve on which the current then lies.
    ///
    /// # Errors
    /// [`StopReason::Device`].
    pub async fn set_load(&mut self, load_nm: f64) -> Result<(), StopReason> {
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
    /// [`StopReason::Device`].
    pub async fn set_coil_current(&mut self, current_a: f64) -> Result<(), StopReason> {
        let lease_s = self.profile.sequence.lease_s;
        let set = self.brake.set_current_a(current_a);
        let set = keep_lease(self.servo.as_mut(), &mut self.heard, lease_s, set).await;
        self.note(set)
    }

    /// Brake to zero current, output off.
    pub(super) async fn release_brake(&mut self) -> Result<(), StopReason> {
        self.acquisition.borrow_mut().status.load_setpoint_nm = 0.0;
        let lease_s = self.profile.sequence.lease_s;
        let released = keep_lease(self.servo.as_mut(), &mut self.heard, lease_s, self.brake.release()).await;
        self.note(released)
    }

    /// Time that the drive needs from one driver speed to another, and a little, s.
    #[must_use]
    pub fn ramp_s(&self, speed_rpm: f64) -> f64 {
        let servo = &self.profile.servo;
        1.0 + 1.5 * speed_rpm.abs() * servo.reduction / 3000.0 * servo.accel_ms.max(servo.decel_ms) * 1e-3
    }
}

/// Waits for `work` on another device and renews the servo's lease meanwhile: a device that no longer answers takes its
/// time-outs, and the servo shall be stopped by its ramp, not by its watchdog.
async fn keep_lease<T>(servo: &mut dyn Servo, heard: &mut Instant, lease_s: f64, work: impl Future<Output = T>) -> T {
    let mut work = std::pin::pin!(work);
    loop {
        // Half of the lease is left for the transaction that renews it.
        match tokio::time::timeout(Duration::from_secs_f64(0.5 * lease_s), &mut work).await {
            Ok(done) => return done,
            Err(_) => match servo.status().await {
                Ok(_) => *heard = Instant::now(),
                Err(error) => tracing::debug!("while another device is awaited: {error}"),
            },
        }
    }
}
