//! Chunks: messages gathered and compressed together, with an index record for each channel.

use std::{collections::BTreeMap, io};

use zstd::bulk::{Compressor, Decompressor};

use crate::{
    completeness::Defect,
    container::{
        MAX_RECORD_BYTES, RECORD_HEAD_BYTES,
        bytes::{Fields, Put},
        op,
    },
};

const ZSTD: &str = "zstd";

/// Where the messages of each channel lie in a decompressed chunk: (log time, offset).
pub(crate) type MessageIndexes = BTreeMap<u16, Vec<(u64, u64)>>;

/// What the summary says about a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ChunkIndex {
    pub(crate) start_ns: u64,
    pub(crate) end_ns: u64,
    pub(crate) offset: u64,
    pub(crate) length: u64,
    /// Where each channel's index record begins.
    pub(crate) index_offsets: BTreeMap<u16, u64>,
    pub(crate) indexes_length: u64,
    pub(crate) compression: String,
    pub(crate) compressed_size: u64,
    pub(crate) uncompressed_size: u64,
}

/// Messages on their way into a chunk.
#[derive(Debug, Default)]
pub(crate) struct ChunkBuilder {
    records: Vec<u8>,
    bounds_ns: Option<(u64, u64)>,
    first_log_time_ns: u64,
    indexes: MessageIndexes,
    messages: u64,
}

impl ChunkBuilder {
    pub(crate) fn is_empty(&self) -> bool {
        self.messages == 0
    }

    pub(crate) fn bytes(&self) -> usize {
        self.records.len()
    }

    /// Log time of the message that came first.
    pub(crate) fn first_log_time_ns(&self) -> u64 {
        self.first_log_time_ns
    }

    /// Earliest and latest log time.
    pub(crate) fn bounds_ns(&self) -> Option<(u64, u64)> {
        self.bounds_ns
    }

    /// Number of messages on each channel.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (u16, u64)> + '_ {
        let used = self.indexes.iter().filter(|(_, entries)| !entries.is_empty());
        used.map(|(&channel, entries)| (channel, entries.len() as u64))
    }

    /// Adds a message whose bytes `encode` appends.
    pub(crate) fn add(
        &mut self,
        channel: u16,
        sequence: u32,
        log_time_ns: u64,
        publish_time_ns: u64,
        encode: impl FnOnce(&mut Vec<u8>),
    ) {
        let offset = self.records.len() as u64;
        self.records.put_record(op::MESSAGE, |out| {
            out.put_u16(channel);
            out.put_u32(sequence);
            out.put_u64(log_time_ns);
            out.put_u64(publish_time_ns);
            encode(out);
        });
        if self.messages == 0 {
            self.first_log_time_ns = log_time_ns;
        }
        let (start, end) = self.bounds_ns.unwrap_or((log_time_ns, log_time_ns));
        self.bounds_ns = Some((start.min(log_time_ns), end.max(log_time_ns)));
        self.indexes.entry(channel).or_default().push((log_time_ns, offset));
        self.messages += 1;
    }

    /// Appends the chunk and its indexes to `out`, whose first byte lands at `at_byte` of the file.
    pub(crate) fn encode(
        &self,
        codec: &mut ChunkCompressor,
        at_byte: u64,
        out: &mut Vec<u8>,
    ) -> io::Result<ChunkIndex> {
        let compressed = codec.compress(&self.records)?;
        let (start_ns, end_ns) = self.bounds_ns.unwrap_or_default();
        let offset = at_byte + out.len() as u64;
        out.put_record(op::CHUNK, |out| {
            out.put_u64(start_ns);
            out.put_u64(end_ns);
            out.put_u64(self.records.len() as u64);
            out.put_u32(crc32fast::hash(&self.records));
            out.put_str(ZSTD);
            out.put_u64(compressed.len() as u64);
            out.extend_from_slice(compressed);
        });
        let indexes_at = at_byte + out.len() as u64;
        let index_offsets = put_indexes(&self.indexes, at_byte, out);
        Ok(ChunkIndex {
            start_ns,
            end_ns,
            offset,
            length: indexes_at - offset,
            index_offsets,
            indexes_length: at_byte + out.len() as u64 - indexes_at,
            compression: ZSTD.to_owned(),
            compressed_size: compressed.len() as u64,
            uncompressed_size: self.records.len() as u64,
        })
    }

    /// Forgets the messages, keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.records.clear();
        self.bounds_ns = None;
        self.messages = 0;
        self.indexes.values_mut().for_each(Vec::clear);
    }
}

