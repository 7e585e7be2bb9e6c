//! The records of the data section: header, schemas, channels, chunks, metadata and attachments.

use std::io::{Read, Seek};

use super::{Channel, Found, Walk};
use crate::{
    completeness::Defect,
    container::{
        MAGIC,
        bytes::Fields,
        chunk::{ChunkIndex, MessageView},
        op,
        scan::Place,
        summary::{AttachmentIndex, MetadataIndex},
    },
    error::LogError,
    topic::Topic,
};

impl<R: Read + Seek> Walk<R> {
    /// Takes in a record; returns what the caller is to see of it.
    pub(super) fn data_record(&mut self, place: Place) -> Result<Option<Found>, LogError> {
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

    /// Notes a schema or a channel.
    pub(super) fn describe(&mut self, opcode: u8, content: &[u8]) -> Result<(), Defect> {
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
}

/// The slot of a number, which has 16 bits at most.
fn slot<T: Default + Clone>(of: &mut Vec<T>, id: u16) -> &mut T {
    let id = usize::from(id);
    if of.len() <= id {
        of.resize(id + 1, T::default());
    }
    &mut of[id]
}
