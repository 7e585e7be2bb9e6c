//! The rig's own counter box: both encoders' counters latched together, streamed in frames.
//!
//! A frame is a little-endian body and its CRC-32, stuffed by COBS and ended by a zero byte; see
//! `docs/wire/counter-box.md`, byte by byte. A [`Samples`] frame maps one to one to a logged batch of angles.

mod body;
mod decode;
mod encode;
mod frame;
mod varint;

pub use crate::samples::{SampleFlags, Samples};
pub use body::MalformedFrame;
pub use decode::{StreamDecoder, StreamStats};
pub use encode::{EncodeError, Encoder};
pub use frame::{Ack, AckStatus, BoxStatus, Command, Frame, Identity, RequestId};

use crc::{CRC_32_ISO_HDLC, Crc, Table};

/// Version of the format that this module speaks.
pub const PROTOCOL_VERSION: u16 = 1;
/// Most samples in a frame.
pub const MAX_SAMPLES_PER_FRAME: u16 = 1024;
/// Longest text in an identity, bytes of UTF-8.
pub const MAX_TEXT: usize = 64;

/// Fixed part of a samples body: type byte to sample count.
const SAMPLES_HEAD: usize = 61;
/// Longest body with its CRC: the fixed part and two deltas of at most 5 bytes a sample.
const MAX_PLAIN: usize = SAMPLES_HEAD + MAX_SAMPLES_PER_FRAME as usize * 10 + 4;
/// Longest frame on the wire without its delimiter: one code byte more for every 254 bytes, and one (COBS).
const MAX_STUFFED: usize = MAX_PLAIN + MAX_PLAIN / 254 + 1;

/// CRC-32 as in Ethernet and zlib (reflected 04C11DB7h), sixteen bytes a step.
static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// Type bytes. Those of the box have the highest bit set.
mod kind {
    pub const IDENTIFY: u8 = 0x01;
    pub const START: u8 = 0x02;
    pub const STOP: u8 = 0x03;
    pub const IDENTITY: u8 = 0x81;
    pub const ACK: u8 = 0x82;
    pub const SAMPLES: u8 = 0x83;
}
