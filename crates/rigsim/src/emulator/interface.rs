//! What an emulator meets on either side: the plant behind it, and what it answers on its line.

use wire::modbus::{ExceptionCode, Request, Response};

/// The servo's side of the plant. Speeds are those of the motor.
pub trait ServoAxis {
    /// Energises the motor, or lets it coast.
    fn set_enabled(&mut self, enabled: bool);
    /// Speed reference before the ramp, motor rpm.
    fn set_speed_reference_rpm(&mut self, rpm: f64);
    /// Ramps: times for a change of 3000 rpm, ms.
    fn set_ramp_ms(&mut self, accel_ms: f64, decel_ms: f64);
    /// Motor speed, rpm.
    fn speed_rpm(&self) -> f64;
    /// Motor torque, % of rated.
    fn torque_percent(&self) -> f64;
    /// Speed reference after the ramp, motor rpm.
    fn reference_speed_after_ramp_rpm(&self) -> f64;
}

/// The brake's coil, and the probe on its housing.
pub trait BrakeCoil {
    /// Connects a current source with these limits, or opens the circuit.
    fn set_drive(&mut self, enabled: bool, current_limit_a: f64, voltage_limit_v: f64);
    /// Coil current, A.
    fn current_a(&self) -> f64;
    /// Coil voltage, V.
    fn voltage_v(&self) -> f64;
    /// Temperature of the brake, °C.
    fn temperature_c(&self) -> f64;
}

/// The two encoders.
pub trait EncoderPair {
    /// Counts a revolution after interpolation, (input, output).
    fn counts_per_rev(&self) -> (u64, u64);
    /// Lines on the discs, (input, output).
    fn lines(&self) -> (u32, u32);
}

/// What a Modbus device does with a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// The answer; `None` is silence.
    pub response: Option<Response>,
    /// Time until the answer starts, ns.
    pub processing_ns: u64,
}

impl Reply {
    /// An answer after a while.
    pub(crate) fn after(processing_ns: u64, response: Response) -> Self {
        Self { response: Some(response), processing_ns }
    }
}

/// Answer to a read: the word at each address, or exception 2 at the first that does not exist.
pub(super) fn read_words(address: u16, count: u16, limit: u16, mut word: impl FnMut(u16) -> Option<u16>) -> Response {
    if count == 0 || count > limit {
        return Response::Exception(ExceptionCode::IllegalDataValue);
    }
    let words: Option<Vec<u16>> = (0..count).map(|n| address.checked_add(n).and_then(&mut word)).collect();
    words.map_or(Response::Exception(ExceptionCode::IllegalDataAddress), Response::Registers)
}

/// Answer to a write: its echo if the device took the words.
pub(super) fn echo_write(request: &Request, taken: Result<(), ExceptionCode>) -> Response {
    match (taken, request) {
        (Err(code), _) => Response::Exception(code),
        (Ok(()), &Request::WriteSingle { address, value }) => Response::WroteSingle { address, value },
        (Ok(()), other) => Response::WroteMultiple { address: other.address(), count: other.count() },
    }
}
