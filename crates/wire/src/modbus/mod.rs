//! Modbus RTU: frames, a server's and a client's decoder, and the times of the line.
//!
//! Sources: *Modbus Application Protocol Specification V1.1b3* (function codes, §6; exceptions, §7) and
//! *Modbus over Serial Line V1.02* (RTU framing, §2.5.1; timing, §2.5.1.1; CRC, §6.2).
//!
//! What a client can check of an answer, [`ClientDecoder`] checks: length, CRC, unit, function, byte count, and the
//! echoed address and value. What no codec can see is a LATE answer to an earlier request of the same shape: it is
//! a valid frame. After a time-out a driver therefore drains the line and keeps silent before it asks again, and it
//! reads back what it writes.

mod client;
mod encode_error;
mod pdu;
mod response_error;
mod server;
mod timing;

pub use client::ClientDecoder;
pub use encode_error::EncodeError;
pub use pdu::{ExceptionCode, MAX_READ_COUNT, MAX_WRITE_COUNT, Request, Response, encode_request, encode_response};
pub use response_error::ResponseError;
pub use server::{Incoming, ServerDecoder, ServerFrame, ServerStats};
pub use timing::{LineSettings, Parity, frame_time, inter_character_timeout, inter_frame_silence};

use crc::{CRC_16_MODBUS, Crc, Table};

/// The CRC of RTU frames: x¹⁶ + x¹⁵ + x² + 1 reflected, started at FFFF; sent low byte first (§2.5.1.2, §6.2).
static CRC: Crc<u16, Table<1>> = Crc::<u16, Table<1>>::new(&CRC_16_MODBUS);

/// Function codes this project uses.
pub(crate) mod function {
    pub const READ_HOLDING: u8 = 0x03;
    pub const WRITE_SINGLE: u8 = 0x06;
    pub const WRITE_MULTIPLE: u8 = 0x10;
    /// Set in the function code of an exception answer (V1.1b3 §7).
    pub const EXCEPTION_BIT: u8 = 0x80;
}

/// Appends the CRC, low byte first.
fn push_crc(frame: &mut Vec<u8>) {
    let crc = CRC.checksum(frame);
    frame.extend_from_slice(&crc.to_le_bytes());
}

/// Splits a whole frame into its body, the CRC it carries and the CRC it should carry; `None` below 4 bytes.
fn split_crc(frame: &[u8]) -> Option<(&[u8], u16, u16)> {
    if frame.len() < 4 {
        return None;
    }
    let (body, tail) = frame.split_last_chunk::<2>()?;
    Some((body, u16::from_le_bytes(*tail), CRC.checksum(body)))
}

/// Big-endian words of a data field; an odd byte at the end is not a word and is left out.
fn words(bytes: &[u8]) -> Vec<u16> {
    bytes.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect()
}
