//! A servo drive in speed mode over Modbus RTU, driven by its register map.

use std::time::Duration;

use async_trait::async_trait;

use crate::device::bus::{BusError, BusStatistics};
use crate::device::lost_device::LostDevice;
use crate::device::map::{Map, Mapped, ServoRules, Step};
use crate::device::{DeviceError, DeviceKind, Identity, Servo, ServoStatus};
use crate::link::{Address, Link};
use crate::profile::ServoProfile;

struct MappedServo {
    device: Mapped,
    rules: ServoRules,
    name: String,
}

/// The driver on an open link, by the map that the profile names.
///
/// # Errors
/// None here: a map that cannot be read is told by the first transaction.
#[must_use]
pub fn open(link: Link, address: Address, profile: &ServoProfile) -> Box<dyn Servo> {
    match Map::of_servo(profile) {
        Ok((map, rules)) => {
            let bus = map.bus(link, address, profile.unit, profile.late_replies());
            Box::new(MappedServo { name: map.title.clone(), device: Mapped { bus, map, model: None }, rules })
        }
        Err(reason) => Box::new(LostDevice::unmapped(DeviceKind::Servo, reason)),
    }
}

impl MappedServo {
    fn port(&self) -> String {
        self.device.bus.port().to_owned()
    }

    async fn alarm_code(&mut self) -> Result<u16, DeviceError> {
        let name = self.rules.status.alarm.clone().unwrap_or_else(|| self.rules.status.fault.register.clone());
        let code = self.device.get(&name).await? as u16;
        // A drive without an alarm register shows its state there, fault or not.
        let fault = self.rules.status.alarm.is_some() || self.rules.status.fault.holds(f64::from(code));
        Ok(if fault { code } else { 0 })
    }

    /// An alarm of the drive's own watchdog, left by a run that died, is reset; any other needs a person.
    async fn clear_watchdog_alarm(&mut self) -> Result<(), DeviceError> {
        if let Some(own) = self.rules.own_watchdog_alarm.clone()
            && self.alarm_code().await? == own.code
        {
            tracing::warn!("the servo's watchdog had stopped it; resetting {}", self.device.map.alarm_text(own.code));
            self.device.run(&own.reset, &[]).await?;
        }
        match self.alarm_code().await? {
            0 => Ok(()),
            left => Err(DeviceError::Alarm { port: self.port(), alarm: self.device.map.alarm_text(left) }),
        }
    }

