//! A device whose register map could not be read: says so to whatever is asked of it.

use std::time::Duration;

use async_trait::async_trait;

use super::bus::BusStatistics;
use super::{Brake, BrakeStatus, DeviceError, Identity, Servo, ServoStatus};

/// Stands where a driver would.
pub struct Unmapped {
    /// `servo` or `brake`.
    pub device: &'static str,
    /// What is wrong with the map.
    pub reason: String,
}

impl Unmapped {
    fn refuse<T>(&self) -> Result<T, DeviceError> {
        Err(DeviceError::Map { device: self.device, reason: self.reason.clone() })
    }
}

#[async_trait(?Send)]
impl Servo for Unmapped {
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
        BusStatistics::default()
    }
}

#[async_trait(?Send)]
impl Brake for Unmapped {
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
        BusStatistics::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn whatever_is_asked_is_answered_with_the_maps_fault() {
        let mut servo = Unmapped { device: "servo", reason: "no register 'speed_9'".into() };
        let said = Servo::set_motor_rpm(&mut servo, 1.0).await.expect_err("refused").to_string();
        assert!(said.contains("servo") && said.contains("speed_9"), "{said}");
        let mut brake = Unmapped { device: "brake", reason: "no file".into() };
        let said = Brake::set_current_a(&mut brake, 1.0).await.expect_err("refused").to_string();
        assert!(said.contains("brake") && said.contains("no file"), "{said}");
        assert_eq!(brake.max_current_a(), 0.0);
    }
}
