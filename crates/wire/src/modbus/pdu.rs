//! Requests and responses and their bytes.

use std::fmt;

use super::encode_error::EncodeError;
use super::{function, push_crc};

/// Registers one read may ask for (V1.1b3 §6.3). Devices may allow fewer.
pub const MAX_READ_COUNT: u16 = 125;
/// Registers one write may carry (V1.1b3 §6.12).
pub const MAX_WRITE_COUNT: u16 = 123;

/// What a client asks.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Request {
    /// Function 03: read `count` holding registers from `address` on.
    ReadHolding {
        /// First register.
        address: u16,
        /// Number of registers, 1 to [`MAX_READ_COUNT`].
        count: u16,
    },
    /// Function 06: write one register.
    WriteSingle {
        /// The register.
        address: u16,
        /// Its new content.
        value: u16,
    },
    /// Function 16: write consecutive registers.
    WriteMultiple {
        /// First register.
        address: u16,
        /// Contents, 1 to [`MAX_WRITE_COUNT`] of them.
        values: Vec<u16>,
    },
}

impl Request {
    /// Function code.
    pub fn function(&self) -> u8 {
        match self {
            Self::ReadHolding { .. } => function::READ_HOLDING,
            Self::WriteSingle { .. } => function::WRITE_SINGLE,
            Self::WriteMultiple { .. } => function::WRITE_MULTIPLE,
        }
    }

    /// First register concerned.
    pub fn address(&self) -> u16 {
        match self {
            Self::ReadHolding { address, .. }
            | Self::WriteSingle { address, .. }
            | Self::WriteMultiple { address, .. } => *address,
        }
    }

    /// Number of registers concerned. A list longer than the protocol can carry saturates.
    pub fn count(&self) -> u16 {
        match self {
            Self::ReadHolding { count, .. } => *count,
            Self::WriteSingle { .. } => 1,
            Self::WriteMultiple { values, .. } => u16::try_from(values.len()).unwrap_or(u16::MAX),
        }
    }

    /// Length of the good answer on the wire, in bytes with unit and CRC.
    pub fn response_len(&self) -> usize {
        match self {
            Self::ReadHolding { count, .. } => 5 + 2 * usize::from(*count),
            Self::WriteSingle { .. } | Self::WriteMultiple { .. } => 8,
        }
    }

    /// Whether a frame can carry it.
    ///
    /// # Errors
    /// [`EncodeError`] when the number of registers is 0 or over the protocol's limit, or runs past address FFFF.
    pub fn check(&self) -> Result<(), EncodeError> {
        let (count, limit) = match self {
            Self::ReadHolding { count, .. } => (usize::from(*count), MAX_READ_COUNT),
            Self::WriteSingle { .. } => (1, 1),
            Self::WriteMultiple { values, .. } => (values.len(), MAX_WRITE_COUNT),
        };
        if count == 0 || count > usize::from(limit) {
            return Err(EncodeError::Count { function: self.function(), address: self.address(), count, limit });
        }
        if usize::from(self.address()) + count > 0x1_0000 {
            return Err(EncodeError::PastEnd { function: self.function(), address: self.address(), count });
        }
        Ok(())
    }
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReadHolding { address, count } => {
                write!(f, "read {count} registers from {address:04X}h")
            }
            Self::WriteSingle { address, value } => {
                write!(f, "write {value:04X}h to {address:04X}h")
            }
            Self::WriteMultiple { address, values } => {
                write!(f, "write {} registers from {address:04X}h", values.len())
            }
        }
    }
}

/// What a server answers.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Response {
    /// Contents of the registers read, in address order.
    Registers(Vec<u16>),
    /// Function 06 done: address and value as asked.
    WroteSingle {
        /// The register.
        address: u16,
        /// What was written.
        value: u16,
    },
    /// Function 16 done: range as asked.
    WroteMultiple {
        /// First register.
        address: u16,
        /// Number of registers.
        count: u16,
    },
    /// The server refuses.
    Exception(ExceptionCode),
}

/// Why a server refuses (V1.1b3 §7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ExceptionCode {
    /// 01: the server has no such function.
    IllegalFunction,
    /// 02: no such register.
    IllegalDataAddress,
    /// 03: a value or a count that is not allowed.
    IllegalDataValue,
    /// 04: the server failed while it tried.
    ServerDeviceFailure,
    /// 05: accepted, takes long.
    Acknowledge,
    /// 06: busy, ask again later.
    ServerDeviceBusy,
    /// 08: memory parity error.
    MemoryParity,
    /// Any other code a device sends.
    Other(u8),
}

impl ExceptionCode {
    /// The byte on the wire.
    pub fn code(self) -> u8 {
        match self {
            Self::IllegalFunction => 1,
            Self::IllegalDataAddress => 2,
            Self::IllegalDataValue => 3,
            Self::ServerDeviceFailure => 4,
            Self::Acknowledge => 5,
            Self::ServerDeviceBusy => 6,
            Self::MemoryParity => 8,
            Self::Other(code) => code,
        }
    }

    /// From the byte on the wire.
    pub fn from_code(code: u8) -> Self {
        match code {
            1 => Self::IllegalFunction,
            2 => Self::IllegalDataAddress,
            3 => Self::IllegalDataValue,
            4 => Self::ServerDeviceFailure,
            5 => Self::Acknowledge,
            6 => Self::ServerDeviceBusy,
            8 => Self::MemoryParity,
            other => Self::Other(other),
        }
    }
}

