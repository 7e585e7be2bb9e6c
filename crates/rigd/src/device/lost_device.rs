//! In the place of a servo's or brake's driver while there is none to speak to: says why to whatever is asked of it.

use std::time::Duration;

use async_trait::async_trait;

use super::bus::BusStatistics;
use super::{Brake, BrakeStatus, BusError, DeviceError, DeviceKind, Identity, Servo, ServoStatus};

/// Why there is no driver.
enum Reason {
    /// Its port is closed, so that a plug put in again gets its old name.
    Lost { port: String },
    /// Its register map could not be read.
    Unmapped { what: String },
}

/// Fails with its device's name and the reason.
pub struct LostDevice {
    device: DeviceKind,
    reason: Reason,
    statistics: BusStatistics,
}

impl LostDevice {
    /// In a lost device's place until it is back; `statistics` say what had happened on its line.
    #[must_use]
    pub fn hung_up(device: DeviceKind, port: String, statistics: BusStatistics) -> Self {
        Self { device, reason: Reason::Lost { port }, statistics }
    }

    /// For a device whose register map is at fault, as `what` says.
    #[must_use]
    pub fn unmapped(device: DeviceKind, what: String) -> Self {
        Self { device, reason: Reason::Unmapped { what }, statistics: BusStatistics::default() }
    }

    fn refuse<T>(&self) -> Result<T, DeviceError> {
        let device = self.device;
        Err(match &self.reason {
            Reason::Lost { port } => {
                BusError::HungUp { device, port: port.clone(), reason: "not connected".into() }.into()
            }
            Reason::Unmapped { what } => DeviceError::Map { device, reason: what.clone() },
        })
    }
}

#[async_trait(?Send)]
impl Servo for LostDevice {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        self.refuse()
    }
    async fn prepare(&mut self, _: f64, _: f64, _: Duration) -> Result<(), DeviceError> {
        self.refuse()
    }
    async fn max_motor_rpm(&mut self) -> Result<f64, DeviceError> {
        self.refuse()
    }
    async fn set_enabled(&mut self, _: bool) -> Result<(), DeviceError> {
        self.refuse()
    }
    async fn set_motor_rpm(&mut self, _: f64) -> Result<(), DeviceError> {
        self.refuse()
    }
    async fn status(&mut self) -> Result<ServoStatus, DeviceError> {
        self.refuse()
    }
    fn statistics(&self) -> BusStatistics {
        self.statistics
    }
}

#[async_trait(?Send)]
impl Brake for LostDevice {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        self.refuse()
    }
    fn max_current_a(&self) -> f64 {
        0.0
    }
    async fn prepare(&mut self, _: f64) -> Result<(), DeviceError> {
        self.refuse()
    }
    async fn set_current_a(&mut self, _: f64) -> Result<(), DeviceError> {
        self.refuse()
    }
    async fn release(&mut self) -> Result<(), DeviceError> {
        self.refuse()
    }
    async fn status(&mut self) -> Result<BrakeStatus, DeviceError> {
        self.refuse()
    }
    fn statistics(&self) -> BusStatistics {
        self.statistics
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::stop_reason::lost_device;

    #[tokio::test]
    async fn whatever_is_asked_is_answered_with_the_reason() {
        let mut servo = LostDevice::unmapped(DeviceKind::Servo, "no register 'speed_9'".into());
        let said = servo.set_motor_rpm(1.0).await.expect_err("refused");
        assert_eq!(lost_device(&said), None, "waiting mends no map");
        let said = said.to_string();
        assert!(said.contains("servo") && said.contains("speed_9"), "{said}");

        let line = BusStatistics { timeouts: 3, ..BusStatistics::default() };
        let mut brake = LostDevice::hung_up(DeviceKind::Brake, "/dev/ttyUSB7".into(), line);
        let said = brake.set_current_a(1.0).await.expect_err("refused");
        assert_eq!(lost_device(&said), Some(DeviceKind::Brake), "it may come back");
        assert!(said.to_string().contains("/dev/ttyUSB7"), "{said}");
        assert_eq!((Brake::statistics(&brake).timeouts, brake.max_current_a()), (3, 0.0));
    }
}
