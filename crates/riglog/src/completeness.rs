//! Whether a log is whole, and if not, where and why.

use thiserror::Error;

/// How much of a log could be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Completeness {
    /// Every byte is accounted for, up to the end magic.
    Complete,
    /// A clean prefix: the writer was killed, or the disk was full. Everything before `at_byte` was read.
    Truncated {
        /// Where the whole records end.
        at_byte: u64,
        /// What is missing there.
        why: Defect,
    },
    /// Bytes inside the file are wrong. What they cover was left out; everything else was read.
    Damaged {
        /// The first wrong place.
        at_byte: u64,
        /// What is wrong there.
        why: Defect,
        /// How many places are wrong.
        places: u32,
    },
}

impl Completeness {
    /// Whether the log is whole.
    pub fn is_complete(&self) -> bool {
        matches!(self, Self::Complete)
    }

    /// Adds what was found in another part of the log; the first fault of the worst kind is kept.
    pub(crate) fn add(&mut self, other: Self) {
        match (&*self, &other) {
            (_, Self::Complete) | (Self::Damaged { .. }, Self::Truncated { .. }) => {}
            (Self::Truncated { .. }, Self::Truncated { .. }) => {}
            (Self::Damaged { at_byte, why, places }, Self::Damaged { places: more, .. }) => {
                let places = places.saturating_add(*more);
                *self = Self::Damaged { at_byte: *at_byte, why: why.clone(), places };
            }
            _ => *self = other,
        }
    }

    /// Adds a place where bytes are wrong; damage outweighs truncation, the first place is kept.
    pub(crate) fn add_damage(&mut self, place: u64, defect: Defect) {
        match self {
            Self::Damaged { places, .. } => *places = places.saturating_add(1),
            _ => *self = Self::Damaged { at_byte: place, why: defect, places: 1 },
        }
    }

    /// Notes that the file stops short at `place`.
    pub(crate) fn add_truncation(&mut self, place: u64, defect: Defect) {
        match self {
            Self::Complete => *self = Self::Truncated { at_byte: place, why: defect },
            Self::Truncated { .. } => {}
            Self::Damaged { places, .. } => *places = places.saturating_add(1),
        }
    }
}

impl std::fmt::Display for Completeness {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Complete => f.write_str("complete"),
            Self::Truncated { at_byte, why } => write!(f, "cut off at byte {at_byte}: {why}"),
            Self::Damaged { at_byte, why, places } => {
                write!(f, "damaged at {places} place(s), first at byte {at_byte}: {why}")
            }
        }
    }
}

/// What is wrong with a place in a file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Defect {
    /// The file ends where a record should begin or go on to the summary.
    #[error("no end record, the writer was stopped")]
    NoEnd,
    /// The file ends inside a record.
    #[error("record 0x{opcode:02x} wants {wanted_bytes} bytes, the file has {left_bytes} left")]
    Cut {
        /// The record's kind.
        opcode: u8,
        /// The length that it announces.
        wanted_bytes: u64,
        /// What is there.
        left_bytes: u64,
    },
    /// The beginning of the file is cut.
    #[error("the file has {bytes} bytes, a log's head has more")]
    NoHead {
        /// The file's size.
        bytes: u64,
    },
    /// A record is larger than any that a log holds.
    #[error("{what} of {bytes} bytes, the limit is {limit}")]
    TooLarge {
        /// What it is.
        what: &'static str,
        /// The size that it announces.
        bytes: u64,
        /// The largest accepted.
        limit: u64,
    },
    /// A checksum does not match.
    #[error("checksum of the {what} is {found:08x}, {expected:08x} was written")]
    Checksum {
        /// What it covers.
        what: &'static str,
        /// The sum that the file states.
        expected: u32,
        /// The sum of the bytes.
        found: u32,
    },
    /// A record's fields do not fit into it.
    #[error("the {record} record's {field} does not fit into it")]
    Malformed {
        /// The record.
        record: &'static str,
        /// The field.
        field: &'static str,
    },
    /// A chunk does not decompress to what its header says.
    #[error("a chunk of {compressed_bytes} bytes does not decompress to {expected_bytes}")]
    Compression {
        /// Its compressed size.
        compressed_bytes: usize,
        /// The announced size.
        expected_bytes: u64,
    },
    /// A chunk is compressed by a method that a rig log does not use.
    #[error("chunk compression {name:?}; rig logs use zstd, re-encode the file")]
    UnknownCompression {
        /// The method's name.
        name: String,
    },
    /// An opcode that cannot stand here.
    #[error("opcode 0x{opcode:02x} cannot stand here")]
    Opcode {
        /// The opcode.
        opcode: u8,
    },
    /// A message refers to a channel that was never announced.
    #[error("a message on channel {channel}, which no record before it describes")]
    UnknownChannel {
        /// The channel's number.
        channel: u16,
    },
    /// Bytes follow the end of the file's content.
    #[error("{bytes} bytes after the end magic")]
    Trailing {
        /// How many.
        bytes: u64,
    },
    /// A part of a log that was split is not there.
    #[error("part {part} of the log is missing; put it beside the others")]
    MissingPart {
        /// Its number, from 1.
        part: u32,
    },
    /// The summary and the data disagree.
    #[error("the summary counts {stated} messages, the data holds {found}")]
    MessageCount {
        /// What the summary says.
        stated: u64,
        /// What was read.
        found: u64,
    },
}
