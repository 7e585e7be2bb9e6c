//! Walks through a log in file order: unpacks chunks, links messages to channels, checks every
//! checksum, and gathers what the summary should say.

mod data;
mod ending;

use std::{
    io::{self, Read, Seek},
    path::{Path, PathBuf},
};

use zstd::bulk::Decompressor;

use crate::{
    completeness::{Completeness, Defect},
    container::{
        MAGIC,
        chunk::{InnerRecord, MessageView},
        op,
        scan::{Place, Scanner, Step},
        summary::Summary,
    },
    error::LogError,
    metadata::MetadataMap,
    topic::Topic,
};

/// What a log holds, in file order; the bytes are borrowed until the next step.
#[derive(Debug)]
pub(crate) enum Event<'a> {
    /// A message of a whole chunk.
    Message { chunk_at: u64, topic: Option<Topic>, channel: &'a str, message: MessageView<'a> },
    /// A metadata record.
    Metadata { name: String, map: MetadataMap },
    /// An attachment.
    Attachment { name: String, media_type: String, data: &'a [u8] },
}

/// A channel as the file describes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) name: String,
    pub(crate) schema: String,
    pub(crate) topic: Option<Topic>,
}

/// Where in the file the walk stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Section {
    Data,
    Summary,
    Over,
}

/// The walk itself.
pub(crate) struct Walk<R> {
    path: PathBuf,
    scanner: Scanner<R>,
    zstd: Decompressor<'static>,
    section: Section,
    /// The decompressed chunk under way: where it stands, its records, and the next one in it.
    chunk_at: u64,
    records: Vec<u8>,
    offset: usize,
    /// Channels by number; messages look theirs up in here.
    channels: Vec<Option<Channel>>,
    schema_names: Vec<Option<String>>,
    counts: Vec<u64>,
    library: String,
    summary: Summary,
    crc: crc32fast::Hasher,
    completeness: Completeness,
    /// Where the whole records of the data section end.
    data_end_at: u64,
    /// Message indexes belong to the chunk right before them.
    after_chunk: bool,
    stated_messages: Option<u64>,
    /// Whether footer and end magic stand where they should.
    has_end: bool,
}

impl<R: Read + Seek> Walk<R> {
    /// Starts at the beginning of `source`, of `file_bytes` bytes.
    pub(crate) fn new(source: R, file_bytes: u64, path: &Path) -> Result<Self, LogError> {
        let mut scanner = Scanner::new(source, 0, file_bytes);
        let io = |source| LogError::Io { action: "read", path: path.to_owned(), source };
        let magic = scanner.raw::<{ MAGIC.len() }>().map_err(io)?;
        if magic.as_ref() != Some(MAGIC) {
            let found = match magic {
                Some(bytes) => format!("\"{}\"", bytes.escape_ascii()),
                None => format!("{file_bytes} bytes only"),
            };
            return Err(LogError::NotMcap { path: path.to_owned(), found });
        }
        let mut crc = crc32fast::Hasher::new();
        crc.update(MAGIC);
        Ok(Self {
            path: path.to_owned(),
            data_end_at: scanner.at(),
            scanner,
            zstd: Decompressor::new().map_err(io)?,
            section: Section::Data,
            chunk_at: 0,
            records: Vec::new(),
            offset: 0,
            channels: Vec::new(),
            schema_names: Vec::new(),
            counts: Vec::new(),
            library: String::new(),
            summary: Summary::default(),
            crc,
            completeness: Completeness::Complete,
            after_chunk: false,
            stated_messages: None,
            has_end: false,
        })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the walk is over, and if so what was found wrong.
    pub(crate) fn completeness(&self) -> Option<&Completeness> {
        (self.section == Section::Over).then_some(&self.completeness)
    }

    /// The program that wrote the file, as far as it was read.
    pub(crate) fn library(&self) -> &str {
        &self.library
    }

    /// The channels met so far.
    pub(crate) fn channels(&self) -> impl Iterator<Item = (u16, &Channel)> {
        self.channels.iter().enumerate().filter_map(|(id, c)| Some((id as u16, c.as_ref()?)))
    }

    /// Messages met so far on a channel.
    pub(crate) fn count(&self, id: u16) -> u64 {
        self.counts.get(usize::from(id)).copied().unwrap_or(0)
    }

    /// Where the whole records of the data end.
    pub(crate) fn data_end_at(&self) -> u64 {
        self.data_end_at
    }

    /// Whether the file has its footer and end magic.
    pub(crate) fn has_end(&self) -> bool {
        self.has_end
    }

    /// What the summary of the data read so far says.
    pub(crate) fn into_summary(mut self) -> Summary {
        for (id, &count) in self.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            self.summary.add_message_count(id as u16, count);
        }
        self.summary
    }

