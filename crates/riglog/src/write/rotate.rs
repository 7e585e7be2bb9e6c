//! A log that goes on in a new file when one has grown large or old, without losing a sample.
//!
//! Messages are written one after the other: whichever crosses the limit is the last of its part, the next one the first of the next. Sample
//! numbers and the channels' sequence numbers go on, so that a reader can prove that nothing is missing in between. The finished part
//! gets its end on a thread of its own, for a slow disk must not hold up the chunks of the next part.

use std::{
    path::{Path, PathBuf},
    thread::JoinHandle,
    time::Duration,
};

use super::{
    options::{LogStatistics, WriterOptions},
    writer::LogWriter,
};
use crate::{
    error::LogError,
    metadata::{EncoderMetadata, MetadataMap, RunMetadata},
    parts::{PartMetadata, part_path},
    proto::{AngleBatch, Backlash, Level, RigState, TransmissionError},
};

/// When a log goes on in a new file. The default is never.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rotation {
    /// A part is ended at this size; what it repeats at its beginning does not count, or a long head would leave no room for samples.
    pub bytes: Option<u64>,
    /// A part is ended when its messages span this much log time.
    pub period: Option<Duration>,
}

impl Rotation {
    /// Whether a log is ever split.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.bytes.is_some() || self.period.is_some()
    }
}

/// Writes one log in as many files as its [`Rotation`] makes of it.
pub struct RotatingWriter {
    first: PathBuf,
    log_id: String,
    options: WriterOptions,
    rotation: Rotation,
    writer: LogWriter,
    part: u32,
    /// Log time of the part's first message, and the bytes before it.
    opened: Option<(u64, u64)>,
    /// The part before, on its way to its end.
    ending: Option<JoinHandle<Result<LogStatistics, LogError>>>,
    finished: Vec<LogStatistics>,
    head: Head,
    next_sample: u64,
}

/// What every part says at its beginning.
#[derive(Default)]
struct Head {
    run: Option<RunMetadata>,
    encoders: Option<EncoderMetadata>,
    named: Vec<(String, MetadataMap)>,
    attachments: Vec<(u64, String, String, Vec<u8>)>,
    state: Option<(u64, u64, RigState)>,
}

impl RotatingWriter {
    /// Creates the first part; `log_id` tells the parts of this log from those of any other.
    ///
    /// # Errors
    /// As [`LogWriter::create`].
    pub fn create(
        path: impl AsRef<Path>,
        options: WriterOptions,
        rotation: Rotation,
        log_id: &str,
    ) -> Result<Self, LogError> {
        let first = path.as_ref().to_owned();
        let mut writer = LogWriter::create(&first, options.clone())?;
        if rotation.is_on() {
            writer.part(&PartMetadata { log_id: log_id.to_owned(), part: 1, first_sample: 0 })?;
        }
        Ok(Self {
            first,
            log_id: log_id.to_owned(),
            options,
            rotation,
            writer,
            part: 1,
            opened: None,
            ending: None,
            finished: Vec::new(),
            head: Head::default(),
            next_sample: 0,
        })
    }