/// Appends an index record for each channel and returns where each begins.
pub(crate) fn put_indexes(indexes: &MessageIndexes, at_byte: u64, out: &mut Vec<u8>) -> BTreeMap<u16, u64> {
    let mut offsets = BTreeMap::new();
    for (&channel, entries) in indexes.iter().filter(|(_, entries)| !entries.is_empty()) {
        offsets.insert(channel, at_byte + out.len() as u64);
        out.put_record(op::MESSAGE_INDEX, |out| {
            out.put_u16(channel);
            out.put_u32(entries.len() as u32 * 16);
            for &(log_time_ns, offset) in entries {
                out.put_u64(log_time_ns);
                out.put_u64(offset);
            }
        });
    }
    offsets
}

/// A zstd context and its output, used for one chunk after the other.
pub(crate) struct ChunkCompressor {
    zstd: Compressor<'static>,
    compressed: Vec<u8>,
}

impl ChunkCompressor {
    pub(crate) fn new(level: i32) -> io::Result<Self> {
        Ok(Self { zstd: Compressor::new(level)?, compressed: Vec::new() })
    }

    fn compress(&mut self, records: &[u8]) -> io::Result<&[u8]> {
        self.compressed.clear();
        self.compressed.reserve(zstd::zstd_safe::compress_bound(records.len()));
        self.zstd.compress_to_buffer(records, &mut self.compressed)?;
        Ok(&self.compressed)
    }
}

/// A chunk record, still compressed.
#[derive(Debug)]
pub(crate) struct ChunkView<'a> {
    pub(crate) start_ns: u64,
    pub(crate) end_ns: u64,
    pub(crate) uncompressed_size: u64,
    pub(crate) compression: &'a str,
    pub(crate) data: &'a [u8],
    crc: u32,
}

impl<'a> ChunkView<'a> {
    pub(crate) fn parse(content: &'a [u8]) -> Result<Self, Defect> {
        let mut fields = Fields::new("chunk", content);
        let view = Self {
            start_ns: fields.u64("start time")?,
            end_ns: fields.u64("end time")?,
            uncompressed_size: fields.u64("uncompressed size")?,
            crc: fields.u32("checksum")?,
            compression: fields.str("compression")?,
            data: fields.long_bytes("records")?,
        };
        // Two lengths that disagree say that one of them is wrong, and it may be the record's own.
        if fields.rest().is_empty() { Ok(view) } else { Err(Defect::Malformed { record: "chunk", field: "end" }) }
    }

    /// Decompresses into `records` and holds the result against the chunk's checksum.
    pub(crate) fn decompress(&self, zstd: &mut Decompressor<'static>, records: &mut Vec<u8>) -> Result<(), Defect> {
        let (bytes, limit) = (self.uncompressed_size, MAX_RECORD_BYTES);
        if bytes > limit {
            return Err(Defect::TooLarge { what: "a decompressed chunk", bytes, limit });
        }
        let mismatch =
            || Defect::Compression { compressed_bytes: self.data.len(), expected_bytes: self.uncompressed_size };
        records.clear();
        match self.compression {
            "" => records.extend_from_slice(self.data),
            ZSTD => {
                records.reserve(bytes as usize);
                zstd.decompress_to_buffer(self.data, records).map_err(|_| mismatch())?;
            }
            name => return Err(Defect::UnknownCompression { name: name.to_owned() }),
        }
        if records.len() as u64 != bytes {
            return Err(mismatch());
        }
        // The format says "no checksum" by zero.
        if self.crc != 0 {
            let found = crc32fast::hash(records);
            if found != self.crc {
                return Err(Defect::Checksum { what: "chunk", expected: self.crc, found });
            }
        }
        Ok(())
    }
}

/// One record inside a decompressed chunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InnerRecord<'a> {
    pub(crate) opcode: u8,
    pub(crate) content: &'a [u8],
    /// Where the next record begins.
    pub(crate) next: usize,
}

