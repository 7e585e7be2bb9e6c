//! Delta ASDA-B2 servo drive in speed mode over Modbus RTU. Registers: `wire::asda_b2`, docs/wire/asda-b2.md.
//!
//! Three of the digital inputs are driven by software (servo on, speed select, alarm reset); the others, the emergency stop
//! among them, stay on their terminals.

use std::time::Duration;

use async_trait::async_trait;
use wire::asda_b2::{
    ALARM, ALARM_COMMUNICATION_TIMEOUT, ALARM_EMERGENCY_STOP, AUX_RAM_ONLY, AUXILIARY, Alarm, CONTROL_MODE,
    FAULT_ACTION, FAULT_STOP, FIRMWARE, FRAME_SILENCE_MS, INPUT_FUNCTIONS, INPUT_SOURCE, INPUTS, InputFunction,
    MAX_SPEED, MODE_SPEED, MONITOR_1, MONITOR_1_CODE, OUTPUTS, Outputs, RAMP_DOWN, RAMP_UP, SPEED_1, STATUS_MONITOR,
    STATUS_MONITOR_CODE, WATCHDOG, monitor,
};

use super::bus::{Bus, BusError, BusStatistics, Manners};
use super::{DeviceError, Identity, Servo, ServoStatus};
use crate::link::{Address, Link};
use crate::profile::ServoProfile;

/// Inputs that software drives: DI1 servo on, DI2 speed select, DI3 alarm reset.
const SOFTWARE_INPUTS: [InputFunction; 3] = [InputFunction::ServoOn, InputFunction::Speed0, InputFunction::AlarmReset];
const SERVO_ON: u16 = 1 << 0;
const SPEED_SELECT: u16 = 1 << 1;
const ALARM_RESET: u16 = 1 << 2;

/// Status monitor, its code and the outputs lie side by side: one request reads all three.
const STATUS_WORDS: u16 = 6;

/// How long the drive may take to switch its power stage.
const ENABLE_SECONDS: f64 = 1.0;

struct AsdaB2 {
    bus: Bus,
}

/// The driver on an open link.
#[must_use]
pub fn open(link: Link, address: Address, profile: &ServoProfile) -> Box<dyn Servo> {
    let manners =
        Manners { silence: Duration::from_millis(FRAME_SILENCE_MS), patience: Duration::from_millis(100), attempts: 3 };
    Box::new(AsdaB2 { bus: Bus::new(link, address, profile.unit, manners) })
}

impl AsdaB2 {
    async fn outputs(&mut self) -> Result<Outputs, DeviceError> {
        Ok(Outputs(self.bus.get(&OUTPUTS).await? as u16))
    }

    /// An alarm of our own watchdog, left by a run that died, is reset; any other needs a person.
    async fn clear_watchdog_alarm(&mut self) -> Result<(), DeviceError> {
        let alarm = self.bus.get(&ALARM).await? as u16;
        if alarm == ALARM_COMMUNICATION_TIMEOUT {
            tracing::warn!("the servo's watchdog had stopped it; resetting {}", Alarm(alarm));
            self.bus.write_unverified(ALARM.address, &[0]).await?;
            self.bus.write_unverified(INPUTS.address, &[ALARM_RESET]).await?;
            self.bus.write_unverified(INPUTS.address, &[0]).await?;
        }
        match self.bus.get(&ALARM).await? as u16 {
            0 => Ok(()),
            left => Err(DeviceError::Alarm { port: self.bus.port().to_owned(), alarm: Alarm(left).to_string() }),
        }
    }

    /// The drive's own watchdog: written, with its action, and read back before anything is enabled.
    async fn arm_watchdog(&mut self, lease: Duration) -> Result<(), DeviceError> {
        // The register counts whole seconds.
        let seconds = lease.as_secs_f64().ceil();
        for (register, value, name) in [(&WATCHDOG, seconds, "P3-04"), (&FAULT_ACTION, f64::from(FAULT_STOP), "P3-03")]
        {
            let set = self.bus.set(register, value).await;
            let read = match set {
                // A register that is not there, takes no value, or another one.
                Err(BusError::Refused { code, .. }) => code.to_string(),
                Err(BusError::ReadBack { read, .. }) => format!("{read:?}"),
                other => {
                    other?;
                    continue;
                }
            };
            let port = self.bus.port().to_owned();
            return Err(DeviceError::NoWatchdog { port, register: name, read, wanted: value.to_string() });
        }
        Ok(())
    }
}

