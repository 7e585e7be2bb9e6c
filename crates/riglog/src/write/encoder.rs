//! Turns messages into the bytes of a log with the `mcap` crate, and hands them out as whole records.
//!
//! The crate puts schemas and channels into chunks alone, and a chunk without messages would date the log to 1970.
//! So they also stand at the head of the file, as the crate writes them without chunks, and go into the first chunk
//! that has messages: the file says what it is from its first moment on, and either place may be damaged. The checksum
//! of the data is taken here, because the crate does not see the head.

use std::{
    io::{self, Cursor, Seek, SeekFrom, Write},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use mcap::{
    Attachment, Channel, Compression, McapError, McapResult, WriteOptions,
    records::{MessageHeader, Metadata, op},
};

/// Opcode and length of the record that ends the data, and its checksum.
const DATA_END_CRC: std::ops::Range<usize> = 9..13;

/// Bytes on their way into a file.
#[derive(Debug, Default)]
struct Bytes {
    /// Where in the file they begin.
    at: u64,
    bytes: Vec<u8>,
}

/// What the crate writes to: memory, which never refuses.
#[derive(Debug, Clone, Default)]
struct Gather(Arc<Mutex<Bytes>>);

impl Gather {
    fn lock(&self) -> MutexGuard<'_, Bytes> {
        // Nothing is called while it is locked, so it is never left half changed.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take(&self) -> Vec<u8> {
        let mut gathered = self.lock();
        gathered.at += gathered.bytes.len() as u64;
        std::mem::take(&mut gathered.bytes)
    }
}

impl Write for Gather {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.lock().bytes.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Gather {
    /// Tells the place; a log is never written but at its end.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let gathered = self.lock();
        match to {
            SeekFrom::Current(0) => Ok(gathered.at + gathered.bytes.len() as u64),
            _ => Err(io::ErrorKind::NotSeekable.into()),
        }
    }
}

/// Encodes one log.
pub(crate) struct Encoder {
    writer: mcap::Writer<Gather>,
    gather: Gather,
    /// Channels that wait for the first chunk.
    channels: Vec<Arc<Channel<'static>>>,
    /// Checksum of everything taken.
    crc: crc32fast::Hasher,
}

impl Encoder {
    /// Begins a log of the program `library` with these channels; zstd compresses at `level`.
    pub(crate) fn new(library: &str, level: i32, channels: Vec<Arc<Channel<'static>>>) -> McapResult<Self> {
        let options = WriteOptions::new()
            .library(library)
            .compression(Some(Compression::Zstd))
            // The crate takes no sign, but hands the number on to zstd as one that has it.
            .compression_level(level as u32)
            .compression_threads(0)
            .chunk_size(None)
            .disable_seeking(true)
            .calculate_data_section_crc(false);
        let mut head = options.clone().use_chunks(false).create(Cursor::new(Vec::new()))?;
        describe(&mut head, &channels)?;
        let gather = Gather::default();
        let writer = options.create(gather.clone())?;
        // The head begins as the writer did.
        gather.lock().bytes = head.into_inner().into_inner();
        Ok(Self { writer, gather, channels, crc: crc32fast::Hasher::new() })
    }

    /// Adds a message to the chunk under way.
    pub(crate) fn message(&mut self, header: &MessageHeader, data: &[u8]) -> McapResult<()> {
        if !self.channels.is_empty() {
            describe(&mut self.writer, &std::mem::take(&mut self.channels))?;
        }
        self.writer.write_to_known_channel(header, data)
    }

