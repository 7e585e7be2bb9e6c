//! Opens the three devices.

use std::rc::Rc;

use super::stop_reason::StopReason;
use crate::device::{Brake, BusError, Counter, DeviceError, DeviceKind, Servo, drivers};
use crate::link::{Address, Link};
use crate::profile::Profile;

/// Opens a device's line another time; `None` while it is out of reach. For emulators within this process.
pub type Redial = Rc<dyn Fn(DeviceKind) -> Option<Link>>;

/// Knows where the devices are.
pub struct Dialer {
    profile: Profile,
    redial: Option<Redial>,
}

impl Dialer {
    /// For the devices of a profile; by `redial` where they are emulated within this process.
    #[must_use]
    pub fn new(profile: Profile, redial: Option<Redial>) -> Self {
        Self { profile, redial }
    }

    pub(super) fn address(&self, device: DeviceKind) -> Address {
        let Profile { servo, brake, counter, .. } = &self.profile;
        let (port, baud, format) = match device {
            DeviceKind::Servo => (&servo.port, servo.baud, &servo.format),
            DeviceKind::Brake => (&brake.port, brake.baud, &brake.format),
            DeviceKind::Counter => (&counter.port, counter.baud, &counter.format),
        };
        Address { device, port: port.clone(), baud, format: format.clone() }
    }

    async fn link(&self, link: Option<Link>, address: &Address, device: DeviceKind) -> Result<Link, StopReason> {
        match (link, &self.redial) {
            (Some(link), _) => Ok(link),
            (None, Some(redial)) => redial(device).ok_or_else(|| {
                let (device, port) = (address.device, address.port.clone());
                let reason = "the emulated device is unplugged".into();
                StopReason::Device(DeviceError::Bus(BusError::HungUp { device, port, reason }))
            }),
            (None, None) => Ok(address.open().await?),
        }
    }

    /// The servo, on `link` where there is one already.
    ///
    /// # Errors
    /// [`StopReason::Driver`], [`StopReason::Link`].
    pub async fn servo(&self, link: Option<Link>) -> Result<Box<dyn Servo>, StopReason> {
        let driver = drivers::find(drivers::SERVOS, DeviceKind::Servo, &self.profile.servo.driver)?;
        let address = self.address(DeviceKind::Servo);
        Ok(driver(self.link(link, &address, DeviceKind::Servo).await?, address, &self.profile.servo))
    }

    /// The brake's driver.
    ///
    /// # Errors
    /// As [`Dialer::servo`].
    pub async fn brake(&self, link: Option<Link>) -> Result<Box<dyn Brake>, StopReason> {
        let driver = drivers::find(drivers::BRAKES, DeviceKind::Brake, &self.profile.brake.driver)?;
        let address = self.address(DeviceKind::Brake);
        Ok(driver(self.link(link, &address, DeviceKind::Brake).await?, address, &self.profile.brake))
    }

    /// The reader of the encoders.
    ///
    /// # Errors
    /// As [`Dialer::servo`].
    pub async fn counter(&self, link: Option<Link>) -> Result<Box<dyn Counter>, StopReason> {
        let driver = drivers::find(drivers::COUNTERS, DeviceKind::Counter, &self.profile.counter.driver)?;
        let address = self.address(DeviceKind::Counter);
        Ok(driver(self.link(link, &address, DeviceKind::Counter).await?, address, &self.profile.counter))
    }
}
