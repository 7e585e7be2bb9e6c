//! Devices by what they do. One device is one file in [`drivers`] and one line in its list.

pub mod bus;
pub mod drivers;
pub mod lost_device;
pub mod map;
pub mod refused;
pub mod two_clocks;

use std::time::Duration;

use async_trait::async_trait;
use thiserror::Error;
use wire::Samples;

pub use bus::BusError;
pub use wire::DeviceKind;

/// Who a device says it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// Model, serial number and firmware in words.
    pub text: String,
}

/// What a servo says of itself.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ServoStatus {
    /// Alarm code; 0 is none.
    pub alarm: u16,
    /// The drive holds the motor.
    pub enabled: bool,
    /// Motor speed, rpm.
    pub motor_rpm: f64,
}

/// What a brake's driver says of itself.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BrakeStatus {
    /// Coil current, A.
    pub current_a: f64,
    /// Temperature of the driver, or of the brake where it has a sensor, °C.
    pub temperature_c: f64,
    /// A protection of the driver has tripped.
    pub tripped: bool,
    /// The output is on.
    pub enabled: bool,
}

/// What a counter box says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct CounterIdentity {
    /// Model, serial number and firmware in words.
    pub text: String,
    /// Counts a revolution of input and output encoder, after interpolation.
    pub counts_per_rev: [u64; 2],
    /// Lines of input and output encoder.
    pub lines: [u32; 2],
    /// Fastest sampling, Hz.
    pub max_rate_hz: f64,
    /// It samples at [`CounterIdentity::max_rate_hz`] and no other rate.
    pub own_rate: bool,
    /// What its zero is.
    pub zero: Zero,
}

/// What the zero of both angles is taken from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Zero {
    /// The encoders' index pulses.
    #[default]
    Index,
    /// Nothing marks it: it is where the run begins.
    Begin,
    /// Nothing marks it: it is where the profile says, counts since the readers were switched on.
    Counts([i64; 2]),
}

/// What is known of the clocks of two readers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clocks {
    /// Drift of input and output reader against the host, parts per million.
    pub drift_ppm: [f64; 2],
    /// How well their times are known against each other.
    pub skew: two_clocks::Skew,
    /// Lines that were not believed.
    pub refused: [u64; 2],
}

/// Why a device failed.
#[derive(Debug, Error)]
pub enum DeviceError {
    /// On its Modbus line.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// It is not what the profile says.
    #[error("{device} on {port}: {found} where the profile says {expected}; check the port and the profile's driver")]
    Unexpected {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// What it says it is.
        found: String,
        /// What was expected.
        expected: String,
    },
    /// A value is beyond what the device takes.
    #[error(
        "{device} on {port}: {quantity} = {value} {unit} is beyond the device's {limit} {unit}; lower it, or correct the profile"
    )]
    Range {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// Quantity.
        quantity: &'static str,
        /// Value asked for.
        value: f64,
        /// What the device takes.
        limit: f64,
        /// Unit of both.
        unit: &'static str,
    },
    /// It does not do what it was told.
    #[error("{device} on {port} did not reach '{state}' within {seconds} s; last status: {status}")]
    NotReached {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// The state that was asked for.
        state: &'static str,
        /// How long was waited, s.
        seconds: f64,
        /// What it said last.
        status: String,
    },
    /// Its register map cannot be used.
    #[error("{device}: {reason}; `rigd profile check` shows every fault")]
    Map {
        /// Which device.
        device: DeviceKind,
        /// What is wrong with the map.
        reason: String,
    },
    /// Its line failed, or said what it must not.
    #[error("{device} on {port}: {what}")]
    Line {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// What happened, and what to check.
        what: String,
    },
    /// The encoders' stream stopped.
    #[error("counter on {port}: {what}; check power, cable and plug")]
    Counter {
        /// Its port.
        port: String,
        /// What happened.
        what: String,
    },
    /// The servo has a fault of its own.
    #[error("servo on {port}: {alarm}; remove the cause and reset the drive")]
    Alarm {
        /// Its port.
        port: String,
        /// The drive's code and its meaning.
        alarm: String,
    },
    /// The servo does not tell its torque.
    #[error(
        "servo on {port}: this drive does not tell its torque; calibrate the brake with a torque transducer, and write the curve into the profile"
    )]
    NoTorque {
        /// Its port.
        port: String,
    },
    /// The servo has no watchdog of its own.
    #[error(
        "servo on {port}: register {register} (communication watchdog) reads back {read}, wanted {wanted}; without it the motor turns on when this program dies"
    )]
    NoWatchdog {
        /// Its port.
        port: String,
        /// The parameter.
        register: String,
        /// What it reads.
        read: String,
        /// What was written.
        wanted: String,
    },
}

