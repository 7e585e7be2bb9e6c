//! Parses records with the `mcap` crate, behind a check of the lengths that it would trust.
//!
//! `mcap::parse_record` takes memory by the lengths of strings before it looks whether they fit (up to 4 GiB each),
//! and indexes past an attachment that is too short. A damaged file must do neither.

use mcap::{
    McapError,
    records::{Record, op},
};

use crate::completeness::Defect;

/// Opcode and length stand before every record.
pub(crate) const RECORD_HEAD_BYTES: u64 = 1 + 8;

/// The largest record or decompressed chunk that is taken into memory. Writers close chunks at
/// about a megabyte; the largest attachment is a profile. Foreign files get generous room.
pub(crate) const MAX_RECORD_BYTES: usize = 256 << 20;

/// A part of a record, as far as its length goes.
#[derive(Clone, Copy)]
enum Part {
    /// So many bytes.
    Fixed(usize),
    /// A length of 32 bits and as many bytes.
    Text,
    /// A length of 32 bits, and in as many bytes keys and values.
    Map,
    /// A length of 64 bits and as many bytes.
    Data,
}

/// The name of a record and its parts; records without texts need no check.
fn layout(opcode: u8) -> (&'static str, &'static [Part]) {
    use Part::{Data, Fixed, Map, Text};
    match opcode {
        op::HEADER => ("header", &[Text, Text]),
        op::FOOTER => ("footer", &[Fixed(20)]),
        op::SCHEMA => ("schema", &[Fixed(2), Text, Text, Text]),
        op::CHANNEL => ("channel", &[Fixed(4), Text, Text, Map]),
        op::MESSAGE => ("message", &[Fixed(22)]),
        op::CHUNK => ("chunk", &[Fixed(28), Text, Data]),
        op::ATTACHMENT => ("attachment", &[Fixed(16), Text, Text, Data, Fixed(4)]),
        op::METADATA => ("metadata", &[Text, Map]),
        op::STATISTICS => ("statistics", &[Fixed(42), Text]),
        op::DATA_END => ("data end", &[Fixed(4)]),
        _ => ("other", &[]),
    }
}

/// The record whose content is `content`.
pub(crate) fn parse(opcode: u8, content: &[u8]) -> Result<Record<'_>, Defect> {
    let (record, parts) = layout(opcode);
    let malformed = |field| Defect::Malformed { record, field };
    let rest = skip(content, parts).ok_or(malformed("length of a field"))?;
    // Two lengths that disagree say that one of them is wrong, and it may be the record's own.
    if matches!(opcode, op::CHUNK | op::ATTACHMENT) && !rest.is_empty() {
        return Err(malformed("end"));
    }
    mcap::parse_record(opcode, content).map_err(|error| match error {
        McapError::BadAttachmentCrc { saved, calculated } => {
            Defect::Checksum { what: "attachment", expected: saved, found: calculated }
        }
        _ => malformed("content"),
    })
}

/// What follows the parts; `None` where they do not fit.
fn skip<'a>(mut rest: &'a [u8], parts: &[Part]) -> Option<&'a [u8]> {
    for part in parts {
        rest = match part {
            Part::Fixed(bytes) => rest.get(*bytes..)?,
            Part::Text => text(rest)?.1,
            Part::Map => {
                let (mut entries, after) = text(rest)?;
                while !entries.is_empty() {
                    entries = text(entries)?.1;
                }
                after
            }
            Part::Data => {
                let (length, data) = rest.split_first_chunk()?;
                data.get(usize::try_from(u64::from_le_bytes(*length)).ok()?..)?
            }
        };
    }
    Some(rest)
}

/// The bytes after a length of 32 bits, and what follows them.
fn text(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_length_beyond_the_record_is_a_defect_not_an_allocation() {
        for opcode in [op::HEADER, op::SCHEMA, op::CHANNEL, op::CHUNK, op::ATTACHMENT, op::METADATA] {
            let error = parse(opcode, &[0xFF; 60]).unwrap_err();
            assert!(matches!(error, Defect::Malformed { .. }), "{error}");
        }
    }

    #[test]
    fn an_attachment_too_short_for_its_checksum_is_a_defect() {
        // Times, two empty texts, no data, and three of the four bytes of the checksum.
        let content = vec![0; 8 + 8 + 4 + 4 + 8 + 3];
        assert!(parse(op::ATTACHMENT, &content).is_err());
    }

    proptest! {
        #[test]
        fn any_bytes_are_either_a_record_or_a_defect(
            opcode in 0u8..0x20,
            content in prop::collection::vec(prop_oneof![Just(0u8), any::<u8>()], 0..90),
        ) {
            let _ = parse(opcode, &content);
        }
    }
}
