//! Streams the runs of a log as shaft angles, block by block: what replay stands on.

mod streaming;

use std::{fs::File, io::BufReader, ops::ControlFlow, path::Path};

use prost::Message;

use self::streaming::Streaming;
use crate::{
    completeness::Completeness,
    error::LogError,
    metadata::{EncoderMetadata, RunMetadata},
    parts::LogParts,
    proto::AngleBatch,
    reader::{bad_message, open},
    run_visitor::{RunVisitor, SampleBlock, StreamTotals},
    runs::RunSpan,
    survey::{Survey, survey},
    topic::Topic,
    walk::{Event, Walk},
};

/// A log whose runs are known and can be streamed, as often as wanted.
#[derive(Debug, Clone)]
pub struct RunStream {
    parts: LogParts,
    survey: Survey,
}

impl RunStream {
    /// Walks over the log once to learn its runs, wherever their states stand among the samples. A part of a log that was split
    /// brings the others beside it along.
    ///
    /// # Errors
    /// The file is no rig log, or a state or an encoder record in it makes no sense.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        Self::open_parts(LogParts::of(path)?)
    }

    /// As [`RunStream::open`], of files that are known to belong together.
    ///
    /// # Errors
    /// As [`RunStream::open`].
    pub fn open_parts(parts: LogParts) -> Result<Self, LogError> {
        let survey = survey(&parts)?;
        Ok(Self { parts, survey })
    }

    /// The files of the log.
    pub fn parts(&self) -> &LogParts {
        &self.parts
    }

    /// The runs, in order of time.
    pub fn runs(&self) -> &[RunSpan] {
        &self.survey.spans
    }

    /// What was run, as far as the log says.
    pub fn metadata(&self) -> Option<&RunMetadata> {
        self.survey.run.as_ref()
    }

    /// The encoders as first homed.
    pub fn encoders(&self) -> Option<&EncoderMetadata> {
        self.survey.encoders.as_ref()
    }

    /// Device time of the first sample in the file.
    pub fn start_ns(&self) -> Option<u64> {
        self.survey.first_sample_ns
    }

    /// Whether the log is whole.
    pub fn completeness(&self) -> &Completeness {
        &self.survey.completeness
    }

    /// The content of an attachment, as `pair.toml`; the last one of that name. `None` also above 1 MiB.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.survey.attachments.iter().rev().find(|a| a.name == name)?.data.as_deref()
    }

    pub(crate) fn survey(&self) -> &Survey {
        &self.survey
    }

    /// Streams every run to `visitor`.
    ///
    /// # Errors
    /// The log holds runs but no encoders, or a batch does not decode or jumps back in time.
    pub fn stream(&self, visitor: &mut impl RunVisitor) -> Result<StreamTotals, LogError> {
        match self.survey.encoders {
            Some(encoders) => self.drive(&encoders, visitor),
            None if self.survey.spans.is_empty() => self.drive(&NO_ENCODERS, visitor),
            None => Err(LogError::NoEncoders { path: self.parts.first().to_owned() }),
        }
    }

    /// Counts samples and losses; without encoders, revolutions mean nothing.
    pub(crate) fn count(&self) -> Result<StreamTotals, LogError> {
        struct Nobody;
        impl RunVisitor for Nobody {
            fn samples(&mut self, _: usize, _: &SampleBlock<'_>) -> ControlFlow<()> {
                ControlFlow::Continue(())
            }
        }
        self.drive(&self.survey.encoders.unwrap_or(NO_ENCODERS), &mut Nobody)
    }

    fn drive(&self, encoders: &EncoderMetadata, visitor: &mut impl RunVisitor) -> Result<StreamTotals, LogError> {
        let mut state = Streaming::new(&self.survey.spans, encoders, visitor);
        let mut batch = AngleBatch::default();
        let mut completeness = Completeness::Complete;
        for path in self.parts.paths() {
            let (source, bytes) = open(path)?;
            let mut walk = Walk::new(source, bytes, path)?;
            if self.drive_part(&mut walk, path, &mut state, &mut batch)?.is_break() {
                return Ok(state.finish(self.survey.completeness.clone()));
            }
            completeness.add(walk.completeness().cloned().unwrap_or(Completeness::Complete));
        }
        let _ = state.end_run();
        // A log that is still being written may have grown; what it lacks besides, the survey knows.
        if completeness.is_complete() {
            completeness = self.survey.completeness.clone();
        }
        Ok(state.finish(completeness))
    }

    fn drive_part(
        &self,
        walk: &mut Walk<BufReader<File>>,
        path: &Path,
        state: &mut Streaming<'_, impl RunVisitor>,
        batch: &mut AngleBatch,
    ) -> Result<ControlFlow<()>, LogError> {
        loop {
            match walk.next()? {
                None => return Ok(ControlFlow::Continue(())),
                Some(Event::Message { chunk_at, topic: Some(topic @ Topic::Angles), message, .. }) => {
                    // Cleared, the vectors keep their memory from batch to batch.
                    batch.clear();
                    batch
                        .merge(message.data)
                        .map_err(|source| bad_message(path, topic, message.log_time_ns, chunk_at, source))?;
                    batch.validate()?;
                    state.check_time(batch, path)?;
                    if state.batch(batch).is_break() {
                        return Ok(ControlFlow::Break(()));
                    }
                }
                Some(Event::Metadata { name, map }) if name == EncoderMetadata::NAME => {
                    state.use_encoders(&EncoderMetadata::from_map(&map)?);
                }
                Some(_) => {}
            }
        }
    }
}

/// Counts taken for angles: for logs whose runs nobody asks the angles of.
const NO_ENCODERS: EncoderMetadata = EncoderMetadata {
    input_counts_per_rev: 1,
    output_counts_per_rev: 1,
    input_lines: 1,
    output_lines: 1,
    input_index_counts: 0,
    output_index_counts: 0,
    input_sign: 1,
    output_sign: 1,
};