#[async_trait(?Send)]
impl Servo for AsdaB2 {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        let firmware = self.bus.get(&FIRMWARE).await? as u16;
        let mode = self.bus.get(&CONTROL_MODE).await? as u16;
        if mode & 0xFF != MODE_SPEED {
            return Err(DeviceError::Unexpected {
                device: "servo",
                port: self.bus.port().to_owned(),
                found: format!("control mode P1-01 = {mode:#06x}"),
                expected: format!("speed mode {MODE_SPEED:#04x} (set it at the panel and switch the drive off and on)"),
            });
        }
        Ok(Identity { text: format!("Delta ASDA-B2, firmware {firmware}, speed mode, on {}", self.bus.port()) })
    }

    async fn prepare(&mut self, accel_ms: f64, decel_ms: f64, lease: Duration) -> Result<(), DeviceError> {
        // First of all: what follows must not wear out the drive's EEPROM.
        self.bus.set(&AUXILIARY, f64::from(AUX_RAM_ONLY)).await?;
        self.bus.write_unverified(INPUTS.address, &[0]).await?;
        self.clear_watchdog_alarm().await?;
        self.bus.set(&SPEED_1, 0.0).await?;
        self.bus.set(&RAMP_UP, accel_ms).await?;
        self.bus.set(&RAMP_DOWN, decel_ms).await?;
        for (register, function) in INPUT_FUNCTIONS.iter().zip(SOFTWARE_INPUTS) {
            self.bus.set(register, f64::from(function.parameter(true))).await?;
        }
        self.bus.set(&INPUT_SOURCE, f64::from(SERVO_ON | SPEED_SELECT | ALARM_RESET)).await?;
        self.bus.set(&STATUS_MONITOR_CODE, f64::from(monitor::SPEED)).await?;
        self.arm_watchdog(lease).await
    }

    async fn max_motor_rpm(&mut self) -> Result<f64, DeviceError> {
        Ok(self.bus.get(&MAX_SPEED).await?)
    }

    async fn set_enabled(&mut self, enabled: bool) -> Result<(), DeviceError> {
        let inputs = if enabled { SERVO_ON | SPEED_SELECT } else { 0 };
        self.bus.write_unverified(INPUTS.address, &[inputs]).await?;
        let patience = tokio::time::Instant::now() + Duration::from_secs_f64(ENABLE_SECONDS);
        loop {
            let outputs = self.outputs().await?;
            if outputs.has(Outputs::SERVO_ON) == enabled {
                break;
            }
            if tokio::time::Instant::now() > patience {
                return Err(DeviceError::NotReached {
                    device: "servo",
                    port: self.bus.port().to_owned(),
                    state: if enabled { "servo on" } else { "servo off" },
                    seconds: ENABLE_SECONDS,
                    status: format!("outputs P0-46 = {:#06x}", outputs.0),
                });
            }
        }
        if !enabled {
            // A motor that is off needs no watching; left armed, the watchdog would raise an alarm after every run in order.
            self.bus.set(&WATCHDOG, 0.0).await?;
        }
        Ok(())
    }

    async fn set_motor_rpm(&mut self, rpm: f64) -> Result<(), DeviceError> {
        Ok(self.bus.set(&SPEED_1, rpm).await?)
    }

    async fn status(&mut self) -> Result<ServoStatus, DeviceError> {
        let words = self.bus.read(STATUS_MONITOR.address, STATUS_WORDS).await?;
        let decode = |register: &wire::register_map::RegisterDef| {
            register.decode_from(STATUS_MONITOR.address, &words).map_err(|reason| self.bus.value_error(reason))
        };
        let motor_rpm = decode(&STATUS_MONITOR)? * monitor::SPEED_STEP_RPM;
        let outputs = Outputs(decode(&OUTPUTS)? as u16);
        let alarm = if outputs.has(Outputs::ALARM) { self.bus.get(&ALARM).await? as u16 } else { 0 };
        Ok(ServoStatus { alarm, enabled: outputs.has(Outputs::SERVO_ON), motor_rpm })
    }

    async fn motor_torque_percent(&mut self) -> Result<Option<(f64, f64)>, DeviceError> {
        // Monitor 1 for the torque, as the status monitor is for the speed; set once, it stays.
        if self.bus.get(&MONITOR_1_CODE).await? as u16 != monitor::TORQUE {
            self.bus.set(&MONITOR_1_CODE, f64::from(monitor::TORQUE)).await?;
        }
        let percent = self.bus.get(&MONITOR_1).await? * monitor::TORQUE_STEP_PERCENT;
        Ok(Some((percent, monitor::TORQUE_STEP_PERCENT)))
    }

    fn is_emergency_stop(&self, alarm: u16) -> bool {
        alarm == ALARM_EMERGENCY_STOP
    }

    fn statistics(&self) -> BusStatistics {
        self.bus.statistics()
    }
}