    /// Ends the chunk under way, where there is one.
    pub(crate) fn close_chunk(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Adds a metadata record, behind the chunk under way.
    pub(crate) fn metadata(&mut self, metadata: &Metadata) -> McapResult<()> {
        self.writer.write_metadata(metadata)
    }

    /// Adds an attachment, behind the chunk under way.
    pub(crate) fn attachment(&mut self, attachment: &Attachment<'_>) -> McapResult<()> {
        self.writer.attach(attachment)
    }

    /// The whole records since the last call.
    pub(crate) fn take(&mut self) -> Vec<u8> {
        let bytes = self.gather.take();
        self.crc.update(&bytes);
        bytes
    }

    /// Ends the log: what was not taken yet, summary, footer and magic, and what the summary says.
    pub(crate) fn finish(&mut self) -> McapResult<(Vec<u8>, mcap::Summary)> {
        self.close_chunk()?;
        let mut bytes = self.take();
        let summary = self.writer.finish()?;
        let mut end = self.gather.take();
        if end.first() == Some(&op::DATA_END)
            && let Some(crc) = end.get_mut(DATA_END_CRC)
        {
            crc.copy_from_slice(&self.crc.clone().finalize().to_le_bytes());
        }
        bytes.append(&mut end);
        Ok((bytes, summary))
    }
}

/// Adds channels and their schemas under their numbers.
fn describe<W: Write + Seek>(writer: &mut mcap::Writer<W>, channels: &[Arc<Channel<'_>>]) -> McapResult<()> {
    for channel in channels {
        let mut schema_id = 0;
        if let Some(schema) = &channel.schema {
            schema_id = writer.add_schema_with_id(schema.id, &schema.name, &schema.encoding, &schema.data)?;
        }
        let (topic, encoding) = (&channel.topic, &channel.message_encoding);
        writer.add_channel_with_id(channel.id, schema_id, topic, encoding, &channel.metadata)?;
    }
    Ok(())
}

/// The error of the compressor, which is all that can fail.
pub(crate) fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}

#[cfg(test)]
mod tests {
    use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

    use super::*;

    fn channel() -> Arc<Channel<'static>> {
        let schema = mcap::Schema { id: 7, name: "n".into(), encoding: "jsonschema".into(), data: b"{}".into() };
        let (topic, message_encoding) = ("/t".into(), "json".into());
        Arc::new(Channel { id: 3, topic, schema: Some(schema.into()), message_encoding, metadata: Default::default() })
    }

    /// Opcodes of the file's records; every checksum is checked.
    fn opcodes(bytes: &[u8]) -> Vec<u8> {
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true);
        let mut reader = LinearReader::new_with_options(options);
        reader.insert(bytes.len()).copy_from_slice(bytes);
        reader.notify_read(bytes.len());
        let mut opcodes = Vec::new();
        while let Some(event) = reader.next_event() {
            let LinearReadEvent::Record { opcode, data } = event.unwrap() else { panic!("cut") };
            assert!(opcode != op::DATA_END || data != [0; 4], "no checksum of the data");
            opcodes.push(opcode);
        }
        opcodes
    }

    #[test]
    fn the_head_stands_outside_of_chunks_and_no_chunk_is_empty() {
        let mut encoder = Encoder::new("test", 1, vec![channel()]).unwrap();
        let mut file = encoder.take();
        encoder.metadata(&Metadata { name: "m".into(), metadata: Default::default() }).unwrap();
        file.append(&mut encoder.take());
        let header = MessageHeader { channel_id: 3, sequence: 0, log_time: 9, publish_time: 8 };
        encoder.message(&header, b"{}").unwrap();
        assert!(encoder.take().is_empty(), "a chunk leaves when it is closed");
        let (mut end, summary) = encoder.finish().unwrap();
        file.append(&mut end);
        assert_eq!(
            opcodes(&file)[..6],
            [op::HEADER, op::SCHEMA, op::CHANNEL, op::METADATA, op::CHUNK, op::MESSAGE_INDEX]
        );
        assert_eq!(summary.chunk_indexes.len(), 1);
        assert_eq!(summary.chunk_indexes[0].message_start_time, 9);
        // The places that the summary states are those in the file.
        let summary = mcap::Summary::read(&file).unwrap().unwrap();
        let indexes = summary.read_message_indexes(&file, &summary.chunk_indexes[0]).unwrap();
        assert_eq!(indexes.values().map(Vec::len).sum::<usize>(), 1);
        assert_eq!(mcap::read::metadata(&file, &summary.metadata_indexes[0]).unwrap().name, "m");
    }

    #[test]
    fn a_log_without_messages_has_no_chunk() {
        let mut encoder = Encoder::new("test", 1, vec![channel()]).unwrap();
        let (file, _) = encoder.finish().unwrap();
        let opcodes = opcodes(&file);
        assert!(!opcodes.contains(&op::CHUNK) && opcodes.contains(&op::CHANNEL), "{opcodes:?}");
    }
}
