//! Performs a stop as the supervisor orders it: ramp to 0 under load → standstill by the encoders → brake to 0 → servo off.

use std::collections::VecDeque;
use std::time::Duration;

use riglog::proto::{Level, Phase};
use tokio::time::{Instant, sleep};

use super::connected_rig::ConnectedRig;
use super::stop_reason::StopReason;
use super::supervisor::{Action, Event, State};
use crate::device::DeviceKind;

/// Slower than this the shafts stand still, rpm of the driver.
const STANDSTILL_RPM: f64 = 0.02;
/// Samples older than this say nothing about standstill.
const FRESH_NS: u64 = 300_000_000;
/// How often a servo that was lost is called while the brake holds.
const CALL_PERIOD: Duration = Duration::from_millis(500);
/// How often a person is called again.
const REMIND: Duration = Duration::from_secs(10);

/// A stop under way.
struct Stopping {
    troubles: Vec<String>,
    deadline: Instant,
    patience: Duration,
    /// Looks in a row that found the shafts at rest.
    still: u32,
    next_call: Instant,
}

impl Stopping {
    fn trouble(&mut self, rig: &ConnectedRig, what: String) {
        if !self.troubles.contains(&what) {
            rig.acquisition.borrow().event(Level::Error, "stop", what.clone());
            self.troubles.push(what);
        }
    }
}

impl ConnectedRig {
    /// Switches off for a reason. Every step is tried whatever became of the one before; returns what went wrong on the way.
    pub async fn switch_off(&mut self, reason: Event) -> Vec<String> {
        debug_assert!(reason.is_stop(), "{reason:?} is no reason to stop");
        self.acquisition.borrow_mut().abandon();
        self.enter(Phase::Stopping);
        let was_on = matches!(self.state, State::Standing | State::Turning);
        let mut stop = Stopping {
            troubles: Vec::new(),
            deadline: Instant::now(),
            patience: Duration::ZERO,
            still: 0,
            next_call: Instant::now(),
        };
        let mut events = VecDeque::from([reason]);
        loop {
            let event = match events.pop_front() {
                Some(event) => event,
                None => self.await_event(&mut stop).await,
            };
            let before = self.state;
            let (next, actions) = before.on(event);
            self.state = next;
            if next != before && matches!(next, State::Ramping | State::Holding) {
                self.set_deadline(&mut stop);
            }
            for action in actions {
                events.extend(self.perform(*action, was_on, &mut stop).await);
            }
            if self.state == State::Off {
                break;
            }
        }
        self.acquisition.borrow_mut().status.direction = None;
        self.enter(Phase::Idle);
        stop.troubles
    }

    /// How long standstill may take from here.
    fn set_deadline(&self, stop: &mut Stopping) {
        // A drive that lost its master ramps down when its watchdog elapses.
        let lease_s = if self.state == State::Holding { self.profile.sequence.lease_s.ceil() } else { 0.0 };
        let speed_rpm = self.acquisition.borrow().latest.speed_rpm;
        stop.patience = Duration::from_secs_f64(self.ramp_s(speed_rpm) + lease_s + 1.0);
        stop.deadline = Instant::now() + stop.patience;
        stop.still = 0;
    }

