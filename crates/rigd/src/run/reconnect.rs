//! Opens devices again once they were lost.

use std::time::Duration;

use riglog::proto::{Level, Phase};
use tokio::time::{Instant, sleep};

use super::connected_rig::ConnectedRig;
use super::stop_reason::StopReason;
use crate::device::lost_device::LostDevice;
use crate::device::{BusError, DeviceError, DeviceKind};

/// How often a lost device is called. With its own time-outs it is heard within 2 s of its return.
const CALL_PERIOD: Duration = Duration::from_millis(250);

impl ConnectedRig {
    /// Some device does not answer.
    #[must_use]
    pub fn has_lost_devices(&self) -> bool {
        self.lost.contains(&true)
    }

    /// Waits for every lost device, and says in the log what was lost, since when, and when it came back. The rig is off.
    ///
    /// # Errors
    /// [`StopReason::NotBack`] after `patience_s`; [`StopReason::Operator`].
    pub async fn reconnect(&mut self, patience_s: f64) -> Result<(), StopReason> {
        self.enter(Phase::Fault);
        let began = Instant::now();
        let mut announced = [false; 3];
        let mut last = String::new();
        loop {
            self.check_stop()?;
            self.log_works()?;
            for device in DeviceKind::ALL.into_iter().filter(|device| self.lost[*device as usize]).collect::<Vec<_>>() {
                if !std::mem::replace(&mut announced[device as usize], true) {
                    self.announce_gap(device, patience_s).await;
                }
                match self.call(device).await {
                    Ok(identity) => {
                        self.lost[device as usize] = false;
                        let waited_s = began.elapsed().as_secs_f64();
                        let what = format!("{device} is back {waited_s:.2} s after it was given up: {identity}");
                        self.acquisition.borrow().event(Level::Info, "reconnect", what);
                    }
                    Err(error) => last = error.to_string(),
                }
            }
            let Some(device) = DeviceKind::ALL.into_iter().find(|device| self.lost[*device as usize]) else {
                self.enter(Phase::Idle);
                return Ok(());
            };
            if began.elapsed().as_secs_f64() > patience_s {
                return Err(StopReason::NotBack { device, patience_s, last });
            }
            sleep(CALL_PERIOD).await;
            self.poll_the_others().await;
        }
    }

    /// The devices that still answer go on being asked: one that is lost meanwhile is waited for too.
    pub(super) async fn poll_the_others(&mut self) {
        if !self.lost[DeviceKind::Servo as usize] {
            let status = self.servo.status().await;
            drop(self.note(status));
        }
        if !self.lost[DeviceKind::Brake as usize] {
            drop(self.brake_status().await);
        }
        drop(self.encoders_live());
        self.book_heat();
        self.acquisition.borrow().write_state();
    }

    async fn announce_gap(&mut self, device: DeviceKind, patience_s: f64) {
        let now = match device {
            DeviceKind::Counter => {
                // Its port is closed, and what it said before is no part of what it says next.
                if let Some(stream) = self.stream.take() {
                    stream.task.abort();
                    let _ = stream.task.await;
                }
                self.counter = None;
                let mut rig = self.acquisition.borrow_mut();
                rig.stream_lost();
                format!("; no sample after number {}", rig.samples_numbered().saturating_sub(1))
            }
            DeviceKind::Servo | DeviceKind::Brake => String::new(),
        };
        let port = self.dialer.address(device).port;
        let what = format!("{device} on {port} is lost{now}; it is called until it answers, up to {patience_s} s");
        self.acquisition.borrow().event(Level::Warning, "gap", what);
    }

    /// Calls a lost device, by the open line while there is one, else by a new one; who it says it is.
    async fn call(&mut self, device: DeviceKind) -> Result<String, StopReason> {
        match device {
            DeviceKind::Servo => self.call_servo_by_name().await,
            DeviceKind::Brake => {
                let said = self.brake.identify().await;
                let Err(error) = said else { return Ok(said?.text) };
                if hung_up(&error) {
                    let (port, statistics) = (self.profile.brake.port.clone(), self.brake.statistics());
                    self.brake = Box::new(LostDevice::hung_up(device, port, statistics));
                    self.brake = self.dialer.brake(None).await?;
                    return Ok(self.brake.identify().await?.text);
                }
                Err(error.into())
            }
            DeviceKind::Counter => {
                let mut counter = self.dialer.counter(None).await?;
                let text = counter.identify().await?.text;
                self.counter = Some(counter);
                Ok(text)
            }
        }
    }

    async fn call_servo_by_name(&mut self) -> Result<String, StopReason> {
        let said = self.servo.identify().await;
        let Err(error) = said else { return Ok(said?.text) };
        if hung_up(&error) {
            let (port, statistics) = (self.profile.servo.port.clone(), self.servo.statistics());
            self.servo = Box::new(LostDevice::hung_up(DeviceKind::Servo, port, statistics));
            self.servo = self.dialer.servo(None).await?;
            return Ok(self.servo.identify().await?.text);
        }
        Err(error.into())
    }

    /// Calls a servo that was lost while it turned, and tells it to stop.
    pub(super) async fn call_servo(&mut self) -> Result<(), StopReason> {
        self.call_servo_by_name().await?;
        self.set_speed(None, 0.0).await?;
        self.lost[DeviceKind::Servo as usize] = false;
        let what = "servo is back while the brake held, and was told to stop".into();
        self.acquisition.borrow().event(Level::Info, "reconnect", what);
        Ok(())
    }
}

/// The line itself is gone, so that it has to be opened again.
fn hung_up(error: &DeviceError) -> bool {
    matches!(error, DeviceError::Bus(BusError::HungUp { .. }))
}
