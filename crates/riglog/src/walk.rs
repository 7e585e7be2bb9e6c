//! Walks through a log in file order: unpacks chunks, links messages to channels, checks every checksum, and goes on
//! behind what is damaged.

mod chunk;
mod data;
pub(crate) mod records;
mod resync;

use std::{
    collections::BTreeMap,
    io::{Read, Seek, SeekFrom},
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

use mcap::{
    McapError,
    records::{AttachmentHeader, MessageHeader, op},
};

use self::{
    chunk::ChunkRecords,
    records::{Records, Step},
};
use crate::{
    completeness::{Completeness, Defect},
    error::LogError,
    metadata::MetadataMap,
    record::parse,
    topic::Topic,
};

/// What a log holds, in file order; the bytes are borrowed until the next step.
#[derive(Debug)]
pub(crate) enum Event<'a> {
    /// A message; the chunk that holds it, or the message itself where it is in none, begins at `chunk_at`.
    Message { chunk_at: u64, in_chunk: bool, topic: Option<Topic>, channel: &'a str, message: MessageView<'a> },
    /// A metadata record.
    Metadata { name: String, map: MetadataMap },
    /// An attachment.
    Attachment { header: AttachmentHeader, data: &'a [u8] },
}

/// A message record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MessageView<'a> {
    pub(crate) header: MessageHeader,
    pub(crate) log_time_ns: u64,
    pub(crate) publish_time_ns: u64,
    pub(crate) data: &'a [u8],
}

/// A channel as the file describes it.
#[derive(Debug, Clone)]
pub(crate) struct Channel {
    pub(crate) name: String,
    pub(crate) schema: String,
    pub(crate) topic: Option<Topic>,
    /// Messages met so far.
    pub(crate) messages: u64,
    pub(crate) definition: Arc<mcap::Channel<'static>>,
}

/// Where in the file the walk stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Section {
    Data,
    Summary,
    Magic,
    Over,
}

/// The walk itself.
pub(crate) struct Walk<R> {
    path: PathBuf,
    records: Records<R>,
    section: Section,
    /// The chunk under way, where it stands, and the record of it that was read last.
    chunk: ChunkRecords,
    chunk_at: u64,
    content: Vec<u8>,
    /// Channels by number; messages look theirs up in here.
    channels: Vec<Option<Channel>>,
    schemas: BTreeMap<u16, Arc<mcap::Schema<'static>>>,
    library: String,
    completeness: Completeness,
    /// Where the whole records of the data section end.
    data_end_at: u64,
    stated_messages: Option<u64>,
    /// Whether footer and end magic stand where they should.
    has_end: bool,
}