    /// The drive's own watchdog: written, with its action, and read back before anything is enabled.
    async fn arm_watchdog(&mut self, quantities: &[(&'static str, f64)]) -> Result<(), DeviceError> {
        let steps: Vec<Step> = self.rules.watchdog.clone();
        let lacking = |register: String, read: String, wanted: String, port: String| DeviceError::NoWatchdog {
            port,
            register,
            read,
            wanted,
        };
        if steps.is_empty() {
            return Err(lacking(
                format!("none in the map of {}", self.name),
                "nothing".into(),
                "a time".into(),
                self.port(),
            ));
        }
        for step in &steps {
            let wanted = step.value(quantities);
            let read = match self.device.set(&step.set, wanted).await {
                // A register that is not there, takes no value, or another one.
                Err(BusError::Refused { code, .. }) => code.to_string(),
                Err(BusError::ReadBack { read, .. }) => format!("{read:?}"),
                other => {
                    other?;
                    continue;
                }
            };
            return Err(lacking(self.device.called(&step.set), read, wanted.to_string(), self.port()));
        }
        Ok(())
    }

    async fn is_enabled(&mut self) -> Result<(bool, f64), DeviceError> {
        let test = self.rules.status.enabled.clone();
        let value = self.device.get(&test.register).await?;
        Ok((test.holds(value), value))
    }
}

#[async_trait(?Send)]
impl Servo for MappedServo {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        let firmware = match self.rules.firmware.clone() {
            Some(name) => format!(", firmware {}", self.device.get(&name).await?),
            None => String::new(),
        };
        for test in self.rules.require.clone() {
            let value = self.device.get(&test.register).await?;
            if !test.holds(value) {
                return Err(DeviceError::Unexpected {
                    device: DeviceKind::Servo,
                    port: self.port(),
                    found: format!("{} = {value}", test.register),
                    expected: test.advice,
                });
            }
        }
        Ok(Identity { text: format!("{}{firmware}, speed mode, on {}", self.name, self.port()) })
    }

    async fn prepare(&mut self, accel_ms: f64, decel_ms: f64, lease: Duration) -> Result<(), DeviceError> {
        let quantities = [("accel_ms", accel_ms), ("decel_ms", decel_ms), ("lease_s", lease.as_secs_f64())];
        // First of all: what follows must not wear out the drive's EEPROM.
        let (first, then) = (self.rules.before_alarm_reset.clone(), self.rules.prepare.clone());
        self.device.run(&first, &quantities).await?;
        self.clear_watchdog_alarm().await?;
        self.device.run(&then, &quantities).await?;
        self.arm_watchdog(&quantities).await
    }

    async fn max_motor_rpm(&mut self) -> Result<f64, DeviceError> {
        let name = self.rules.max_speed.clone();
        Ok(self.device.get(&name).await?)
    }

    async fn set_enabled(&mut self, enabled: bool) -> Result<(), DeviceError> {
        let steps = if enabled { self.rules.enable.clone() } else { self.rules.disable.clone() };
        self.device.run(&steps, &[]).await?;
        let patience = tokio::time::Instant::now() + Duration::from_secs_f64(self.rules.enable_s);
        loop {
            let (is_enabled, value) = self.is_enabled().await?;
            if is_enabled == enabled {
                break;
            }
            if tokio::time::Instant::now() > patience {
                return Err(DeviceError::NotReached {
                    device: DeviceKind::Servo,
                    port: self.port(),
                    state: if enabled { "servo on" } else { "servo off" },
                    seconds: self.rules.enable_s,
                    status: format!("{} = {value:#06x}", self.rules.status.enabled.register, value = value as u32),
                });
            }
        }
        if !enabled {
            // A motor that is off needs no watching.
            let steps = self.rules.watchdog_off.clone();
            match self.device.run(&steps, &[]).await {
                // A drive without the register was never armed: the operator accepted that, and off it is all the same.
                Err(BusError::Refused { .. }) => tracing::debug!("{} has no watchdog to disarm", self.name),
                other => other?,
            }
        }
        Ok(())
    }

    async fn set_motor_rpm(&mut self, rpm: f64) -> Result<(), DeviceError> {
        let name = self.rules.speed_set.clone();
        Ok(self.device.set(&name, rpm).await?)
    }

    async fn status(&mut self) -> Result<ServoStatus, DeviceError> {
        let status = &self.rules.status;
        let registers = [&status.speed, &status.enabled.register, &status.fault.register];
        let registers = registers.map(|name| self.device.register(name));
        let values = self.device.bus.get_all(&registers.each_ref()).await?;
        let (motor_rpm, enabled, fault) = match values[..] {
            [speed, enabled, fault] => (speed, status.enabled.holds(enabled), status.fault.holds(fault)),
            // As many values come back as were asked for.
            _ => (f64::NAN, false, true),
        };
        let alarm = if fault { self.alarm_code().await? } else { 0 };
        Ok(ServoStatus { alarm, enabled, motor_rpm })
    }

    async fn motor_torque_percent(&mut self) -> Result<Option<(f64, f64)>, DeviceError> {
        let Some(name) = self.rules.status.torque.clone() else { return Ok(None) };
        let register = self.device.register(&name);
        Ok(Some((self.device.bus.get(&register).await?, register.scale)))
    }

    fn is_emergency_stop(&self, alarm: u16) -> bool {
        self.rules.emergency_stop_alarm == Some(alarm)
    }

    fn statistics(&self) -> BusStatistics {
        self.device.bus.statistics()
    }
}
