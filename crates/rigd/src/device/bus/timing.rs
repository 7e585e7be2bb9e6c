//! How a device wants its line used.

use std::time::Duration;

/// How a device wants its line used.
#[derive(Debug, Clone, Copy)]
pub struct BusTiming {
    /// Silence before a request and after an answer.
    pub silence: Duration,
    /// Longest wait for an answer, beyond its time on the wire.
    pub patience: Duration,
    /// How often a request is sent before the device counts as lost.
    pub attempts: u32,
}

/// Consecutive registers that may all be read, whatever is in them: room for reads of different lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// First register.
    pub first: u16,
    /// How many.
    pub words: u16,
}

impl Span {
    pub(super) fn end(self) -> u32 {
        u32::from(self.first) + u32::from(self.words)
    }
}