impl fmt::Display for ExceptionCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::IllegalFunction => "the device has no such function",
            Self::IllegalDataAddress => "the device has no such register",
            Self::IllegalDataValue => "the device does not accept this value or count",
            Self::ServerDeviceFailure => "the device failed while it tried",
            Self::Acknowledge => "the device accepted and is still working",
            Self::ServerDeviceBusy => "the device is busy",
            Self::MemoryParity => "the device found a memory error",
            Self::Other(_) => "a code of the device's own",
        };
        write!(f, "exception {:02X}h: {text}", self.code())
    }
}

/// Bytes of a request, with unit and CRC.
///
/// # Errors
/// [`EncodeError`] when the request cannot be carried by a frame; see [`Request::check`].
pub fn encode_request(unit: u8, request: &Request) -> Result<Vec<u8>, EncodeError> {
    request.check()?;
    let mut frame = Vec::with_capacity(9 + 2 * usize::from(request.count()));
    frame.extend_from_slice(&[unit, request.function()]);
    frame.extend_from_slice(&request.address().to_be_bytes());
    match request {
        Request::ReadHolding { count, .. } => frame.extend_from_slice(&count.to_be_bytes()),
        Request::WriteSingle { value, .. } => frame.extend_from_slice(&value.to_be_bytes()),
        Request::WriteMultiple { values, .. } => {
            frame.extend_from_slice(&request.count().to_be_bytes());
            push_words(&mut frame, values);
        }
    }
    push_crc(&mut frame);
    Ok(frame)
}

/// Bytes of the answer to a request of this function code, with unit and CRC. The function code is that of the
/// request; an exception carries it with its highest bit set.
///
/// # Errors
/// [`EncodeError`] when more registers are given than a frame can carry.
pub fn encode_response(unit: u8, function: u8, response: &Response) -> Result<Vec<u8>, EncodeError> {
    let mut frame = vec![unit, function];
    match response {
        Response::Registers(values) => {
            if values.is_empty() || values.len() > usize::from(MAX_READ_COUNT) {
                return Err(EncodeError::Count { function, address: 0, count: values.len(), limit: MAX_READ_COUNT });
            }
            push_words(&mut frame, values);
        }
        Response::WroteSingle { address, value } => {
            frame.extend_from_slice(&address.to_be_bytes());
            frame.extend_from_slice(&value.to_be_bytes());
        }
        Response::WroteMultiple { address, count } => {
            frame.extend_from_slice(&address.to_be_bytes());
            frame.extend_from_slice(&count.to_be_bytes());
        }
        Response::Exception(code) => {
            frame[1] = function | function::EXCEPTION_BIT;
            frame.push(code.code());
        }
    }
    push_crc(&mut frame);
    Ok(frame)
}

/// Byte count, then the words big-endian. Callers have checked the length, so the count fits a byte.
fn push_words(frame: &mut Vec<u8>, values: &[u16]) {
    frame.push(u8::try_from(2 * values.len()).unwrap_or(u8::MAX));
    frame.extend(values.iter().flat_map(|value| value.to_be_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;

    // Delta ASDA-B2 User Manual (May 2018), p. 8-13: writing P1-09.
    #[test]
    fn manual_example_write_multiple() {
        let request = Request::WriteMultiple { address: 0x0112, values: vec![0x0BB8, 0x0000] };
        let bytes = encode_request(1, &request).unwrap();
        assert_eq!(bytes, [0x01, 0x10, 0x01, 0x12, 0x00, 0x02, 0x04, 0x0B, 0xB8, 0x00, 0x00, 0xFC, 0xEB]);
        let answer = encode_response(1, 0x10, &Response::WroteMultiple { address: 0x0112, count: 2 }).unwrap();
        assert_eq!(answer, [0x01, 0x10, 0x01, 0x12, 0x00, 0x02, 0xE0, 0x31]);
    }

    // Delta ASDA-B2 User Manual (September 2013), p. 8-11: writing P2-00.
    #[test]
    fn manual_example_write_single() {
        let request = Request::WriteSingle { address: 0x0200, value: 0x0064 };
        let bytes = [0x01, 0x06, 0x02, 0x00, 0x00, 0x64, 0x89, 0x99];
        assert_eq!(encode_request(1, &request).unwrap(), bytes);
        let answer = encode_response(1, 6, &Response::WroteSingle { address: 0x0200, value: 0x0064 }).unwrap();
        assert_eq!(answer, bytes, "function 06 answers with the request itself");
    }

    #[test]
    fn exception_sets_the_highest_bit() {
        let bytes = encode_response(1, 3, &Response::Exception(ExceptionCode::IllegalDataAddress)).unwrap();
        assert_eq!(bytes, [0x01, 0x83, 0x02, 0xC0, 0xF1]);
    }

    #[test]
    fn impossible_counts_are_refused() {
        let cases = [
            Request::ReadHolding { address: 0, count: 0 },
            Request::ReadHolding { address: 0, count: 126 },
            Request::ReadHolding { address: 0xFFFF, count: 2 },
            Request::WriteMultiple { address: 0, values: vec![] },
            Request::WriteMultiple { address: 0, values: vec![0; 124] },
        ];
        for case in cases {
            assert!(encode_request(1, &case).is_err(), "{case}");
        }
        assert!(encode_request(1, &Request::ReadHolding { address: 0xFFFF, count: 1 }).is_ok());
        assert!(encode_response(1, 3, &Response::Registers(vec![0; 126])).is_err());
    }

    #[test]
    fn exception_codes_round_trip() {
        for code in 0..=255 {
            assert_eq!(ExceptionCode::from_code(code).code(), code);
        }
    }
}