    /// The first file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.first
    }

    /// Every file so far, in order.
    #[must_use]
    pub fn paths(&self) -> Vec<PathBuf> {
        (1..=self.part).map(|part| part_path(&self.first, part)).collect()
    }

    /// As [`LogWriter::angles`].
    ///
    /// # Errors
    /// As [`LogWriter::angles`], and where the next part cannot be made.
    pub fn angles(&mut self, log_time_ns: u64, publish_time_ns: u64, batch: &AngleBatch) -> Result<(), LogError> {
        self.writer.angles(log_time_ns, publish_time_ns, batch)?;
        self.next_sample = batch.first_sample.saturating_add(batch.len() as u64);
        self.rotate_if_due(log_time_ns)
    }

    /// As [`LogWriter::state`].
    ///
    /// # Errors
    /// As [`RotatingWriter::angles`].
    pub fn state(&mut self, log_time_ns: u64, publish_time_ns: u64, state: &RigState) -> Result<(), LogError> {
        self.writer.state(log_time_ns, publish_time_ns, state)?;
        self.head.state = Some((log_time_ns, publish_time_ns, *state));
        self.rotate_if_due(log_time_ns)
    }

    /// As [`LogWriter::te`].
    ///
    /// # Errors
    /// As [`RotatingWriter::angles`].
    pub fn te(&mut self, log_time_ns: u64, publish_time_ns: u64, te: &TransmissionError) -> Result<(), LogError> {
        self.writer.te(log_time_ns, publish_time_ns, te)?;
        self.rotate_if_due(log_time_ns)
    }

    /// As [`LogWriter::backlash`].
    ///
    /// # Errors
    /// As [`RotatingWriter::angles`].
    pub fn backlash(&mut self, log_time_ns: u64, publish_time_ns: u64, backlash: &Backlash) -> Result<(), LogError> {
        self.writer.backlash(log_time_ns, publish_time_ns, backlash)?;
        self.rotate_if_due(log_time_ns)
    }

    /// As [`LogWriter::event`].
    ///
    /// # Errors
    /// As [`RotatingWriter::angles`].
    pub fn event(
        &mut self,
        log_time_ns: u64,
        publish_time_ns: u64,
        level: Level,
        name: &str,
        message: &str,
    ) -> Result<(), LogError> {
        self.writer.event(log_time_ns, publish_time_ns, level, name, message)?;
        self.rotate_if_due(log_time_ns)
    }

    /// As [`LogWriter::run_metadata`]; every part repeats it.
    ///
    /// # Errors
    /// The operating system refused.
    pub fn run_metadata(&mut self, run: &RunMetadata) -> Result<(), LogError> {
        self.writer.run_metadata(run)?;
        self.head.run = Some(run.clone());
        Ok(())
    }

    /// As [`LogWriter::encoders`]; every later part repeats it.
    ///
    /// # Errors
    /// The operating system refused.
    pub fn encoders(&mut self, encoders: &EncoderMetadata) -> Result<(), LogError> {
        self.writer.encoders(encoders)?;
        self.head.encoders = Some(*encoders);
        Ok(())
    }

    /// As [`LogWriter::named_metadata`]; every later part repeats it.
    ///
    /// # Errors
    /// The operating system refused.
    pub fn named_metadata(&mut self, name: &'static str, map: &MetadataMap) -> Result<(), LogError> {
        self.writer.named_metadata(name, map)?;
        self.head.named.push((name.to_owned(), map.clone()));
        Ok(())
    }

    /// As [`LogWriter::attach`]; every later part repeats it.
    ///
    /// # Errors
    /// As [`LogWriter::attach`].
    pub fn attach(&mut self, log_time_ns: u64, name: &str, media_type: &str, data: &[u8]) -> Result<(), LogError> {
        self.writer.attach(log_time_ns, name, media_type, data)?;
        if self.rotation.is_on() {
            self.head.attachments.push((log_time_ns, name.to_owned(), media_type.to_owned(), data.to_owned()));
        }
        Ok(())
    }

    /// As [`LogWriter::tick`]; also tells what went wrong while the part before was ended.
    ///
    /// # Errors
    /// As [`LogWriter::tick`].
    pub fn tick(&mut self) -> Result<(), LogError> {
        if self.ending.as_ref().is_some_and(JoinHandle::is_finished) {
            self.join()?;
        }
        self.writer.tick()
    }

    /// Ends the log. The statistics are those of all parts together, under the first one's name.
    ///
    /// # Errors
    /// As [`LogWriter::finish`], of any part.
    pub fn finish(mut self) -> Result<LogStatistics, LogError> {
        let before = self.join();
        self.finished.push(self.writer.finish()?);
        before?;
        let sum = |of: fn(&LogStatistics) -> u64| self.finished.iter().map(of).sum();
        Ok(LogStatistics {
            path: self.first,
            messages: sum(|part| part.messages),
            samples: sum(|part| part.samples),
            chunks: sum(|part| part.chunks),
            bytes: sum(|part| part.bytes),
        })
    }

    fn join(&mut self) -> Result<(), LogError> {
        match self.ending.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(ended)) => {
                self.finished.push(ended?);
                Ok(())
            }
            Some(Err(panic)) => std::panic::resume_unwind(panic),
        }
    }

    fn rotate_if_due(&mut self, log_time_ns: u64) -> Result<(), LogError> {
        let written = self.writer.bytes();
        let (opened_ns, head_bytes) = *self.opened.get_or_insert((log_time_ns, written));
        let large = self.rotation.bytes.is_some_and(|bytes| written - head_bytes >= bytes);
        let age = Duration::from_nanos(log_time_ns.saturating_sub(opened_ns));
        let old = self.rotation.period.is_some_and(|period| age >= period);
        if large || old { self.rotate() } else { Ok(()) }
    }

    /// Goes on in the next file. Where that cannot be made, the part under way stays the last, and complete.
    fn rotate(&mut self) -> Result<(), LogError> {
        // One part at a time: a disk that takes longer to end a part than to fill one is told of here, by waiting.
        self.join()?;
        let part = self.part + 1;
        let path = part_path(&self.first, part);
        let mut next = LogWriter::create(&path, self.options.clone())?;
        next.part(&PartMetadata { log_id: self.log_id.clone(), part, first_sample: self.next_sample })?;
        self.head.write(&mut next, self.writer.sequences())?;
        let mut done = std::mem::replace(&mut self.writer, next);
        (self.part, self.opened) = (part, None);
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let end = move || {
            done.named_metadata(PartMetadata::CONTINUED, &MetadataMap::from([("next".to_owned(), name)]))?;
            done.finish()
        };
        let ending = std::thread::Builder::new().name("log-end".into()).spawn(end);
        self.ending = Some(ending.map_err(LogError::io("start a thread to end", &self.first))?);
        Ok(())
    }
}

impl Head {
    /// Repeats at the beginning of a part what was said before it.
    fn write(&self, part: &mut LogWriter, sequences: super::writer::Sequences) -> Result<(), LogError> {
        if let Some(run) = &self.run {
            part.run_metadata(run)?;
        }
        for (log_time_ns, name, media_type, data) in &self.attachments {
            part.attach(*log_time_ns, name, media_type, data)?;
        }
        for (name, map) in &self.named {
            part.metadata(name, map)?;
        }
        if let Some(encoders) = &self.encoders {
            part.encoders(encoders)?;
        }
        part.go_on_from(sequences);
        if let Some((log_time_ns, publish_time_ns, state)) = &self.state {
            // The part can be understood alone. The repetition has the number of what it repeats.
            part.repeat_state(*log_time_ns, *publish_time_ns, state)?;
        }
        Ok(())
    }
}