impl<R: Read + Seek> Walk<R> {
    /// Starts at the beginning of `source`, of `file_bytes` bytes.
    pub(crate) fn new(mut source: R, file_bytes: u64, path: &Path) -> Result<Self, LogError> {
        let io = |source| LogError::Io { action: "read", path: path.to_owned(), source };
        source.seek(SeekFrom::Start(0)).map_err(io)?;
        let mut magic = Vec::new();
        source.by_ref().take(mcap::MAGIC.len() as u64).read_to_end(&mut magic).map_err(io)?;
        if magic != mcap::MAGIC {
            let found = match magic.len() == mcap::MAGIC.len() {
                true => format!("\"{}\"", magic.escape_ascii()),
                false => format!("{file_bytes} bytes only"),
            };
            return Err(LogError::NotMcap { path: path.to_owned(), found });
        }
        Ok(Self {
            path: path.to_owned(),
            records: Records::new(source, file_bytes).map_err(io)?,
            section: Section::Data,
            chunk: ChunkRecords::new(),
            chunk_at: 0,
            content: Vec::new(),
            channels: Vec::new(),
            schemas: BTreeMap::new(),
            library: String::new(),
            completeness: Completeness::Complete,
            data_end_at: mcap::MAGIC.len() as u64,
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

    /// The channels met so far, in the order of their numbers.
    pub(crate) fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.channels.iter().flatten()
    }

    /// Where the whole records of the data end.
    pub(crate) fn data_end_at(&self) -> u64 {
        self.data_end_at
    }

    /// Whether the file has its footer and end magic.
    pub(crate) fn has_end(&self) -> bool {
        self.has_end
    }

    /// The next message, metadata record or attachment; `None` at the end of what can be read.
    pub(crate) fn next(&mut self) -> Result<Option<Event<'_>>, LogError> {
        loop {
            if let Some(found) = self.next_inner() {
                return Ok(Some(self.event(found)));
            }
            if self.section == Section::Over {
                return Ok(None);
            }
            match self.records.step().map_err(LogError::io("read", &self.path))? {
                Step::Record(place) if self.section == Section::Data => {
                    if let Some(found) = self.data_record(place)? {
                        return Ok(Some(self.event(found)));
                    }
                }
                Step::Record(place) => self.summary_record(place),
                Step::End => {
                    self.section = Section::Over;
                    self.has_end = true;
                }
                Step::Failed(error) => self.failed(&error)?,
            }
        }
    }

    /// The next message of the chunk under way. Schemas and channels in it are noted on the way.
    fn next_inner(&mut self) -> Option<Found> {
        loop {
            let result = match self.chunk.next(&mut self.content) {
                Ok(opcode) => match opcode? {
                    op::MESSAGE => self.message().map(Some),
                    opcode @ (op::SCHEMA | op::CHANNEL) => {
                        let content = std::mem::take(&mut self.content);
                        let result = parse(opcode, &content).map(|record| self.describe(record));
                        self.content = content;
                        result.map(|()| None)
                    }
                    _ => Ok(None),
                },
                Err(defect) => Err(defect),
            };
            match result {
                Ok(None) => {}
                Ok(found) => return found,
                Err(defect) => {
                    self.completeness.add_damage(self.chunk_at, defect);
                    self.chunk.leave();
                    return None;
                }
            }
        }
    }

    /// The reader does not get over what stands at its place: over a wrong checksum it is helped, behind other
    /// damage it starts anew.
    fn failed(&mut self, error: &McapError) -> Result<(), LogError> {
        let at = self.records.at();
        let defect = self.records.defect(error).map_err(LogError::io("read", &self.path))?;
        match (self.section, error) {
            (_, McapError::BadDataCrc { .. } | McapError::BadSummaryCrc { .. }) => {
                self.completeness.add_damage(at, defect);
                self.restart(at)?;
            }
            (Section::Data, _) if defect != Defect::NoEnd => self.lost(at, defect)?,
            (Section::Magic, McapError::BadMagic) => {
                self.section = Section::Over;
                self.completeness.add_damage(at, Defect::Malformed { record: "file", field: "end magic" });
            }
            (Section::Magic, McapError::BytesAfterEndMagic) => {
                (self.section, self.has_end) = (Section::Over, true);
                let at = at + mcap::MAGIC.len() as u64;
                self.completeness.add_damage(at, Defect::Trailing { bytes: self.records.file_bytes() - at });
            }
            (Section::Magic, _) => {
                self.section = Section::Over;
                self.completeness.add_truncation(at, Defect::NoEnd);
            }
            _ => {
                self.section = Section::Over;
                self.completeness.add_truncation(at, defect);
            }
        }
        Ok(())
    }

    /// No whole record stands at `at`: a chunk further on shows that this is damage and not the end.
    fn lost(&mut self, at: u64, defect: Defect) -> Result<(), LogError> {
        let file_bytes = self.records.file_bytes();
        let next = resync::next_chunk(self.records.source(), at + 1, file_bytes);
        match next.map_err(LogError::io("read", &self.path))? {
            Some(next) => {
                self.completeness.add_damage(at, defect);
                self.restart(next)?;
            }
            None => {
                self.completeness.add_truncation(at, defect);
                self.section = Section::Over;
            }
        }
        Ok(())
    }

    /// Goes on behind the last whole record of a file that has grown to `file_bytes` since.
    pub(crate) fn resume(&mut self, file_bytes: u64) -> Result<(), LogError> {
        if self.section == Section::Over && !self.has_end {
            self.section = Section::Data;
            self.completeness = Completeness::Complete;
            self.records.grow(file_bytes);
            self.restart(self.data_end_at)?;
        }
        Ok(())
    }

    fn restart(&mut self, at: u64) -> Result<(), LogError> {
        self.records.restart(at).map_err(LogError::io("read", &self.path))
    }

    fn event(&self, found: Found) -> Event<'_> {
        match found {
            Found::Message(header, data_at) => {
                let channel = self.channels.get(usize::from(header.channel_id)).and_then(Option::as_ref);
                Event::Message {
                    chunk_at: self.chunk_at,
                    in_chunk: self.chunk.is_open(),
                    topic: channel.and_then(|channel| channel.topic),
                    channel: channel.map_or("", |channel| &channel.name),
                    message: MessageView {
                        header,
                        log_time_ns: header.log_time,
                        publish_time_ns: header.publish_time,
                        data: &self.content[data_at..],
                    },
                }
            }
            Found::Metadata(name, map) => Event::Metadata { name, map },
            Found::Attachment(Attached { header, data }) => {
                Event::Attachment { header, data: &self.records.content()[data] }
            }
        }
    }
}

/// What the caller sees, without its borrowed bytes.
enum Found {
    /// The message's data begins there in the record under way.
    Message(MessageHeader, usize),
    Metadata(String, MetadataMap),
    Attachment(Attached),
}

/// An attachment and where its data lies in its record.
struct Attached {
    header: AttachmentHeader,
    data: Range<usize>,
}
