//! The drivers that there are, by their names in the profile: one driver is one file here and a line in its list.

mod counter_box;
mod dsp7000;
mod mapped_brake;
pub mod mapped_servo;
mod qsb;

use thiserror::Error;

use super::{Brake, Counter, DeviceKind, Servo, map};
use crate::link::{Address, Link};
use crate::profile::{BrakeProfile, CounterProfile, ServoProfile};

/// Drivers by their name in the profile: each is opened on its link.
type Drivers<P, D> = &'static [(&'static str, fn(Link, Address, &P) -> Box<D>)];

/// Servo drives by their name in the profile.
pub const SERVOS: Drivers<ServoProfile, dyn Servo> =
    &[("asda-b2", mapped_servo::open), ("dsy-rs", mapped_servo::open), (map::DRIVER, mapped_servo::open)];

/// Brake drivers by their name in the profile.
pub const BRAKES: Drivers<BrakeProfile, dyn Brake> =
    &[("rd60xx", mapped_brake::open), ("dsp7000", dsp7000::open), (map::DRIVER, mapped_brake::open)];

/// Encoder readers by their name in the profile.
pub const COUNTERS: Drivers<CounterProfile, dyn Counter> =
    &[("counter-box", counter_box::open), (qsb::DRIVER, qsb::open)];

/// A driver's name that is in no list.
#[derive(Debug, Error)]
#[error("{device}: no driver '{name}'; this version has {known}")]
pub struct UnknownDriver {
    device: DeviceKind,
    name: String,
    known: String,
}

/// Finds a driver by its name in the profile.
///
/// # Errors
/// [`UnknownDriver`] lists those that there are.
pub fn find<F: Copy>(drivers: &[(&'static str, F)], device: DeviceKind, name: &str) -> Result<F, UnknownDriver> {
    drivers.iter().find(|(known, _)| *known == name).map(|(_, factory)| *factory).ok_or_else(|| UnknownDriver {
        device,
        name: name.to_owned(),
        known: drivers.iter().map(|(known, _)| *known).collect::<Vec<_>>().join(", "),
    })
}
