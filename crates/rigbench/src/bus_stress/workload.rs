//! What a master is asked to read and write.

use rigd::device::bus::Span;

/// Registers of a device that a stress test reads and writes.
#[derive(Debug, Clone)]
pub struct Workload {
    /// Unit of the device.
    pub unit: u8,
    /// Ranges that are read: first register and count.
    pub reads: &'static [(u16, u16)],
    /// Settings that are written: first register, count and largest value of the first word.
    pub writes: &'static [(u16, u16, u16)],
    /// What may be read as a whole.
    pub spans: &'static [Span],
}
