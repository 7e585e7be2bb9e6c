//! Why a transaction failed, in words that say what to check.

use thiserror::Error;
use wire::DeviceKind;
use wire::modbus::{self, ExceptionCode};
use wire::register_map::RegisterError;

/// Why a transaction failed.
#[derive(Debug, Error)]
pub enum BusError {
    /// No answer.
    #[error(
        "{device} on {port} (unit {unit}) did not answer {attempts} requests ({request}) within {patience_ms} ms each; check power, cable, baud {baud} {format}, and the unit number"
    )]
    Silent {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// Its unit.
        unit: u8,
        /// How often it was asked.
        attempts: u32,
        /// What it was asked.
        request: String,
        /// How long each time, ms.
        patience_ms: u128,
        /// Line speed.
        baud: u32,
        /// Character format.
        format: String,
    },
    /// Only damaged answers.
    #[error(
        "{device} on {port} (unit {unit}) answered {request} with a damaged frame {attempts} times, last: {reason}; check wiring, termination, baud {baud} {format}, and that no second device has this unit number"
    )]
    Damaged {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// Its unit.
        unit: u8,
        /// How often it was asked.
        attempts: u32,
        /// What it was asked.
        request: String,
        /// What was wrong with the last answer.
        reason: modbus::ResponseError,
        /// Line speed.
        baud: u32,
        /// Character format.
        format: String,
    },
    /// The device refused.
    #[error("{device} on {port} (unit {unit}) refused {request}: {code}")]
    Refused {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// Its unit.
        unit: u8,
        /// What it was asked.
        request: String,
        /// The exception.
        code: ExceptionCode,
    },
    /// The request cannot be put into a frame.
    #[error("{device}: {request} is not a request: {reason}")]
    Unaskable {
        /// Which device.
        device: DeviceKind,
        /// What was to be asked.
        request: String,
        /// Why it cannot.
        reason: modbus::EncodeError,
    },
    /// A value does not fit its register.
    #[error("{device} on {port}: {reason}")]
    Value {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// The register, the value and the limit.
        reason: RegisterError,
    },
    /// The line is gone.
    #[error("{device}: port {port} hung up ({reason}); check the plug, then start again")]
    HungUp {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// The reason.
        reason: String,
    },
    /// A written value came back otherwise.
    #[error(
        "{device} on {port}: register {register:#06x} was written {wrote:?} and reads back {read:?}; is the parameter locked, or another master on the line?"
    )]
    ReadBack {
        /// Which device.
        device: DeviceKind,
        /// Its port.
        port: String,
        /// First register.
        register: u16,
        /// What was written.
        wrote: Vec<u16>,
        /// What was read.
        read: Vec<u16>,
    },
}
