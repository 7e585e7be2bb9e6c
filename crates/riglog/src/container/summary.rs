//! The end of a file: data end, summary, footer and magic.

use std::collections::BTreeMap;

use crate::container::{MAGIC, RECORD_HEAD_BYTES, bytes::Put, chunk::ChunkIndex, op};

/// Opcode, length, three fields.
const FOOTER_BYTES: u64 = RECORD_HEAD_BYTES + 8 + 8 + 4;

/// Length of footer record and end magic together.
pub(crate) const TAIL_BYTES: u64 = FOOTER_BYTES + MAGIC.len() as u64;

/// What the summary says about an attachment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct AttachmentIndex {
    pub(crate) offset: u64,
    pub(crate) length: u64,
    pub(crate) log_time_ns: u64,
    pub(crate) create_time_ns: u64,
    pub(crate) data_size: u64,
    pub(crate) name: String,
    pub(crate) media_type: String,
}

/// What the summary says about a metadata record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct MetadataIndex {
    pub(crate) offset: u64,
    pub(crate) length: u64,
    pub(crate) name: String,
}

/// Everything that the summary repeats or counts, gathered while the data is written or read.
#[derive(Debug, Clone, Default)]
pub(crate) struct Summary {
    /// Contents of the schema records by number.
    pub(crate) schemas: BTreeMap<u16, Vec<u8>>,
    /// Contents of the channel records by number.
    pub(crate) channels: BTreeMap<u16, Vec<u8>>,
    pub(crate) chunks: Vec<ChunkIndex>,
    pub(crate) attachments: Vec<AttachmentIndex>,
    pub(crate) metadata: Vec<MetadataIndex>,
    pub(crate) message_counts: BTreeMap<u16, u64>,
    /// Earliest and latest log time.
    pub(crate) bounds_ns: Option<(u64, u64)>,
}

impl Summary {
    /// Number of messages on all channels.
    pub(crate) fn messages(&self) -> u64 {
        self.message_counts.values().sum()
    }

    pub(crate) fn add_message_count(&mut self, channel: u16, messages: u64) {
        *self.message_counts.entry(channel).or_default() += messages;
    }