    /// Does what the supervisor says; the answer of the device is the next event.
    async fn perform(&mut self, action: Action, was_on: bool, stop: &mut Stopping) -> Option<Event> {
        match action {
            Action::ZeroSpeed => match self.set_speed(None, 0.0).await {
                Ok(()) => Some(Event::ServoBack).filter(|_| self.state == State::Holding),
                Err(error) => {
                    stop.trouble(self, format!("speed 0 was not accepted: {error}"));
                    Some(Event::ServoLost).filter(|_| self.state == State::Ramping)
                }
            },
            Action::HoldLoad => {
                let load_nm = self.acquisition.borrow().status.load_setpoint_nm;
                let what =
                    format!("the servo does not answer: the brake keeps its {load_nm} N·m until the shafts stand");
                self.acquisition.borrow().event(Level::Warning, "stop", what);
                None
            }
            Action::BrakeToZero => match self.release_brake().await {
                Ok(()) => Some(Event::BrakeAtZero),
                Err(error) => {
                    stop.trouble(self, format!("brake was not switched off: {error}; switch it off at its panel"));
                    Some(Event::BrakeUnanswered)
                }
            },
            Action::ServoOff => match self.servo.set_enabled(false).await {
                Ok(()) => Some(Event::ServoIsOff),
                Err(error) => {
                    if !self.lost[DeviceKind::Servo as usize] {
                        stop.trouble(self, format!("servo was not switched off: {error}; switch it off by hand"));
                    } else if was_on {
                        stop.trouble(self, "the servo does not answer and may be on: switch the drive off by hand before you touch the rig".into());
                    }
                    Some(Event::ServoUnanswered)
                }
            },
            Action::CallPerson => {
                let what = "the servo does not answer and the shaft may turn: press the emergency stop and switch the drive off by hand";
                // Now, and not only when the program ends: until somebody comes the brake holds.
                tracing::error!("{what}");
                stop.trouble(self, what.into());
                None
            }
        }
    }

    /// Waits in a state that has to be waited in; the devices are polled meanwhile and the log goes on.
    async fn await_event(&mut self, stop: &mut Stopping) -> Event {
        loop {
            if self.stop.hurried() {
                stop.trouble(self, "the ramp was skipped at the operator's second request".into());
                return Event::Hurry;
            }
            if let Some(event) = self.look(stop).await {
                return event;
            }
            sleep(self.profile.poll_period()).await;
            if self.is_still(stop) {
                return Event::Still;
            }
            if Instant::now() > stop.deadline {
                let speed_rpm = self.acquisition.borrow().latest.speed_rpm;
                let reason = if self.is_fresh() {
                    format!("the driver still turns at {speed_rpm:.3} rpm")
                } else {
                    "the encoders are silent".into()
                };
                stop.trouble(self, format!("standstill could not be confirmed: {reason}"));
                stop.deadline = Instant::now() + REMIND;
                return Event::NoStandstill;
            }
        }
    }

    /// One look at the devices while stopping.
    async fn look(&mut self, stop: &mut Stopping) -> Option<Event> {
        if self.state != State::Holding {
            return match self.observe().await {
                Err(halt) if halt.event() == Event::ServoLost => Some(Event::ServoLost),
                Err(halt) => {
                    tracing::debug!("while stopping: {halt}");
                    None
                }
                Ok(()) => None,
            };
        }
        let brake = self.brake_status().await;
        self.book_heat();
        self.acquisition.borrow().write_state();
        if brake.as_ref().is_err_and(|halt| halt.event() == Event::BrakeLost) {
            return Some(Event::BrakeLost);
        }
        let too_hot = brake.is_ok_and(|brake| brake.temperature_c > self.profile.limits.brake_temperature_c);
        if too_hot || self.heat.check(&self.profile.limits).is_err() {
            stop.trouble(self, "the brake can take no more heat: its load was taken off with the shaft turning".into());
            return Some(Event::HeatSpent);
        }
        if Instant::now() >= stop.next_call {
            let called: Result<(), StopReason> = self.call_servo().await;
            stop.next_call = Instant::now() + CALL_PERIOD;
            if called.is_ok() {
                return Some(Event::ServoBack);
            }
        }
        None
    }

    /// The encoders speak.
    fn is_fresh(&self) -> bool {
        self.clock.now_ns().saturating_sub(self.acquisition.borrow().latest.arrived_ns) < FRESH_NS
    }

    /// The encoders have said twice in a row that the shafts stand.
    fn is_still(&self, stop: &mut Stopping) -> bool {
        let speed_rpm = self.acquisition.borrow().latest.speed_rpm;
        stop.still = if self.is_fresh() && speed_rpm.abs() < STANDSTILL_RPM { stop.still + 1 } else { 0 };
        stop.still >= 2
    }
}
