//! What can be wrong with an answer.

use thiserror::Error;

use super::Request;
use crate::Hex;

/// An answer that must not be believed. Every one of them carries the bytes; after any of them the line has to be
/// drained and kept silent before the next request.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ResponseError {
    /// The check sum does not fit the bytes.
    #[error(
        "answer to `{request}`: CRC {found:04X}h instead of {expected:04X}h in [{bytes}]: check wiring, termination, baud rate and parity"
    )]
    CrcMismatch {
        /// What was asked.
        request: Request,
        /// CRC in the frame.
        found: u16,
        /// CRC of its bytes.
        expected: u16,
        /// The frame.
        bytes: Hex,
    },
    /// Somebody else answered.
    #[error(
        "answer to `{request}`: from unit {found} instead of {expected} in [{bytes}]: check the unit numbers on this bus"
    )]
    WrongUnit {
        /// What was asked.
        request: Request,
        /// Unit in the frame.
        found: u8,
        /// Unit asked.
        expected: u8,
        /// The frame.
        bytes: Hex,
    },
    /// An answer to another kind of request, or noise.
    #[error(
        "answer to `{request}`: function {found:02X}h instead of {expected:02X}h in [{bytes}]: a late answer or noise; drain the line and ask again"
    )]
    WrongFunction {
        /// What was asked.
        request: Request,
        /// Function code in the frame.
        found: u8,
        /// Function code asked.
        expected: u8,
        /// What has arrived so far.
        bytes: Hex,
    },
    /// The data field is of another length than asked: a late answer, or the request's own echo.
    #[error(
        "answer to `{request}`: {found} data bytes instead of {expected} in [{bytes}]: a late answer, or an adapter that echoes; drain the line and ask again"
    )]
    WrongByteCount {
        /// What was asked.
        request: Request,
        /// Byte count in the frame.
        found: u8,
        /// Byte count of the registers asked for.
        expected: u8,
        /// What has arrived so far.
        bytes: Hex,
    },
    /// A write confirmed for another register or with another value.
    #[error(
        "answer to `{request}`: confirms {found_value:04X}h at {found_address:04X}h instead of {expected_value:04X}h at {expected_address:04X}h in [{bytes}]: read the register back before going on"
    )]
    WrongEcho {
        /// What was asked.
        request: Request,
        /// Register confirmed.
        found_address: u16,
        /// Register asked.
        expected_address: u16,
        /// Value (function 06) or count (function 16) confirmed.
        found_value: u16,
        /// Value or count asked.
        expected_value: u16,
        /// The frame.
        bytes: Hex,
    },
    /// Bytes after the end of the answer: two answers, or an answer and noise. Neither can be trusted.
    #[error(
        "answer to `{request}`: {found} bytes instead of {expected} in [{bytes}]: two devices answer, or a late answer is mixed in; drain the line and ask again"
    )]
    TooLong {
        /// What was asked.
        request: Request,
        /// Bytes that arrived.
        found: usize,
        /// Bytes of the whole answer.
        expected: usize,
        /// All bytes.
        bytes: Hex,
    },
}
