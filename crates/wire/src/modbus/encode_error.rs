//! What can be wrong with a request.

use thiserror::Error;

/// A message that no frame can carry.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// No registers, or too many.
    #[error(
        "function {function:02X}h from register {address:04X}h carries {count} registers; a frame carries 1 to {limit}: split the request"
    )]
    Count {
        /// Function code.
        function: u8,
        /// First register.
        address: u16,
        /// Registers asked for.
        count: usize,
        /// Most a frame can carry.
        limit: u16,
    },
    /// The range runs past the last address.
    #[error(
        "function {function:02X}h: {count} registers from {address:04X}h run past the last register FFFFh: correct the address"
    )]
    PastEnd {
        /// Function code.
        function: u8,
        /// First register.
        address: u16,
        /// Registers asked for.
        count: usize,
    },
}
