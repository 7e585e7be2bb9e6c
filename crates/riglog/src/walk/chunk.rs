//! The records of one chunk, checked against its checksum before the first of them is used.

use mcap::{
    McapError,
    records::{Record, op},
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

use crate::{
    completeness::Defect,
    record::{MAX_RECORD_BYTES, RECORD_HEAD_BYTES, parse},
};

/// Takes one chunk after the other apart. The reader is kept from chunk to chunk, as is its decompressor.
pub(super) struct ChunkRecords {
    /// Reads a file that consists of chunks alone.
    reader: LinearReader,
    /// Size of the chunk under way, compressed and not.
    compressed_bytes: usize,
    expected_bytes: u64,
    /// Size of its records that were read.
    read_bytes: u64,
    is_open: bool,
}

impl ChunkRecords {
    pub(super) fn new() -> Self {
        Self { reader: reader(), compressed_bytes: 0, expected_bytes: 0, read_bytes: 0, is_open: false }
    }

    /// Whether the record read last may be followed by more of its chunk.
    pub(super) fn is_open(&self) -> bool {
        self.is_open
    }

    /// Begins with the chunk whose record has this content.
    pub(super) fn open(&mut self, content: &[u8]) -> Result<(), Defect> {
        let Record::Chunk { header, data } = parse(op::CHUNK, content)? else {
            return Err(Defect::Opcode { opcode: op::CHUNK });
        };
        let (bytes, limit) = (header.uncompressed_size, MAX_RECORD_BYTES as u64);
        if bytes > limit {
            return Err(Defect::TooLarge { what: "a decompressed chunk", bytes, limit });
        }
        (self.compressed_bytes, self.expected_bytes, self.read_bytes) = (data.len(), bytes, 0);
        if header.compression.is_empty() && data.len() as u64 != bytes {
            return Err(self.mismatch());
        }
        let mut head = [op::CHUNK; RECORD_HEAD_BYTES as usize];
        head[1..].copy_from_slice(&(content.len() as u64).to_le_bytes());
        for part in [&head[..], content] {
            self.reader.insert(part.len()).copy_from_slice(part);
            self.reader.notify_read(part.len());
        }
        self.is_open = true;
        Ok(())
    }

    /// Copies the content of the next record to `content` and returns its opcode; `None` after the last one.
    ///
    /// # Errors
    /// What is wrong with the chunk; the rest of it is left out.
    pub(super) fn next(&mut self, content: &mut Vec<u8>) -> Result<Option<u8>, Defect> {
        if !self.is_open {
            return Ok(None);
        }
        let error = match self.reader.next_event() {
            Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                content.clear();
                content.extend_from_slice(data);
                self.read_bytes += RECORD_HEAD_BYTES + data.len() as u64;
                return Ok(Some(opcode));
            }
            // All of the chunk is in the reader: it asks for the next one.
            Some(Ok(LinearReadEvent::ReadRequest(_))) | None if self.read_bytes == self.expected_bytes => {
                self.is_open = false;
                return Ok(None);
            }
            Some(Ok(LinearReadEvent::ReadRequest(_))) | None => McapError::UnexpectedEoc,
            Some(Err(error)) => error,
        };
        self.leave();
        Err(self.defect(error))
    }

    /// Leaves the rest of the chunk out.
    pub(super) fn leave(&mut self) {
        self.reader = reader();
        self.is_open = false;
    }

    fn defect(&self, error: McapError) -> Defect {
        match error {
            McapError::BadChunkCrc { saved, calculated } => {
                Defect::Checksum { what: "chunk", expected: saved, found: calculated }
            }
            McapError::UnsupportedCompression(name) => Defect::UnknownCompression { name },
            McapError::RecordTooLarge { .. } => Defect::Malformed { record: "chunk", field: "inner record" },
            McapError::UnexpectedEoc if self.read_bytes > 0 => {
                Defect::Malformed { record: "chunk", field: "inner record" }
            }
            _ => self.mismatch(),
        }
    }

    fn mismatch(&self) -> Defect {
        Defect::Compression { compressed_bytes: self.compressed_bytes, expected_bytes: self.expected_bytes }
    }
}

fn reader() -> LinearReader {
    LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(MAX_RECORD_BYTES),
    )
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, io::Cursor};

    use mcap::{Compression, records::MessageHeader};

    use super::*;

    /// The content of a chunk record with a channel and two messages.
    fn chunk(compression: Option<Compression>) -> Vec<u8> {
        let options = mcap::WriteOptions::new().compression(compression);
        let mut out = options.create(Cursor::new(Vec::new())).unwrap();
        let channel_id = out.add_channel(0, "/t", "json", &BTreeMap::new()).unwrap();
        for (sequence, data) in [(0, &b"one"[..]), (1, &[9; 500])] {
            let header = MessageHeader { channel_id, sequence, log_time: 5, publish_time: 4 };
            out.write_to_known_channel(&header, data).unwrap();
        }
        out.finish().unwrap();
        let bytes = out.into_inner().into_inner();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let at = summary.chunk_indexes[0].chunk_start_offset as usize;
        bytes[at + 9..at + summary.chunk_indexes[0].chunk_length as usize].to_vec()
    }

    fn opcodes(records: &mut ChunkRecords, content: &[u8]) -> Result<Vec<u8>, Defect> {
        records.open(content)?;
        let (mut opcodes, mut buffer) = (Vec::new(), Vec::new());
        while let Some(opcode) = records.next(&mut buffer)? {
            opcodes.push(opcode);
        }
        Ok(opcodes)
    }

    #[test]
    fn chunks_of_every_compression_are_read_one_after_the_other() {
        let mut records = ChunkRecords::new();
        for compression in [Some(Compression::Zstd), None, Some(Compression::Lz4), Some(Compression::Zstd)] {
            let expected = Ok(vec![op::CHANNEL, op::MESSAGE, op::MESSAGE]);
            assert_eq!(opcodes(&mut records, &chunk(compression)), expected, "{compression:?}");
        }
    }

    #[test]
    fn a_flipped_bit_is_found_and_costs_no_other_chunk() {
        let clean = chunk(Some(Compression::Zstd));
        let mut records = ChunkRecords::new();
        for at in 0..clean.len() {
            let mut bad = clean.clone();
            bad[at] ^= 0x10;
            // The times are not covered by the chunk's checksum, and zstd does not use every bit.
            if let Ok(opcodes) = opcodes(&mut records, &bad) {
                assert_eq!(opcodes, [op::CHANNEL, op::MESSAGE, op::MESSAGE], "byte {at}");
            }
            assert_eq!(opcodes(&mut records, &clean).map(|o| o.len()), Ok(3), "after byte {at}");
        }
    }

    #[test]
    fn an_inner_record_longer_than_its_chunk_is_a_defect_without_a_checksum_too() {
        let mut bad = chunk(None);
        let records_at = 28 + 4 + 8;
        bad[24..28].fill(0);
        bad[records_at + 1] ^= 0xFF;
        let defect = opcodes(&mut ChunkRecords::new(), &bad).unwrap_err();
        assert!(matches!(defect, Defect::Compression { .. } | Defect::Malformed { .. }), "{defect}");
    }

    #[test]
    fn a_chunk_that_announces_a_terabyte_is_refused_before_memory_is_taken() {
        let mut bad = chunk(Some(Compression::Zstd));
        bad[16..24].copy_from_slice(&(1u64 << 40).to_le_bytes());
        let error = opcodes(&mut ChunkRecords::new(), &bad).unwrap_err();
        assert!(matches!(error, Defect::TooLarge { .. }), "{error}");
    }
}