/// A servo drive in speed mode.
#[async_trait(?Send)]
pub trait Servo {
    /// Who it is.
    async fn identify(&mut self) -> Result<Identity, DeviceError>;
    /// Sets speed mode, ramps and, last of all, the communication watchdog, and reads all of them back. The motor stays off.
    /// [`DeviceError::NoWatchdog`] leaves the drive prepared but for that.
    async fn prepare(&mut self, accel_ms: f64, decel_ms: f64, lease: Duration) -> Result<(), DeviceError>;
    /// The fastest that the drive allows, motor rpm, as read back.
    async fn max_motor_rpm(&mut self) -> Result<f64, DeviceError>;
    /// Holds or frees the motor.
    async fn set_enabled(&mut self, enabled: bool) -> Result<(), DeviceError>;
    /// Speed setpoint, motor rpm; the drive ramps to it.
    async fn set_motor_rpm(&mut self, rpm: f64) -> Result<(), DeviceError>;
    /// What it says of itself. Any transaction renews the lease.
    async fn status(&mut self) -> Result<ServoStatus, DeviceError>;
    /// Motor torque in percent of the rated one, and the step in which it is told; `None` where the drive does not tell.
    async fn motor_torque_percent(&mut self) -> Result<Option<(f64, f64)>, DeviceError> {
        Ok(None)
    }
    /// Whether an alarm's code is that of the emergency stop's input.
    fn is_emergency_stop(&self, alarm: u16) -> bool {
        let _ = alarm;
        false
    }
    /// What happened on its line.
    fn statistics(&self) -> bus::BusStatistics;
}

/// A current source that drives the brake's coil.
#[async_trait(?Send)]
pub trait Brake {
    /// Who it is.
    async fn identify(&mut self) -> Result<Identity, DeviceError>;
    /// The largest current of the device, A.
    fn max_current_a(&self) -> f64;
    /// Sets voltage limit and zero current, and switches the output on.
    async fn prepare(&mut self, voltage_v: f64) -> Result<(), DeviceError>;
    /// Coil current, A.
    async fn set_current_a(&mut self, current_a: f64) -> Result<(), DeviceError>;
    /// Zero current, output off.
    async fn release(&mut self) -> Result<(), DeviceError>;
    /// What it says of itself.
    async fn status(&mut self) -> Result<BrakeStatus, DeviceError>;
    /// What happened on its line.
    fn statistics(&self) -> bus::BusStatistics;
}

/// A box that latches both encoders together.
#[async_trait(?Send)]
pub trait Counter {
    /// Who it is.
    async fn identify(&mut self) -> Result<CounterIdentity, DeviceError>;
    /// Begins to stream.
    async fn start(&mut self, rate_hz: f64) -> Result<(), DeviceError>;
    /// The next batch. Dropping the future loses nothing.
    async fn next(&mut self) -> Result<Samples, DeviceError>;
    /// Ends the stream.
    async fn stop(&mut self) -> Result<(), DeviceError>;
    /// Its clocks, where there is more than one.
    fn clocks(&self) -> Option<Clocks> {
        None
    }
}