impl<'a> InnerRecord<'a> {
    /// The record at `offset`; `None` at the end of the chunk.
    pub(crate) fn at(records: &'a [u8], offset: usize) -> Result<Option<Self>, Defect> {
        let Some(rest) = records.get(offset..).filter(|rest| !rest.is_empty()) else {
            return Ok(None);
        };
        let mut fields = Fields::new("chunk", rest);
        let opcode = fields.u8("opcode of an inner record")?;
        let content = fields.long_bytes("inner record")?;
        let next = offset + RECORD_HEAD_BYTES as usize + content.len();
        Ok(Some(Self { opcode, content, next }))
    }
}

/// A message record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MessageView<'a> {
    pub(crate) channel: u16,
    pub(crate) log_time_ns: u64,
    pub(crate) publish_time_ns: u64,
    pub(crate) data: &'a [u8],
}

impl<'a> MessageView<'a> {
    pub(crate) fn parse(content: &'a [u8]) -> Result<Self, Defect> {
        let mut fields = Fields::new("message", content);
        let channel = fields.u16("channel")?;
        fields.u32("sequence")?;
        Ok(Self {
            channel,
            log_time_ns: fields.u64("log time")?,
            publish_time_ns: fields.u64("publish time")?,
            data: fields.rest(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk() -> (ChunkBuilder, Vec<u8>, ChunkIndex) {
        let mut builder = ChunkBuilder::default();
        builder.add(1, 0, 50, 40, |out| out.extend_from_slice(b"angles"));
        builder.add(2, 0, 30, 41, |out| out.extend_from_slice(b"state"));
        builder.add(1, 1, 70, 42, |out| out.extend_from_slice(&[9; 500]));
        let (mut codec, mut out) = (ChunkCompressor::new(1).unwrap(), b"head".to_vec());
        let index = builder.encode(&mut codec, 1000, &mut out).unwrap();
        (builder, out, index)
    }

    fn content(out: &[u8]) -> &[u8] {
        let mut fields = Fields::new("chunk", &out[5..]);
        fields.long_bytes("chunk").unwrap()
    }

    #[test]
    fn messages_come_back_in_order_where_the_index_says() {
        let (builder, out, index) = chunk();
        assert_eq!((index.start_ns, index.end_ns, index.offset), (30, 70, 1004));
        assert_eq!(index.length + index.indexes_length + 4, out.len() as u64);
        let view = ChunkView::parse(content(&out)).unwrap();
        let mut records = Vec::new();
        view.decompress(&mut Decompressor::new().unwrap(), &mut records).unwrap();
        let mut seen = MessageIndexes::new();
        let mut offset = 0;
        while let Some(record) = InnerRecord::at(&records, offset).unwrap() {
            let message = MessageView::parse(record.content).unwrap();
            seen.entry(message.channel).or_default().push((message.log_time_ns, offset as u64));
            offset = record.next;
        }
        assert_eq!(seen, builder.indexes);
        for at in index.index_offsets.values() {
            assert_eq!(out[(at - 1000) as usize], op::MESSAGE_INDEX);
        }
    }

    #[test]
    fn a_flipped_bit_anywhere_in_the_records_is_found() {
        let (_, out, _) = chunk();
        let clean = content(&out).to_vec();
        let records_at = clean.len() - ChunkView::parse(&clean).unwrap().data.len();
        for at in records_at..clean.len() {
            let mut bad = clean.clone();
            bad[at] ^= 0x10;
            let view = ChunkView::parse(&bad).unwrap();
            let mut records = Vec::new();
            let result = view.decompress(&mut Decompressor::new().unwrap(), &mut records);
            // A bit that zstd does not use may flip without changing what comes out.
            assert!(result.is_err() || records.len() as u64 == view.uncompressed_size, "byte {at}");
        }
    }

    #[test]
    fn a_chunk_that_announces_a_terabyte_is_refused_before_memory_is_taken() {
        let (_, out, _) = chunk();
        let mut bad = content(&out).to_vec();
        bad[16..24].copy_from_slice(&(1u64 << 40).to_le_bytes());
        let view = ChunkView::parse(&bad).unwrap();
        let error = view.decompress(&mut Decompressor::new().unwrap(), &mut Vec::new()).unwrap_err();
        assert!(matches!(error, Defect::TooLarge { .. }), "{error}");
    }
}