    pub(crate) fn widen(&mut self, bounds_ns: Option<(u64, u64)>) {
        self.bounds_ns = match (self.bounds_ns, bounds_ns) {
            (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
            (known, new) => known.or(new),
        };
    }

    /// Adds what was written after the records that this summary covers.
    pub(crate) fn append(&mut self, later: Self) {
        self.widen(later.bounds_ns);
        self.schemas.extend(later.schemas);
        self.channels.extend(later.channels);
        self.chunks.extend(later.chunks);
        self.attachments.extend(later.attachments);
        self.metadata.extend(later.metadata);
        for (channel, messages) in later.message_counts {
            self.add_message_count(channel, messages);
        }
    }

    /// The bytes that end a file whose data is `data_length` long and has the checksum `data_crc`.
    pub(crate) fn encode_end(&self, data_length: u64, data_crc: u32) -> Vec<u8> {
        let mut out = Vec::new();
        out.put_record(op::DATA_END, |out| out.put_u32(data_crc));
        let summary_at = out.len();
        let mut groups = Vec::new();
        let mut group = |opcode: u8, out: &mut Vec<u8>, put: &dyn Fn(&mut Vec<u8>)| {
            let start = out.len();
            put(out);
            if out.len() > start {
                groups.push((opcode, data_length + start as u64, (out.len() - start) as u64));
            }
        };
        group(op::SCHEMA, &mut out, &|out| put_contents(out, op::SCHEMA, &self.schemas));
        group(op::CHANNEL, &mut out, &|out| put_contents(out, op::CHANNEL, &self.channels));
        group(op::STATISTICS, &mut out, &|out| self.put_statistics(out));
        group(op::CHUNK_INDEX, &mut out, &|out| self.chunks.iter().for_each(|c| put_chunk(out, c)));
        group(op::ATTACHMENT_INDEX, &mut out, &|out| {
            self.attachments.iter().for_each(|a| put_attachment(out, a));
        });
        group(op::METADATA_INDEX, &mut out, &|out| {
            self.metadata.iter().for_each(|m| put_metadata(out, m));
        });
        let offsets_at = out.len();
        for (opcode, start, length) in groups {
            out.put_record(op::SUMMARY_OFFSET, |out| {
                out.push(opcode);
                out.put_u64(start);
                out.put_u64(length);
            });
        }
        out.put_record(op::FOOTER, |out| {
            out.put_u64(data_length + summary_at as u64);
            out.put_u64(data_length + offsets_at as u64);
            out.put_u32(0);
        });
        // The checksum covers the summary and the footer, its length included, up to the checksum itself.
        let crc_at = out.len() - 4;
        let crc = crc32fast::hash(&out[summary_at..crc_at]);
        out[crc_at..].copy_from_slice(&crc.to_le_bytes());
        out.extend_from_slice(MAGIC);
        out
    }

    fn put_statistics(&self, out: &mut Vec<u8>) {
        let (start_ns, end_ns) = self.bounds_ns.unwrap_or_default();
        out.put_record(op::STATISTICS, |out| {
            out.put_u64(self.messages());
            out.put_u16(self.schemas.len() as u16);
            out.put_u32(self.channels.len() as u32);
            out.put_u32(self.attachments.len() as u32);
            out.put_u32(self.metadata.len() as u32);
            out.put_u32(self.chunks.len() as u32);
            out.put_u64(start_ns);
            out.put_u64(end_ns);
            out.put_u32(self.message_counts.len() as u32 * 10);
            for (&channel, &messages) in &self.message_counts {
                out.put_u16(channel);
                out.put_u64(messages);
            }
        });
    }
}

fn put_contents(out: &mut Vec<u8>, opcode: u8, contents: &BTreeMap<u16, Vec<u8>>) {
    for content in contents.values() {
        out.put_record(opcode, |out| out.extend_from_slice(content));
    }
}

fn put_chunk(out: &mut Vec<u8>, chunk: &ChunkIndex) {
    out.put_record(op::CHUNK_INDEX, |out| {
        out.put_u64(chunk.start_ns);
        out.put_u64(chunk.end_ns);
        out.put_u64(chunk.offset);
        out.put_u64(chunk.length);
        out.put_u32(chunk.index_offsets.len() as u32 * 10);
        for (&channel, &offset) in &chunk.index_offsets {
            out.put_u16(channel);
            out.put_u64(offset);
        }
        out.put_u64(chunk.indexes_length);
        out.put_str(&chunk.compression);
        out.put_u64(chunk.compressed_size);
        out.put_u64(chunk.uncompressed_size);
    });
}

fn put_attachment(out: &mut Vec<u8>, attachment: &AttachmentIndex) {
    out.put_record(op::ATTACHMENT_INDEX, |out| {
        out.put_u64(attachment.offset);
        out.put_u64(attachment.length);
        out.put_u64(attachment.log_time_ns);
        out.put_u64(attachment.create_time_ns);
        out.put_u64(attachment.data_size);
        out.put_str(&attachment.name);
        out.put_str(&attachment.media_type);
    });
}

fn put_metadata(out: &mut Vec<u8>, metadata: &MetadataIndex) {
    out.put_record(op::METADATA_INDEX, |out| {
        out.put_u64(metadata.offset);
        out.put_u64(metadata.length);
        out.put_str(&metadata.name);
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::bytes::Fields;

    #[test]
    fn the_footer_points_at_the_summary_and_seals_it() {
        let data_length = 5000;
        let mut summary = Summary::default();
        summary.add_message_count(1, 7);
        summary.widen(Some((5, 9)));
        summary.widen(Some((3, 4)));
        assert_eq!(summary.bounds_ns, Some((3, 9)));
        let end = summary.encode_end(data_length, 0xABCD);
        assert_eq!(&end[end.len() - 8..], MAGIC);
        let footer = &end[end.len() - TAIL_BYTES as usize..];
        assert_eq!(footer[0], op::FOOTER);
        let mut fields = Fields::new("footer", &footer[9..]);
        let start = (fields.u64("summary start").unwrap() - data_length) as usize;
        assert_eq!(end[start], op::STATISTICS);
        let offsets = (fields.u64("offset start").unwrap() - data_length) as usize;
        assert_eq!(end[offsets], op::SUMMARY_OFFSET);
        let crc_at = end.len() - 8 - 4;
        assert_eq!(fields.u32("checksum"), Ok(crc32fast::hash(&end[start..crc_at])));
    }
}
