//! A servo drive in speed mode over Modbus RTU, driven by its register map.

use std::time::Duration;

use async_trait::async_trait;

use super::bus::{BusError, BusStatistics};
use super::map::{Map, Mapped, ServoRules, Step};
use super::stand_in::StandIn;
use super::{DeviceError, Identity, Part, Servo, ServoStatus};
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
            let bus = map.bus(link, address, profile.unit, profile.horizon());
            Box::new(MappedServo { name: map.title.clone(), device: Mapped { bus, map, model: None }, rules })
        }
        Err(reason) => Box::new(StandIn::unmapped(Part::Servo, reason)),
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
                    device: "servo",
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
                    device: "servo",
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

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::collections::BTreeMap;
    use std::rc::Rc;

    use wire::asda_b2::{ALARM_COMMUNICATION_TIMEOUT, ALARM_EMERGENCY_STOP, MONITOR_1};
    use wire::modbus::{ExceptionCode, Request, Response};

    use super::*;
    use crate::device::bus::Horizon;
    use crate::profile::Profile;
    use crate::sim::emulator::Reply;
    use crate::sim::trial::{Device, Servo as EmulatedDrive, Workload, serve};

    /// A drive that keeps what is written, but for one register.
    #[derive(Clone, Default)]
    struct Keeping {
        registers: Rc<RefCell<BTreeMap<u16, u16>>>,
        refused: Option<u16>,
        stuck: Option<u16>,
    }

    impl Keeping {
        fn write(&self, first: u16, values: &[u16]) -> Option<Response> {
            for (address, value) in (first..).zip(values) {
                if self.refused == Some(address) {
                    return Some(Response::Exception(ExceptionCode::IllegalDataAddress));
                }
                if self.stuck != Some(address) {
                    self.registers.borrow_mut().insert(address, *value);
                }
            }
            None
        }
    }

    impl Device for Keeping {
        fn handle(&mut self, _: u64, request: &Request) -> Reply {
            let response = match request {
                Request::ReadHolding { address, count } => {
                    let registers = self.registers.borrow();
                    let value = |at| registers.get(&at).copied().unwrap_or_default();
                    Response::Registers((*address..address.saturating_add(*count)).map(value).collect())
                }
                Request::WriteSingle { address, value } => self
                    .write(*address, &[*value])
                    .unwrap_or(Response::WroteSingle { address: *address, value: *value }),
                Request::WriteMultiple { address, values } => self
                    .write(*address, values)
                    .unwrap_or(Response::WroteMultiple { address: *address, count: request.count() }),
            };
            Reply { response: Some(response), processing_ns: 500_000 }
        }

        fn workload(&self) -> Workload {
            EmulatedDrive::default().workload()
        }
    }

    /// Works with a driver of the map on such a drive.
    async fn with<T>(map: &str, drive: Keeping, work: impl AsyncFnOnce(&mut dyn Servo) -> T) -> T {
        let profile = ServoProfile { driver: map.into(), unit: 1, ..Profile::simulated().servo };
        with_profile(&profile, drive, work).await
    }

    async fn with_profile<T>(profile: &ServoProfile, drive: Keeping, work: impl AsyncFnOnce(&mut dyn Servo) -> T) -> T {
        let (near, far) = tokio::io::duplex(1024);
        let address = Address { device: "servo", port: "x".into(), baud: 38_400, format: "8N2".into() };
        let mut servo = open(Box::new(near), address, profile);
        let served = serve(far, drive);
        tokio::select! {
            () = served => panic!("the line is open"),
            done = work(&mut *servo) => done,
        }
    }

    async fn prepared(map: &str, drive: Keeping) -> Result<(), DeviceError> {
        with(map, drive, async |servo| servo.prepare(300.0, 600.0, Duration::from_secs(1)).await).await
    }

    #[tokio::test(start_paused = true)]
    async fn a_map_without_a_watchdog_is_told_once_all_else_is_prepared() {
        let drive = Keeping::default();
        let outcome = prepared("dsy-rs", drive.clone()).await;
        assert!(
            matches!(&outcome, Err(DeviceError::NoWatchdog { register, .. }) if register.contains("DSY-RS")),
            "{outcome:?}"
        );
        // The map's last step before the watchdog, and a ramp.
        assert_eq!([0x0B0A, 0x0506].map(|at| drive.registers.borrow().get(&at).copied()), [Some(1), Some(200)]);
    }

    #[tokio::test(start_paused = true)]
    async fn a_watchdog_that_refuses_or_does_not_keep_its_time_is_none() {
        let watchdog = wire::asda_b2::WATCHDOG.address;
        let refusing = Keeping { refused: Some(watchdog), ..Keeping::default() };
        let stuck = Keeping { stuck: Some(watchdog), ..Keeping::default() };
        for drive in [refusing, stuck] {
            let outcome = prepared("asda-b2", drive).await;
            assert!(
                matches!(&outcome, Err(DeviceError::NoWatchdog { register, .. }) if register == "watchdog P3-04"),
                "{outcome:?}"
            );
        }
        assert!(prepared("asda-b2", Keeping::default()).await.is_ok());
    }

    #[tokio::test(start_paused = true)]
    async fn a_drive_that_refuses_its_watchdog_is_switched_off_all_the_same() {
        let drive = Keeping { refused: Some(wire::asda_b2::WATCHDOG.address), ..Keeping::default() };
        let off = with("asda-b2", drive, async |servo| servo.set_enabled(false).await).await;
        assert!(off.is_ok(), "{off:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_line_is_heard_for_as_long_as_the_profile_says_that_answers_are_late() {
        let mut took = Vec::new();
        for late_ms in [400.0, 900.0] {
            let profile = ServoProfile { late_ms, ..Profile::simulated().servo };
            let begun = tokio::time::Instant::now();
            with_profile(&profile, Keeping::default(), async |servo| servo.max_motor_rpm().await.map(drop))
                .await
                .expect("it answers");
            took.push(begun.elapsed().as_millis());
        }
        // A line just opened is heard for a whole horizon before the first request.
        assert!((480..=520).contains(&(took[1] - took[0])), "{took:?} ms");
    }

    #[tokio::test(start_paused = true)]
    async fn torque_comes_with_its_sign_and_step() {
        let drive = Keeping::default();
        // −37 in two words, the low one first.
        drive.registers.borrow_mut().extend([(MONITOR_1.address, 0xFFDB), (MONITOR_1.address + 1, 0xFFFF)]);
        let torque = with("asda-b2", drive, async |servo| servo.motor_torque_percent().await).await;
        assert_eq!(torque.expect("answers"), Some((-37.0, 1.0)));
    }

    #[test]
    fn only_the_emergency_stops_code_is_one() {
        let (map, rules) = Map::of_servo(&Profile::simulated().servo).expect("built in");
        let (link, _far) = tokio::io::duplex(16);
        let address = Address { device: "servo", port: "x".into(), baud: 38_400, format: "8N2".into() };
        let device = Mapped { bus: map.bus(Box::new(link), address, 1, Horizon::default()), map, model: None };
        let servo = MappedServo { device, rules, name: String::new() };
        assert!(servo.is_emergency_stop(ALARM_EMERGENCY_STOP) && !servo.is_emergency_stop(ALARM_COMMUNICATION_TIMEOUT));
    }
}
