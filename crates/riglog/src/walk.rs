//! Walks through a log in file order: unpacks chunks, links messages to channels, checks every
//! checksum, and gathers what the summary should say.

use std::{
    io::{self, Read, Seek},
    path::{Path, PathBuf},
};

use zstd::bulk::Decompressor;

use crate::{
    completeness::{Completeness, Defect},
    container::{
        MAGIC,
        bytes::Fields,
        chunk::{ChunkIndex, InnerRecord, MessageView},
        op,
        scan::{Place, Scanner, Step},
        summary::{AttachmentIndex, MetadataIndex, Summary},
    },
    error::LogError,
    metadata::MetadataMap,
    topic::Topic,
};

/// What a log holds, in file order; the bytes are borrowed until the next step.
#[derive(Debug)]
pub(crate) enum Event<'a> {
    /// A message of a whole chunk.
    Message { chunk_at: u64, topic: Option<Topic>, message: MessageView<'a> },
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

    /// The channel of a message that this walk returned.
    pub(crate) fn channel(&self, id: u16) -> Option<&Channel> {
        self.channels.get(usize::from(id))?.as_ref()
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
                let (chunk_at, topic) = (self.chunk_at, inner.topic);
                return Ok(Some(Event::Message { chunk_at, topic, message }));
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

    /// Notes a schema or a channel.
    fn describe(&mut self, opcode: u8, content: &[u8]) -> Result<(), Defect> {
        if opcode == op::SCHEMA {
            let mut fields = Fields::new("schema", content);
            let (id, name) = (fields.u16("number")?, fields.str("name")?);
            slot(&mut self.schema_names, id).replace(name.to_owned());
            self.summary.schemas.insert(id, content.to_vec());
            return Ok(());
        }
        let mut fields = Fields::new("channel", content);
        let (id, schema_id) = (fields.u16("number")?, fields.u16("schema")?);
        let (name, encoding) = (fields.str("topic")?, fields.str("encoding")?);
        let schema = self.schema_names.get(usize::from(schema_id)).cloned().flatten().unwrap_or_default();
        let topic = Topic::of_channel(name, &schema, encoding);
        slot(&mut self.channels, id).replace(Channel { name: name.to_owned(), schema, topic });
        slot(&mut self.counts, id);
        self.summary.channels.insert(id, content.to_vec());
        Ok(())
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

    fn data_record(&mut self, place: Place) -> Result<Option<Found>, LogError> {
        let was_after_chunk = std::mem::replace(&mut self.after_chunk, place.opcode == op::CHUNK);
        let result = match place.opcode {
            op::HEADER => self.header(place).map(|()| None),
            op::SCHEMA | op::CHANNEL => {
                let content = self.scanner.content().to_vec();
                self.describe(place.opcode, &content).map(|()| None)
            }
            op::CHUNK => self.open_chunk(place).map(|()| None),
            op::MESSAGE => self.lone_message(place).map(|()| None),
            op::MESSAGE_INDEX => {
                self.after_chunk = was_after_chunk;
                self.message_index(place, was_after_chunk).map(|()| None)
            }
            op::METADATA => self.metadata(place).map(Some),
            op::ATTACHMENT => self.attachment(place).map(Some),
            op::DATA_END => {
                self.end_of_data();
                return Ok(None);
            }
            // Records of other programs' own kinds.
            0x80.. => Ok(None),
            opcode => Err(Defect::Opcode { opcode }),
        };
        match result {
            // A chunk whose lengths disagree may have swallowed the next ones.
            Err(defect @ Defect::Malformed { record: "chunk", .. }) => self.lost(place.at, defect)?,
            Err(defect) => {
                self.completeness.add_damage(place.at, defect);
                // A record whose content is wrong still has its place in the file.
                self.data_end_at = place.next;
            }
            Ok(found) => {
                self.data_end_at = place.next;
                return Ok(found);
            }
        }
        Ok(None)
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

    fn header(&mut self, place: Place) -> Result<(), Defect> {
        if place.at != MAGIC.len() as u64 {
            return Err(Defect::Opcode { opcode: op::HEADER });
        }
        let mut fields = Fields::new("header", self.scanner.content());
        fields.str("profile")?;
        self.library = fields.str("library")?.to_owned();
        Ok(())
    }

    fn open_chunk(&mut self, place: Place) -> Result<(), Defect> {
        let view = self.scanner.chunk()?;
        if let Err(defect) = view.decompress(&mut self.zstd, &mut self.records) {
            self.records.clear();
            return Err(defect);
        }
        self.summary.chunks.push(ChunkIndex {
            start_ns: view.start_ns,
            end_ns: view.end_ns,
            offset: place.at,
            length: place.next - place.at,
            index_offsets: Default::default(),
            indexes_length: 0,
            compression: view.compression.to_owned(),
            compressed_size: view.data.len() as u64,
            uncompressed_size: view.uncompressed_size,
        });
        self.summary.widen(Some((view.start_ns, view.end_ns)));
        (self.chunk_at, self.offset) = (place.at, 0);
        Ok(())
    }

    /// A message outside of any chunk is read as a chunk of its own.
    fn lone_message(&mut self, place: Place) -> Result<(), Defect> {
        let message = MessageView::parse(self.scanner.content())?;
        self.summary.widen(Some((message.log_time_ns, message.log_time_ns)));
        self.records.clear();
        self.records.extend_from_slice(self.scanner.head());
        self.records.extend_from_slice(self.scanner.content());
        (self.chunk_at, self.offset) = (place.at, 0);
        Ok(())
    }

    fn message_index(&mut self, place: Place, after_chunk: bool) -> Result<(), Defect> {
        let channel = Fields::new("message index", self.scanner.content()).u16("channel")?;
        if let Some(chunk) = self.summary.chunks.last_mut().filter(|_| after_chunk) {
            chunk.index_offsets.insert(channel, place.at);
            chunk.indexes_length += place.next - place.at;
        }
        Ok(())
    }

    fn metadata(&mut self, place: Place) -> Result<Found, Defect> {
        let mut fields = Fields::new("metadata", self.scanner.content());
        let (name, map) = (fields.str("name")?.to_owned(), fields.map("content")?);
        self.summary.metadata.push(MetadataIndex {
            offset: place.at,
            length: place.next - place.at,
            name: name.clone(),
        });
        Ok(Found::Metadata(name, map))
    }

    fn attachment(&mut self, place: Place) -> Result<Found, Defect> {
        let content = self.scanner.content();
        let mut fields = Fields::new("attachment", content);
        let (log_time_ns, create_time_ns) = (fields.u64("log time")?, fields.u64("create time")?);
        let name = fields.str("name")?.to_owned();
        let media_type = fields.str("media type")?.to_owned();
        let data = fields.long_bytes("data")?;
        let covered = content.len() - fields.rest().len();
        let expected = fields.u32("checksum")?;
        let found = crc32fast::hash(&content[..covered]);
        if expected != 0 && expected != found {
            return Err(Defect::Checksum { what: "attachment", expected, found });
        }
        let data = covered - data.len()..covered;
        self.summary.attachments.push(AttachmentIndex {
            offset: place.at,
            length: place.next - place.at,
            log_time_ns,
            create_time_ns,
            data_size: data.len() as u64,
            name: name.clone(),
            media_type: media_type.clone(),
        });
        Ok(Found::Attachment(name, media_type, data))
    }

    fn event(&self, found: Found) -> Event<'_> {
        match found {
            Found::Metadata(name, map) => Event::Metadata { name, map },
            Found::Attachment(name, media_type, data) => {
                Event::Attachment { name, media_type, data: &self.scanner.content()[data] }
            }
        }
    }

    fn end_of_data(&mut self) {
        let expected = Fields::new("data end", self.scanner.content()).u32("checksum");
        let found = self.crc.clone().finalize();
        match expected {
            Ok(expected) if expected != 0 && expected != found => {
                let defect = Defect::Checksum { what: "data", expected, found };
                self.completeness.add_damage(self.data_end_at, defect);
            }
            Ok(_) => {}
            Err(defect) => self.completeness.add_damage(self.data_end_at, defect),
        }
        self.section = Section::Summary;
        self.crc = crc32fast::Hasher::new();
    }

    fn summary_record(&mut self) -> Result<(), LogError> {
        let at = self.scanner.at();
        match self.scanner.step() {
            Ok(Step::Record(place)) => {
                if place.opcode == op::FOOTER {
                    self.footer(place)?;
                    return Ok(());
                }
                if place.opcode == op::STATISTICS {
                    let stated = Fields::new("statistics", self.scanner.content()).u64("messages");
                    self.stated_messages = stated.ok();
                }
                self.crc.update(self.scanner.head());
                self.crc.update(self.scanner.content());
            }
            Ok(Step::End) => {
                self.completeness.add_truncation(at, Defect::NoEnd);
                self.section = Section::Over;
            }
            Ok(Step::Lost(defect)) => {
                self.completeness.add_truncation(at, defect);
                self.section = Section::Over;
            }
            Err(error) => self.read_error(at, error)?,
        }
        Ok(())
    }

    fn footer(&mut self, place: Place) -> Result<(), LogError> {
        self.section = Section::Over;
        let content = self.scanner.content();
        let mut fields = Fields::new("footer", content);
        let stated = fields
            .bytes("summary and offset start", 16)
            .and_then(|_| fields.u32("checksum").map(|crc| (crc, fields.rest().len())));
        match stated {
            Ok((expected, 0)) => {
                self.crc.update(self.scanner.head());
                self.crc.update(&content[..16]);
                let found = self.crc.clone().finalize();
                if expected != 0 && expected != found {
                    let defect = Defect::Checksum { what: "summary", expected, found };
                    self.completeness.add_damage(place.at, defect);
                }
            }
            Ok(_) => {
                let defect = Defect::Malformed { record: "footer", field: "end" };
                self.completeness.add_damage(place.at, defect);
            }
            Err(defect) => self.completeness.add_damage(place.at, defect),
        }
        let found: u64 = self.counts.iter().sum();
        if let Some(stated) = self.stated_messages.filter(|&stated| stated != found) {
            self.completeness.add_damage(place.at, Defect::MessageCount { stated, found });
        }
        let magic = self.scanner.raw().map_err(LogError::io("read", &self.path))?;
        match magic.as_ref() {
            None => self.completeness.add_truncation(place.next, Defect::NoEnd),
            Some(MAGIC) => self.has_end = true,
            Some(_) => {
                self.completeness.add_damage(place.next, Defect::Malformed { record: "file", field: "end magic" })
            }
        }
        let bytes = self.scanner.file_bytes() - self.scanner.at();
        if magic.is_some() && bytes > 0 {
            self.completeness.add_damage(self.scanner.at(), Defect::Trailing { bytes });
        }
        Ok(())
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

fn slot<T: Default + Clone>(of: &mut Vec<T>, id: u16) -> &mut T {
    let id = usize::from(id);
    if of.len() <= id {
        of.resize(id + 1, T::default());
    }
    &mut of[id]
}
