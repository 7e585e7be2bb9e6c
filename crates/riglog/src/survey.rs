//! One walk over a log that notes everything but the samples.

use std::{collections::BTreeMap, path::Path};

use prost::Message;

use crate::{
    completeness::Completeness,
    error::LogError,
    info::{AttachmentInfo, ChannelInfo},
    metadata::{EncoderMetadata, MetadataMap, RunMetadata},
    proto::{AngleBatch, RigState},
    reader::{bad_message, check_channels, open},
    runs::{RunSpan, spans},
    topic::Topic,
    walk::{Event, Walk},
};

/// Attachments up to this size are kept in memory; a rig's are profiles of some kilobytes.
const KEPT_ATTACHMENT_BYTES: usize = 1 << 20;

/// What a log says about itself.
#[derive(Debug, Clone)]
pub(crate) struct Survey {
    pub(crate) bytes: u64,
    pub(crate) library: String,
    pub(crate) metadata: BTreeMap<String, MetadataMap>,
    pub(crate) run: Option<RunMetadata>,
    pub(crate) encoders: Option<EncoderMetadata>,
    pub(crate) attachments: Vec<AttachmentInfo>,
    pub(crate) channels: Vec<ChannelInfo>,
    pub(crate) spans: Vec<RunSpan>,
    /// Device time of the first sample.
    pub(crate) first_sample_ns: Option<u64>,
    /// Earliest and latest log time.
    pub(crate) bounds_ns: Option<(u64, u64)>,
    pub(crate) completeness: Completeness,
}

pub(crate) fn survey(path: &Path) -> Result<Survey, LogError> {
    let (source, bytes) = open(path)?;
    check_channels(Walk::new(source, bytes, path)?)?;
    let mut walk = Walk::new(open(path)?.0, bytes, path)?;
    let mut states = Vec::new();
    let mut survey = Survey {
        bytes,
        library: String::new(),
        metadata: BTreeMap::new(),
        run: None,
        encoders: None,
        attachments: Vec::new(),
        channels: Vec::new(),
        spans: Vec::new(),
        first_sample_ns: None,
        bounds_ns: None,
        completeness: Completeness::Complete,
    };
    while let Some(event) = walk.next()? {
        match event {
            Event::Message { chunk_at, topic, message, .. } => {
                let (log, data) = (message.log_time_ns, message.data);
                let (first, last) = survey.bounds_ns.unwrap_or((log, log));
                survey.bounds_ns = Some((first.min(log), last.max(log)));
                match topic {
                    Some(topic @ Topic::State) => {
                        let state =
                            RigState::decode(data).map_err(|source| bad_message(path, topic, log, chunk_at, source))?;
                        // A program that leaves the time stamp out gives it as the publish time.
                        let at_ns = state.timestamp.as_ref().and_then(|t| t.as_ns());
                        states.push((at_ns.unwrap_or(message.publish_time_ns), state));
                    }
                    Some(topic @ Topic::Angles) if survey.first_sample_ns.is_none() => {
                        let batch = AngleBatch::decode(data)
                            .map_err(|source| bad_message(path, topic, log, chunk_at, source))?;
                        survey.first_sample_ns = (!batch.is_empty()).then_some(batch.t0_ns);
                    }
                    _ => {}
                }
            }
            Event::Metadata { name, map } => {
                match name.as_str() {
                    RunMetadata::NAME => survey.run = Some(RunMetadata::from_map(&map)),
                    // The first homing holds until a later record says otherwise.
                    EncoderMetadata::NAME if survey.encoders.is_none() => {
                        survey.encoders = Some(EncoderMetadata::from_map(&map)?);
                    }
                    _ => {}
                }
                survey.metadata.insert(name, map);
            }
            Event::Attachment { header, data } => {
                let (name, media_type) = (header.name, header.media_type);
                let bytes = data.len() as u64;
                let kept = (data.len() <= KEPT_ATTACHMENT_BYTES).then(|| data.to_vec());
                survey.attachments.push(AttachmentInfo { name, media_type, bytes, data: kept });
            }
        }
    }
    survey.library = walk.library().to_owned();
    survey.channels = walk
        .channels()
        .map(|channel| ChannelInfo {
            topic: channel.name.clone(),
            schema: channel.schema.clone(),
            messages: channel.messages,
        })
        .collect();
    if let Some(completeness) = walk.completeness() {
        survey.completeness = completeness.clone();
    }
    survey.spans = spans(states, path)?;
    Ok(survey)
}
