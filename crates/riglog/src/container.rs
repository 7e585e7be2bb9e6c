//! The MCAP container, <https://mcap.dev/spec>: as much of it as a rig log needs.
//!
//! It is written out here rather than taken from a library for three properties that a recorder
//! stands on: a chunk with its indexes leaves in a single write of whole records; a file that was
//! cut off is finalised by appending to it; and no length found in a file is trusted before it is
//! checked. The tests hold it against the public Rust and Python readers.

pub(crate) mod bytes;
pub(crate) mod chunk;
pub(crate) mod head;
pub(crate) mod scan;
pub(crate) mod summary;

/// First and last bytes of every file.
pub(crate) const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

/// Opcode and length stand before every record.
pub(crate) const RECORD_HEAD_BYTES: u64 = 1 + 8;

/// The largest record or decompressed chunk that is taken into memory. Writers close chunks at
/// about a megabyte; the largest attachment is a profile. Foreign files get generous room.
pub(crate) const MAX_RECORD_BYTES: u64 = 256 << 20;

/// Opcodes of the records.
pub(crate) mod op {
    pub(crate) const HEADER: u8 = 0x01;
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const MESSAGE_INDEX: u8 = 0x07;
    pub(crate) const CHUNK_INDEX: u8 = 0x08;
    pub(crate) const ATTACHMENT: u8 = 0x09;
    pub(crate) const ATTACHMENT_INDEX: u8 = 0x0A;
    pub(crate) const STATISTICS: u8 = 0x0B;
    pub(crate) const METADATA: u8 = 0x0C;
    pub(crate) const METADATA_INDEX: u8 = 0x0D;
    pub(crate) const SUMMARY_OFFSET: u8 = 0x0E;
    pub(crate) const DATA_END: u8 = 0x0F;
}
