//! Reads a log record by record, in file order.

use std::{
    fs::File,
    io::{BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use prost::Message;

use crate::{
    completeness::Completeness,
    error::LogError,
    metadata::{EncoderMetadata, MetadataMap, RunMetadata, SEALED, SEALED_KEY},
    proto::{AngleBatch, Backlash, RigState, TransmissionError, foxglove},
    topic::Topic,
    walk::{Event, Walk},
};

/// What a log holds; the messages carry the file's log and publish times.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// A batch of `/rig/angles`.
    Angles {
        /// Host time at arrival.
        log_time_ns: u64,
        /// Device time of the first sample.
        publish_time_ns: u64,
        /// The counts.
        batch: AngleBatch,
    },
    /// A message of `/rig/state`.
    State {
        /// Host time at arrival.
        log_time_ns: u64,
        /// Device time.
        publish_time_ns: u64,
        /// The state.
        state: RigState,
    },
    /// A message of `/rig/te`.
    Te {
        /// Host time at arrival.
        log_time_ns: u64,
        /// Device time.
        publish_time_ns: u64,
        /// The transmission error.
        te: TransmissionError,
    },
    /// A message of `/rig/backlash`.
    Backlash {
        /// Host time at arrival.
        log_time_ns: u64,
        /// Device time.
        publish_time_ns: u64,
        /// The backlash.
        backlash: Backlash,
    },
    /// A line of `/rig/events`.
    Event {
        /// Host time at arrival.
        log_time_ns: u64,
        /// Device time.
        publish_time_ns: u64,
        /// The line.
        event: foxglove::Log,
    },
    /// Metadata `rig.run`.
    Run(RunMetadata),
    /// Metadata `rig.encoders`.
    Encoders(EncoderMetadata),
    /// Metadata `rig.sealed`: the hash of a withheld label.
    Sealed(String),
    /// Metadata of another name.
    Metadata {
        /// The record's name.
        name: String,
        /// Its content.
        map: MetadataMap,
    },
    /// An attached file.
    Attachment {
        /// Its name.
        name: String,
        /// Its media type.
        media_type: String,
        /// Its content.
        data: Vec<u8>,
    },
    /// A message that is none of the rig's.
    Unknown {
        /// The topic that it came on.
        topic: String,
    },
}

/// Reads a log a chunk at a time. The iterator ends where the last whole record ends; what was found wrong up to
/// there says [`LogReader::completeness`].
///
/// An error item is about one record, or about the disk; the iterator goes on where it can.
pub struct LogReader<R = BufReader<File>> {
    walk: Walk<R>,
    path: PathBuf,
    failed: bool,
}

impl LogReader {
    /// Opens a log.
    ///
    /// # Errors
    /// The file cannot be read, is not MCAP, or is MCAP without any channel of a rig.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref();
        let (source, bytes) = open(path)?;
        Self::over(source, bytes, path)
    }
}

impl<R: Read + Seek> LogReader<R> {
    /// Reads a log of `bytes` bytes from any source; `name` stands in errors.
    ///
    /// # Errors
    /// As [`LogReader::open`].
    pub fn over(mut source: R, bytes: u64, name: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = name.as_ref();
        check_channels(Walk::new(&mut source, bytes, path)?)?;
        source.seek(SeekFrom::Start(0)).map_err(LogError::io("read", path))?;
        Ok(Self { walk: Walk::new(source, bytes, path)?, path: path.to_owned(), failed: false })
    }

    /// Whether the log is whole; `None` until the iterator has ended.
    pub fn completeness(&self) -> Option<&Completeness> {
        self.walk.completeness()
    }

    /// The program that wrote the log, once the first record was read.
    pub fn library(&self) -> &str {
        self.walk.library()
    }
}

impl<R: Read + Seek> Iterator for LogReader<R> {
    type Item = Result<Record, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        match self.walk.next() {
            Ok(event) => event.map(|event| decode(event, &self.path)),
            Err(error) => {
                self.failed = true;
                Some(Err(error))
            }
        }
    }
}

pub(crate) fn open(path: &Path) -> Result<(BufReader<File>, u64), LogError> {
    let file = File::open(path).map_err(LogError::io("open", path))?;
    let facts = file.metadata().map_err(LogError::io("open", path))?;
    if facts.is_dir() {
        return Err(LogError::io("read", path)(std::io::ErrorKind::IsADirectory.into()));
    }
    Ok((BufReader::with_capacity(1 << 16, file), facts.len()))
}

/// Walks until a channel of the rig turns up. A file that breaks off before any channel may be a rig log.
pub(crate) fn check_channels<R: Read + Seek>(mut walk: Walk<R>) -> Result<(), LogError> {
    loop {
        let more = walk.next()?.is_some();
        if walk.channels().any(|channel| channel.topic.is_some()) {
            return Ok(());
        }
        if !more {
            break;
        }
    }
    let topics: Vec<_> = walk.channels().map(|channel| channel.name.clone()).collect();
    let complete = walk.completeness().is_some_and(Completeness::is_complete);
    if topics.is_empty() && !complete {
        return Ok(());
    }
    Err(LogError::NoRigChannels { path: walk.path().to_owned(), topics })
}

pub(crate) fn bad_message(
    path: &Path,
    topic: Topic,
    log_time_ns: u64,
    at_byte: u64,
    source: prost::DecodeError,
) -> LogError {
    let (topic, schema) = (topic.name(), topic.schema());
    LogError::BadMessage { path: path.to_owned(), topic, schema, log_time_ns, at_byte, source }
}

pub(crate) fn decode(event: Event<'_>, path: &Path) -> Result<Record, LogError> {
    let (at_byte, topic, channel, message) = match event {
        Event::Message { chunk_at, topic, channel, message, .. } => (chunk_at, topic, channel, message),
        Event::Metadata { name, map } => return metadata(name, map),
        Event::Attachment { header, data } => {
            return Ok(Record::Attachment { name: header.name, media_type: header.media_type, data: data.to_vec() });
        }
    };
    let Some(topic) = topic else { return Ok(Record::Unknown { topic: channel.to_owned() }) };
    let (log_time_ns, publish_time_ns, data) = (message.log_time_ns, message.publish_time_ns, message.data);
    let record = match topic {
        Topic::Angles => AngleBatch::decode(data).map(|batch| Record::Angles { log_time_ns, publish_time_ns, batch }),
        Topic::State => RigState::decode(data).map(|state| Record::State { log_time_ns, publish_time_ns, state }),
        Topic::Te => TransmissionError::decode(data).map(|te| Record::Te { log_time_ns, publish_time_ns, te }),
        Topic::Backlash => {
            Backlash::decode(data).map(|backlash| Record::Backlash { log_time_ns, publish_time_ns, backlash })
        }
        Topic::Events => foxglove::Log::decode(data).map(|event| Record::Event { log_time_ns, publish_time_ns, event }),
    };
    record.map_err(|source| bad_message(path, topic, log_time_ns, at_byte, source))
}

fn metadata(name: String, map: MetadataMap) -> Result<Record, LogError> {
    Ok(match name.as_str() {
        RunMetadata::NAME => Record::Run(RunMetadata::from_map(&map)),
        EncoderMetadata::NAME => Record::Encoders(EncoderMetadata::from_map(&map)?),
        SEALED => Record::Sealed(sealed_hash(&map)),
        _ => Record::Metadata { name, map },
    })
}

/// The record holds one value; programs differ in what they call it.
fn sealed_hash(map: &MetadataMap) -> String {
    map.get(SEALED_KEY).or_else(|| map.values().next()).cloned().unwrap_or_default()
}