    /// The next message, metadata record or attachment; `None` at the end of what can be read.
    pub(crate) fn next(&mut self) -> Result<Option<Event<'_>>, LogError> {
        loop {
            if let Some(inner) = self.next_inner() {
                let message = MessageView {
                    channel: inner.channel,
                    log_time_ns: inner.log_time_ns,
                    publish_time_ns: inner.publish_time_ns,
                    data: &self.records[inner.data],
                };
                let channel = self.channels.get(usize::from(inner.channel)).and_then(Option::as_ref);
                return Ok(Some(Event::Message {
                    chunk_at: self.chunk_at,
                    topic: inner.topic,
                    channel: channel.map_or("", |channel| &channel.name),
                    message,
                }));
            }
            match self.section {
                Section::Over => return Ok(None),
                Section::Data => {
                    if let Some(place) = self.step()?
                        && let Some(found) = self.data_record(place)?
                    {
                        return Ok(Some(self.event(found)));
                    }
                }
                Section::Summary => self.summary_record()?,
            }
        }
    }

    /// The next message of the chunk under way. Schemas and channels in it are noted on the way.
    fn next_inner(&mut self) -> Option<Inner> {
        loop {
            let record = match InnerRecord::at(&self.records, self.offset) {
                Ok(record) => record?,
                Err(defect) => {
                    self.leave_chunk(defect);
                    return None;
                }
            };
            let (opcode, next) = (record.opcode, record.next);
            let content_at = next - record.content.len();
            let result = match opcode {
                op::MESSAGE => self.message(content_at, next).map(Some),
                op::SCHEMA | op::CHANNEL => {
                    let content = self.records[content_at..next].to_vec();
                    self.describe(opcode, &content).map(|()| None)
                }
                _ => Ok(None),
            };
            self.offset = next;
            match result {
                Ok(Some(message)) => return Some(message),
                Ok(None) => {}
                Err(defect) => {
                    self.leave_chunk(defect);
                    return None;
                }
            }
        }
    }

    fn leave_chunk(&mut self, defect: Defect) {
        self.completeness.add_damage(self.chunk_at, defect);
        self.records.clear();
        self.offset = 0;
    }

    /// Counts the message whose content stands at `from..to` of the chunk, and links it to its topic.
    fn message(&mut self, from: usize, to: usize) -> Result<Inner, Defect> {
        let message = MessageView::parse(&self.records[from..to])?;
        let id = usize::from(message.channel);
        let Some(Some(channel)) = self.channels.get(id) else {
            return Err(Defect::UnknownChannel { channel: message.channel });
        };
        self.counts[id] += 1;
        Ok(Inner {
            topic: channel.topic,
            channel: message.channel,
            log_time_ns: message.log_time_ns,
            publish_time_ns: message.publish_time_ns,
            data: to - message.data.len()..to,
        })
    }

    /// Reads a record of the data section; `None` where something else happened.
    fn step(&mut self) -> Result<Option<Place>, LogError> {
        let at = self.scanner.at();
        match self.scanner.step() {
            Ok(Step::Record(place)) => {
                if place.opcode != op::DATA_END {
                    self.crc.update(self.scanner.head());
                    self.crc.update(self.scanner.content());
                }
                return Ok(Some(place));
            }
            Ok(Step::End) => {
                self.completeness.add_truncation(at, Defect::NoEnd);
                self.section = Section::Over;
            }
            Ok(Step::Lost(defect)) => self.lost(at, defect)?,
            Err(error) => self.read_error(at, error)?,
        }
        Ok(None)
    }

    /// A file that shrinks under its reader is cut; any other error is the disk's.
    fn read_error(&mut self, at: u64, error: io::Error) -> Result<(), LogError> {
        self.section = Section::Over;
        if error.kind() != io::ErrorKind::UnexpectedEof {
            return Err(LogError::io("read", &self.path)(error));
        }
        self.completeness.add_truncation(at, Defect::NoEnd);
        Ok(())
    }

    /// No whole record stands at `at`: a chunk further on shows that this is damage and not the end.
    fn lost(&mut self, at: u64, defect: Defect) -> Result<(), LogError> {
        if self.scanner.resync(at + 1).map_err(LogError::io("read", &self.path))? {
            self.completeness.add_damage(at, defect);
        } else {
            self.completeness.add_truncation(at, defect);
            self.section = Section::Over;
        }
        Ok(())
    }

    fn event(&self, found: Found) -> Event<'_> {
        match found {
            Found::Metadata(name, map) => Event::Metadata { name, map },
            Found::Attachment(name, media_type, data) => {
                Event::Attachment { name, media_type, data: &self.scanner.content()[data] }
            }
        }
    }
}

/// A message of the chunk under way, without its borrowed bytes.
struct Inner {
    topic: Option<Topic>,
    channel: u16,
    log_time_ns: u64,
    publish_time_ns: u64,
    data: std::ops::Range<usize>,
}

/// A record that the caller sees, without its borrowed bytes.
enum Found {
    Metadata(String, MetadataMap),
    Attachment(String, String, std::ops::Range<usize>),
}
