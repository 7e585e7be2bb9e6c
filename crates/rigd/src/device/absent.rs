//! In a lost device's place until it is back: its port is closed, so that a plug put in again gets its old name.

use std::time::Duration;

use async_trait::async_trait;

use super::{Brake, BrakeStatus, BusError, DeviceError, Identity, Part, Servo, ServoStatus, bus};

/// A servo or brake driver that is not connected: everything fails with its name and port.
pub struct Absent {
    /// Which device.
    pub part: Part,
    /// Where it was.
    pub port: String,
    /// What had happened on its line.
    pub statistics: bus::BusStatistics,
}

impl Absent {
    fn gone<T>(&self) -> Result<T, DeviceError> {
        let (device, port) = (self.part.name(), self.port.clone());
        Err(DeviceError::Bus(BusError::HungUp { device, port, reason: "not connected".into() }))
    }
}

#[async_trait(?Send)]
impl Servo for Absent {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        self.gone()
    }
    async fn prepare(&mut self, _: f64, _: f64, _: Duration) -> Result<(), DeviceError> {
        self.gone()
    }
    async fn max_motor_rpm(&mut self) -> Result<f64, DeviceError> {
        self.gone()
    }
    async fn set_enabled(&mut self, _: bool) -> Result<(), DeviceError> {
        self.gone()
    }
    async fn set_motor_rpm(&mut self, _: f64) -> Result<(), DeviceError> {
        self.gone()
    }
    async fn status(&mut self) -> Result<ServoStatus, DeviceError> {
        self.gone()
    }
    fn statistics(&self) -> bus::BusStatistics {
        self.statistics
    }
}

#[async_trait(?Send)]
impl Brake for Absent {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        self.gone()
    }
    fn max_current_a(&self) -> f64 {
        0.0
    }
    async fn prepare(&mut self, _: f64) -> Result<(), DeviceError> {
        self.gone()
    }
    async fn set_current_a(&mut self, _: f64) -> Result<(), DeviceError> {
        self.gone()
    }
    async fn release(&mut self) -> Result<(), DeviceError> {
        self.gone()
    }
    async fn status(&mut self) -> Result<BrakeStatus, DeviceError> {
        self.gone()
    }
    fn statistics(&self) -> bus::BusStatistics {
        self.statistics
    }
}
