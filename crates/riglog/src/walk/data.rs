//! The records of the data section: header, schemas, channels, chunks, metadata and attachments.

use std::{
    io::{Read, Seek},
    sync::Arc,
};

use mcap::records::{Record, op};

use super::{Attached, Channel, Found, Section, Walk, records::Place};
use crate::{
    completeness::Defect,
    error::LogError,
    record::{RECORD_HEAD_BYTES, parse},
    topic::Topic,
};

impl<R: Read + Seek> Walk<R> {
    /// Takes in a record; returns what the caller is to see of it.
    pub(super) fn data_record(&mut self, place: Place) -> Result<Option<Found>, LogError> {
        let result = match place.opcode {
            op::CHUNK => self.chunk.open(self.records.content()).map(|()| {
                self.chunk_at = place.at;
                None
            }),
            op::MESSAGE => {
                self.chunk_at = place.at;
                self.content.clear();
                self.content.extend_from_slice(self.records.content());
                self.message().map(Some)
            }
            op::MESSAGE_INDEX => Ok(None),
            op::DATA_END => {
                self.section = Section::Summary;
                return Ok(None);
            }
            op::FOOTER => {
                // After a footer the reader expects the end.
                self.restart(place.next)?;
                Err(Defect::Opcode { opcode: op::FOOTER })
            }
            op::HEADER if place.at != mcap::MAGIC.len() as u64 => Err(Defect::Opcode { opcode: op::HEADER }),
            op::HEADER | op::METADATA | op::ATTACHMENT => self.lone_record(place.opcode),
            op::SCHEMA | op::CHANNEL => {
                let content = self.records.content().to_vec();
                parse(place.opcode, &content).map(|record| {
                    self.describe(record);
                    None
                })
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

    /// A record outside of chunks that the file's readers parse.
    fn lone_record(&mut self, opcode: u8) -> Result<Option<Found>, Defect> {
        match parse(opcode, self.records.content())? {
            Record::Header(header) => self.library = header.library,
            Record::Metadata(metadata) => return Ok(Some(Found::Metadata(metadata.name, metadata.metadata))),
            Record::Attachment { header, data, .. } => {
                // The data is the record's last field but its checksum.
                let end = self.records.content().len() - 4;
                let data = end - data.len()..end;
                return Ok(Some(Found::Attachment(Attached { header, data })));
            }
            _ => {}
        }
        Ok(None)
    }

    /// Notes a schema or a channel; a later one of the same number holds from there on.
    pub(super) fn describe(&mut self, record: Record<'_>) {
        match record {
            Record::Schema { header, data } => {
                let (id, name, encoding) = (header.id, header.name, header.encoding);
                let data = data.into_owned().into();
                self.schemas.insert(id, Arc::new(mcap::Schema { id, name, encoding, data }));
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).cloned();
                let name = schema.as_ref().map(|schema| schema.name.clone()).unwrap_or_default();
                let id = usize::from(channel.id);
                if self.channels.len() <= id {
                    self.channels.resize_with(id + 1, || None);
                }
                let messages = self.channels[id].as_ref().map_or(0, |before| before.messages);
                self.channels[id] = Some(Channel {
                    topic: Topic::of_channel(&channel.topic, &name, &channel.message_encoding),
                    name: channel.topic.clone(),
                    schema: name,
                    messages,
                    definition: Arc::new(mcap::Channel {
                        id: channel.id,
                        topic: channel.topic,
                        schema,
                        message_encoding: channel.message_encoding,
                        metadata: channel.metadata,
                    }),
                });
            }
            _ => {}
        }
    }

    /// Counts the message whose record stands in `content`, and links it to its topic.
    pub(super) fn message(&mut self) -> Result<Found, Defect> {
        let Record::Message { header, data } = parse(op::MESSAGE, &self.content)? else {
            return Err(Defect::Opcode { opcode: op::MESSAGE });
        };
        let Some(Some(channel)) = self.channels.get_mut(usize::from(header.channel_id)) else {
            return Err(Defect::UnknownChannel { channel: header.channel_id });
        };
        channel.messages += 1;
        let data_at = self.content.len() - data.len();
        Ok(Found::Message(header, data_at))
    }

    /// The end of the file: checksums of data and summary, counts, footer and magic.
    pub(super) fn summary_record(&mut self, place: Place) {
        match (place.opcode, parse(place.opcode, self.records.content())) {
            (op::STATISTICS, Ok(Record::Statistics(statistics))) => {
                self.stated_messages = Some(statistics.message_count);
            }
            (op::FOOTER, footer) => {
                self.section = Section::Magic;
                const FOOTER_BYTES: u64 = RECORD_HEAD_BYTES + 20;
                if footer.is_err() || place.next - place.at != FOOTER_BYTES {
                    let defect = Defect::Malformed { record: "footer", field: "end" };
                    self.completeness.add_damage(place.at, defect);
                }
                let found: u64 = self.channels.iter().flatten().map(|channel| channel.messages).sum();
                if let Some(stated) = self.stated_messages.filter(|&stated| stated != found) {
                    self.completeness.add_damage(place.at, Defect::MessageCount { stated, found });
                }
            }
            // What else is wrong with the summary its checksum tells.
            _ => {}
        }
    }
}
