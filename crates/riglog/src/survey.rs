//! One walk over a log that notes everything but the samples.

use std::{collections::BTreeMap, path::Path};

use prost::Message;

use crate::{
    completeness::Completeness,
    error::LogError,
    metadata::{EncoderMetadata, MetadataMap, RunMetadata},
    parts::{LogParts, PartMetadata},
    proto::{AngleBatch, RigState},
    reader::{bad_message, check_channels, open},
    runs::{RunSpan, spans},
    topic::Topic,
    walk::{Event, Walk},
};

/// Attachments up to this size are kept in memory; a rig's are profiles of some kilobytes.
const KEPT_ATTACHMENT_BYTES: usize = 1 << 20;

/// A channel and how much it carries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelInfo {
    /// The topic.
    pub topic: String,
    /// The message type.
    pub schema: String,
    /// Number of messages.
    pub messages: u64,
}

/// An attached file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttachmentInfo {
    /// Its name.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// Its size.
    pub bytes: u64,
    /// Its content, up to 1 MiB.
    pub data: Option<Vec<u8>>,
}

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

/// Walks over all parts of a log.
pub(crate) fn survey(parts: &LogParts) -> Result<Survey, LogError> {
    let mut states = Vec::new();
    let mut survey = Survey {
        bytes: 0,
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
    let mut continued = false;
    for path in parts.paths() {
        continued = survey.part(path, &mut states)?;
    }
    if let Some(why) = parts.missing(continued) {
        survey.completeness.add(Completeness::Truncated { at_byte: 0, why });
    }
    survey.spans = spans(states, parts.first())?;
    Ok(survey)
}

impl Survey {
    /// Walks over one part; says whether another follows it.
    fn part(&mut self, path: &Path, states: &mut Vec<(u64, RigState)>) -> Result<bool, LogError> {
        let survey = self;
        let (source, bytes) = open(path)?;
        check_channels(Walk::new(source, bytes, path)?)?;
        let mut walk = Walk::new(open(path)?.0, bytes, path)?;
        survey.bytes += bytes;
        let (mut continued, mut first_state, mut carried_over) = (false, true, 0);
        while let Some(event) = walk.next()? {
            match event {
                Event::Message { chunk_at, topic, message, .. } => {
                    let (log, data) = (message.log_time_ns, message.data);
                    let (first, last) = survey.bounds_ns.unwrap_or((log, log));
                    survey.bounds_ns = Some((first.min(log), last.max(log)));
                    match topic {
                        Some(topic @ Topic::State) => {
                            let state = RigState::decode(data)
                                .map_err(|source| bad_message(path, topic, log, chunk_at, source))?;
                            // A program that leaves the time stamp out gives it as the publish time.
                            let at_ns = state.timestamp.as_ref().and_then(|t| t.as_ns());
                            let state = (at_ns.unwrap_or(message.publish_time_ns), state);
                            // A part begins with the state that holds: a repetition of the last one before it.
                            if std::mem::take(&mut first_state) && states.last() == Some(&state) {
                                carried_over += 1;
                            } else {
                                states.push(state);
                            }
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
                        PartMetadata::CONTINUED => continued = true,
                        _ => {}
                    }
                    survey.metadata.insert(name, map);
                }
                Event::Attachment { header, data } => {
                    let (name, media_type) = (header.name, header.media_type);
                    // Every part carries the same files.
                    if survey.attachments.iter().any(|known| known.name == name && known.data.as_deref() == Some(data))
                    {
                        continue;
                    }
                    let bytes = data.len() as u64;
                    let kept = (data.len() <= KEPT_ATTACHMENT_BYTES).then(|| data.to_vec());
                    survey.attachments.push(AttachmentInfo { name, media_type, bytes, data: kept });
                }
            }
        }
        if survey.library.is_empty() {
            survey.library = walk.library().to_owned();
        }
        for channel in walk.channels() {
            let repeated = if channel.topic == Some(Topic::State) { carried_over } else { 0 };
            let messages = channel.messages.saturating_sub(repeated);
            match survey.channels.iter_mut().find(|known| known.topic == channel.name && known.schema == channel.schema)
            {
                Some(known) => known.messages += messages,
                None => survey.channels.push(ChannelInfo {
                    topic: channel.name.clone(),
                    schema: channel.schema.clone(),
                    messages,
                }),
            }
        }
        if let Some(completeness) = walk.completeness() {
            survey.completeness.add(completeness.clone());
        }
        Ok(continued)
    }
}
