//! The beginning of a file: magic, header, schemas and channels, outside of any chunk, so that they
//! are in the file before the first message is.

use std::collections::BTreeMap;

use crate::{
    container::{MAGIC, bytes::Put, op, summary::Summary},
    topic::{ENCODING, Topic},
};

/// The head of a rig log written by `library`; schemas and channels are noted in `summary`.
pub(crate) fn encode_head(library: &str, summary: &mut Summary) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    out.put_record(op::HEADER, |out| {
        // The rig log is no profile of other people's.
        out.put_str("");
        out.put_str(library);
    });
    for topic in Topic::ALL {
        let mut schema = Vec::new();
        schema.put_u16(topic.id());
        schema.put_str(topic.schema());
        schema.put_str(ENCODING);
        schema.put_u32(topic.descriptors().len() as u32);
        schema.extend_from_slice(topic.descriptors());
        out.put_record(op::SCHEMA, |out| out.extend_from_slice(&schema));
        summary.schemas.insert(topic.id(), schema);
        let mut channel = Vec::new();
        channel.put_u16(topic.id());
        channel.put_u16(topic.id());
        channel.put_str(topic.name());
        channel.put_str(ENCODING);
        channel.put_map(&BTreeMap::new());
        out.put_record(op::CHANNEL, |out| out.extend_from_slice(&channel));
        summary.channels.insert(topic.id(), channel);
    }
    out
}
