//! The writer of a rig log.

use std::{
    fs::{File, OpenOptions},
    io,
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use mcap::{
    Attachment, McapResult,
    records::{MessageHeader, Metadata},
};
use prost::Message;

use super::{
    encoder::{Encoder, io_error},
    options::{LogStatistics, WriterOptions},
    output::Output,
    store::Store,
};
use crate::{
    error::LogError,
    metadata::{EncoderMetadata, MetadataMap, RunMetadata, SEALED, SEALED_KEY},
    parts::PartMetadata,
    proto::{AngleBatch, Backlash, Level, RigState, Timestamp, TransmissionError, foxglove},
    topic::{ENCODING, Topic},
};

/// The largest message, text or file that is accepted: far above any that a rig has, far below what readers refuse.
const MAX_CONTENT_BYTES: usize = 64 << 20;

/// Writes one log.
///
/// Every chunk reaches the operating system in one call and as whole records, so a process killed at any
/// instant leaves a file that is a clean prefix; [`crate::recover()`] finalises it. The file is locked for as long
/// as it is written. A writer that is dropped without [`LogWriter::finish`] hands over what it has and leaves the
/// file without an end, because nobody vouched for it.
pub struct LogWriter {
    options: WriterOptions,
    output: Output,
    encoder: Encoder,
    chunk: Chunk,
    /// The message under way, encoded.
    encoded: Vec<u8>,
    sequences: Sequences,
    samples: u64,
}

/// The number of the next message of each channel.
pub(super) type Sequences = [u32; Topic::ALL.len()];

/// The chunk under way.
struct Chunk {
    messages: u64,
    /// Size of its messages, before compression.
    bytes: usize,
    /// When it got its first message, by the messages' clock and by ours.
    first_log_time_ns: u64,
    since: Instant,
}

impl Chunk {
    fn empty() -> Self {
        Self { messages: 0, bytes: 0, first_log_time_ns: 0, since: Instant::now() }
    }

    fn is_empty(&self) -> bool {
        self.messages == 0
    }

    fn add(&mut self, log_time_ns: u64, data_bytes: usize) {
        /// Opcode, length, channel, sequence and two times.
        const MESSAGE_HEAD_BYTES: usize = 1 + 8 + 2 + 4 + 8 + 8;
        if self.is_empty() {
            (self.first_log_time_ns, self.since) = (log_time_ns, Instant::now());
        }
        self.messages += 1;
        self.bytes += MESSAGE_HEAD_BYTES + data_bytes;
    }
}

impl LogWriter {
    /// Creates the file, locks it, and hands header, schemas and channels to the operating system.
    ///
    /// # Errors
    /// The file exists, or the operating system refuses.
    pub fn create(path: impl AsRef<Path>, options: WriterOptions) -> Result<Self, LogError> {
        let path = path.as_ref();
        // Made before the file is: a process that is killed in between shall not leave an empty one.
        let encoder = encoder(path, &options)?;
        let file = OpenOptions::new().write(true).create_new(true).open(path).map_err(|source| {
            if source.kind() == io::ErrorKind::AlreadyExists {
                LogError::Exists { path: path.to_owned() }
            } else {
                LogError::io("create", path)(source)
            }
        })?;
        // The file is ours by its creation; a recovery that looks into the directory right now lets go at once.
        file.lock().map_err(LogError::io("lock", path))?;
        let for_sync = file.try_clone().map_err(LogError::io("open", path))?;
        let log = Self::on(path, Box::new(file), move || for_sync.sync_data(), options, encoder).inspect_err(|_| {
            // Nothing was written; an empty file would only puzzle the next start.
            let _ = std::fs::remove_file(path);
        })?;
        // After the header, for a kill during the sync must not leave an empty file.
        sync_directory_of(path);
        Ok(log)
    }

    fn on(
        path: &Path,
        store: Box<dyn Store>,
        sync: impl FnMut() -> io::Result<()> + Send + 'static,
        options: WriterOptions,
        mut encoder: Encoder,
    ) -> Result<Self, LogError> {
        let sync_period = Duration::from_millis(options.sync_period_ms.into());
        let mut output = Output::new(path, store, sync, sync_period)?;
        output.hand_over(encoder.take(), 0)?;
        output.request_sync();
        Ok(Self {
            options,
            output,
            encoder,
            chunk: Chunk::empty(),
            encoded: Vec::new(),
            sequences: [0; Topic::ALL.len()],
            samples: 0,
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        self.output.path()
    }

    /// Bytes handed to the operating system so far.
    pub fn bytes(&self) -> u64 {
        self.output.at_byte()
    }

    /// Adds a batch of angles.
    ///
    /// # Errors
    /// A batch that contradicts itself; or the operating system refused a chunk that this message closed.
    pub fn angles(&mut self, log_time_ns: u64, publish_time_ns: u64, batch: &AngleBatch) -> Result<(), LogError> {
        batch.validate()?;
        self.message(Topic::Angles, log_time_ns, publish_time_ns, batch)?;
        self.samples += batch.len() as u64;
        Ok(())
    }

    /// Adds a state of the drives.
    ///
    /// # Errors
    /// The operating system refused a chunk that this message closed.
    pub fn state(&mut self, log_time_ns: u64, publish_time_ns: u64, state: &RigState) -> Result<(), LogError> {
        self.message(Topic::State, log_time_ns, publish_time_ns, state)
    }

    /// Adds a transmission error.
    ///
    /// # Errors
    /// As [`LogWriter::state`].
    pub fn te(&mut self, log_time_ns: u64, publish_time_ns: u64, te: &TransmissionError) -> Result<(), LogError> {
        self.message(Topic::Te, log_time_ns, publish_time_ns, te)
    }

    /// Adds a backlash.
    ///
    /// # Errors
    /// As [`LogWriter::state`].
    pub fn backlash(&mut self, log_time_ns: u64, publish_time_ns: u64, backlash: &Backlash) -> Result<(), LogError> {
        self.message(Topic::Backlash, log_time_ns, publish_time_ns, backlash)
    }

    /// Adds a line of text from the part of the rig or program called `name`.
    ///
    /// # Errors
    /// As [`LogWriter::state`].
    pub fn event(
        &mut self,
        log_time_ns: u64,
        publish_time_ns: u64,
        level: Level,
        name: &str,
        message: &str,
    ) -> Result<(), LogError> {
        let line = foxglove::Log {
            timestamp: Some(Timestamp::from_ns(publish_time_ns)),
            level: level.into(),
            message: message.to_owned(),
            name: name.to_owned(),
            ..Default::default()
        };
        self.message(Topic::Events, log_time_ns, publish_time_ns, &line)
    }

    /// Adds the metadata record `rig.run`.
    ///
    /// # Errors
    /// The operating system refused.
    pub fn run_metadata(&mut self, run: &RunMetadata) -> Result<(), LogError> {
        self.metadata(RunMetadata::NAME, &run.to_map())
    }

    /// Adds the metadata record `rig.encoders`, after homing.
    ///
    /// # Errors
    /// As [`LogWriter::run_metadata`].
    pub fn encoders(&mut self, encoders: &EncoderMetadata) -> Result<(), LogError> {
        self.metadata(EncoderMetadata::NAME, &encoders.to_map())
    }

    /// Adds the metadata record `rig.sealed`: a salted hash of a label that is withheld.
    ///
    /// # Errors
    /// As [`LogWriter::run_metadata`].
    pub fn sealed(&mut self, hash: &str) -> Result<(), LogError> {
        self.metadata(SEALED, &MetadataMap::from([(SEALED_KEY.to_owned(), hash.to_owned())]))
    }

    /// Attaches a file.
    ///
    /// # Errors
    /// The content is larger than 64 MiB, or the operating system refused.
    pub fn attach(&mut self, log_time_ns: u64, name: &str, media_type: &str, data: &[u8]) -> Result<(), LogError> {
        self.check_size("an attachment", name.len() + media_type.len() + data.len())?;
        let attachment = Attachment {
            log_time: log_time_ns,
            create_time: log_time_ns,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: data.into(),
        };
        self.lone_record(|encoder| encoder.attachment(&attachment))
    }

    /// Closes a chunk that is due by wall time and syncs what is due; to be called when idle, a few times in a
    /// chunk period.
    ///
    /// # Errors
    /// The operating system refused a chunk or a sync.
    pub fn tick(&mut self) -> Result<(), LogError> {
        self.output.check_open()?;
        let due = Duration::from_millis(self.options.chunk_period_ms.into());
        if !self.chunk.is_empty() && self.chunk.since.elapsed() >= due {
            self.close_chunk()?;
        }
        self.output.sync_if_due()
    }

    /// Ends the log: last chunk, summary, sync to disk.
    ///
    /// After a failed write this tries once more to write what is left; where that fails again, it ends the log
    /// without, so that what is there stays readable.
    ///
    /// # Errors
    /// Messages were lost, or the end could not be written or synced.
    pub fn finish(mut self) -> Result<LogStatistics, LogError> {
        let unclosed = match self.chunk.is_empty() || self.output.has_failed() {
            true => None,
            false => self.close_chunk().err(),
        };
        // What the disk refused is tried again and told by this; what was not even compressed is told after it.
        self.output.retry()?;
        if let Some(error @ LogError::Compress { .. }) = unclosed {
            return Err(error);
        }
        let (end, summary) = self.encoder.finish().map_err(|error| self.compress_error(error))?;
        self.output.finish(&end)?;
        Ok(LogStatistics {
            path: self.output.path().to_owned(),
            messages: summary.stats.map_or(0, |statistics| statistics.message_count),
            samples: self.samples,
            chunks: summary.chunk_indexes.len() as u64,
            bytes: self.output.at_byte(),
        })
    }

    fn message(
        &mut self,
        topic: Topic,
        log_time_ns: u64,
        publish_time_ns: u64,
        message: &impl Message,
    ) -> Result<(), LogError> {
        self.output.check_open()?;
        self.check_size("a message", message.encoded_len())?;
        let period_ns = u64::from(self.options.chunk_period_ms) * 1_000_000;
        // The message that would make a chunk longer than its period opens the next one.
        if !self.chunk.is_empty() && log_time_ns.saturating_sub(self.chunk.first_log_time_ns) >= period_ns {
            self.close_chunk()?;
        }
        self.encoded.clear();
        message.encode_raw(&mut self.encoded);
        let sequence = &mut self.sequences[topic as usize];
        let (channel_id, log_time, publish_time) = (topic.id(), log_time_ns, publish_time_ns);
        let header = MessageHeader { channel_id, sequence: *sequence, log_time, publish_time };
        *sequence = sequence.wrapping_add(1);
        self.encoder.message(&header, &self.encoded).map_err(|error| self.compress_error(error))?;
        self.chunk.add(log_time_ns, self.encoded.len());
        let due = Duration::from_millis(self.options.chunk_period_ms.into());
        if self.chunk.bytes >= self.options.chunk_bytes || self.chunk.since.elapsed() >= due {
            self.close_chunk()?;
        }
        self.output.sync_if_due()
    }

    /// Adds a metadata record of another name, as `rig.mounting`.
    ///
    /// # Errors
    /// As [`LogWriter::run_metadata`].
    pub fn named_metadata(&mut self, name: &'static str, map: &MetadataMap) -> Result<(), LogError> {
        self.metadata(name, map)
    }

    /// Says which part of a log that is split this is.
    pub(super) fn part(&mut self, part: &PartMetadata) -> Result<(), LogError> {
        self.metadata(PartMetadata::NAME, &part.to_map())
    }

    /// The number of the next message of each channel.
    pub(super) fn sequences(&self) -> Sequences {
        self.sequences
    }

    /// Numbers messages on from where another part ended.
    pub(super) fn go_on_from(&mut self, sequences: Sequences) {
        self.sequences = sequences;
    }

    /// Writes the last state of the part before under its number there.
    pub(super) fn repeat_state(&mut self, log_ns: u64, publish_ns: u64, state: &RigState) -> Result<(), LogError> {
        let number = &mut self.sequences[Topic::State as usize];
        *number = number.wrapping_sub(1);
        self.state(log_ns, publish_ns, state)
    }

    pub(super) fn metadata(&mut self, name: &str, map: &MetadataMap) -> Result<(), LogError> {
        self.check_size("a metadata record", map.iter().map(|(key, value)| key.len() + value.len()).sum())?;
        let metadata = Metadata { name: name.to_owned(), metadata: map.clone() };
        self.lone_record(|encoder| encoder.metadata(&metadata))
    }

    fn check_size(&self, what: &'static str, bytes: usize) -> Result<(), LogError> {
        if bytes <= MAX_CONTENT_BYTES {
            return Ok(());
        }
        Err(LogError::TooLarge { path: self.path().to_owned(), what, bytes, limit: MAX_CONTENT_BYTES as u64 })
    }

    /// Records outside of chunks follow the messages that were given before them.
    fn lone_record(&mut self, add: impl FnOnce(&mut Encoder) -> McapResult<()>) -> Result<(), LogError> {
        self.output.check_open()?;
        if !self.chunk.is_empty() {
            self.close_chunk()?;
        }
        add(&mut self.encoder).map_err(|error| self.compress_error(error))?;
        self.output.hand_over(self.encoder.take(), 0)
    }

    /// Compresses the chunk under way and hands it over with its indexes.
    fn close_chunk(&mut self) -> Result<(), LogError> {
        self.encoder.close_chunk().map_err(|error| self.compress_error(error))?;
        let messages = std::mem::replace(&mut self.chunk, Chunk::empty()).messages;
        self.output.hand_over(self.encoder.take(), messages)
    }

    fn compress_error(&self, error: mcap::McapError) -> LogError {
        LogError::Compress { path: self.path().to_owned(), bytes: self.chunk.bytes, source: io_error(error) }
    }
}

/// The encoder of a log at `path`, with its head.
fn encoder(path: &Path, options: &WriterOptions) -> Result<Encoder, LogError> {
    Encoder::new(&options.library, options.compression_level, channels()).map_err(|error| LogError::Compress {
        path: path.to_owned(),
        bytes: 0,
        source: io_error(error),
    })
}

/// The channels of a rig log, each with a schema of its own number.
fn channels() -> Vec<Arc<mcap::Channel<'static>>> {
    let channel = |topic: Topic| mcap::Channel {
        id: topic.id(),
        topic: topic.name().to_owned(),
        schema: Some(Arc::new(mcap::Schema {
            id: topic.id(),
            name: topic.schema().to_owned(),
            encoding: ENCODING.to_owned(),
            data: topic.descriptors().into(),
        })),
        message_encoding: ENCODING.to_owned(),
        metadata: MetadataMap::new(),
    };
    Topic::ALL.into_iter().map(|topic| Arc::new(channel(topic))).collect()
}

impl Drop for LogWriter {
    fn drop(&mut self) {
        if !self.chunk.is_empty() && !self.output.has_failed() {
            // Nobody is left to tell; the next start finds the file without an end.
            let _ = self.close_chunk();
            self.output.request_sync();
        }
    }
}

/// Makes a new file's name survive a power cut. Where a file system does not sync directories, nothing is lost
/// but that.
pub(crate) fn sync_directory_of(path: &Path) {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    if let Ok(directory) = File::open(parent.unwrap_or(Path::new("."))) {
        let _ = directory.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::{super::store::tests::FullDisk, *};
    use crate::{Completeness, LogReader, Record};

    fn writer(disk: &FullDisk, period_ms: u32) -> LogWriter {
        let options = WriterOptions { chunk_period_ms: period_ms, ..WriterOptions::new("test") };
        let encoder = encoder(Path::new("x.mcap"), &options).unwrap();
        LogWriter::on(Path::new("x.mcap"), Box::new(disk.clone()), || Ok(()), options, encoder).unwrap()
    }

    fn texts(bytes: &[u8]) -> (Vec<String>, Completeness) {
        let mut reader = LogReader::over(Cursor::new(bytes), bytes.len() as u64, "x.mcap").unwrap();
        let texts = reader.by_ref().map(|record| match record.unwrap() {
            Record::Event { event, .. } => event.message,
            other => panic!("{other:?}"),
        });
        let texts = texts.collect();
        (texts, reader.completeness().unwrap().clone())
    }

    const MS: u64 = 1_000_000;

    fn say(log: &mut LogWriter, at_ms: u64, text: &str) -> Result<(), LogError> {
        log.event(at_ms * MS, at_ms * MS, Level::Info, "t", text)
    }

    #[test]
    fn a_chunk_is_closed_by_log_time() {
        let disk = FullDisk::with_room(1 << 20);
        let mut log = writer(&disk, 100);
        let head = disk.bytes().len();
        say(&mut log, 5, "a").unwrap();
        say(&mut log, 104, "b").unwrap();
        assert_eq!(disk.bytes().len(), head, "99 ms are no chunk period");
        say(&mut log, 105, "c").unwrap();
        let (seen, completeness) = texts(&disk.bytes());
        assert_eq!(seen, ["a", "b"]);
        assert!(matches!(completeness, Completeness::Truncated { .. }));
        log.finish().unwrap();
        assert_eq!(texts(&disk.bytes()), (["a", "b", "c"].map(str::to_owned).to_vec(), Completeness::Complete));
    }

    #[test]
    fn an_idle_writer_closes_its_chunk_by_wall_time() {
        let disk = FullDisk::with_room(1 << 20);
        let mut log = writer(&disk, 5);
        say(&mut log, 0, "a").unwrap();
        log.tick().unwrap();
        std::thread::sleep(Duration::from_millis(6));
        log.tick().unwrap();
        assert_eq!(texts(&disk.bytes()).0, ["a"]);
    }

    #[test]
    fn a_chunk_is_closed_by_size() {
        let disk = FullDisk::with_room(1 << 20);
        let mut log = writer(&disk, 1_000_000);
        log.options.chunk_bytes = 400;
        let long = "x".repeat(200);
        say(&mut log, 0, &long).unwrap();
        assert!(texts(&disk.bytes()).0.is_empty());
        say(&mut log, 0, &long).unwrap();
        assert_eq!(texts(&disk.bytes()).0.len(), 2);
    }

    #[test]
    fn a_full_disk_is_told_once_and_the_log_stays_readable_and_may_still_be_saved() {
        for freed in [false, true] {
            let disk = FullDisk::with_room(1 << 20);
            let mut log = writer(&disk, 100);
            say(&mut log, 0, "a").unwrap();
            say(&mut log, 100, "b").unwrap();
            let before = disk.bytes().len();
            *disk.room.lock().unwrap() = before + 20;
            let error = say(&mut log, 200, "c").unwrap_err();
            assert!(matches!(&error, LogError::Write { at_byte, .. } if *at_byte == before as u64), "{error}");
            assert_eq!(disk.bytes().len(), before, "no half chunk");
            assert!(matches!(say(&mut log, 201, "d"), Err(LogError::Stopped { .. })));
            assert!(matches!(log.tick(), Err(LogError::Stopped { .. })));
            if freed {
                *disk.room.lock().unwrap() = 1 << 20;
                log.finish().unwrap();
                assert_eq!(texts(&disk.bytes()), (["a", "b"].map(str::to_owned).to_vec(), Completeness::Complete));
            } else {
                let error = log.finish().unwrap_err();
                assert!(matches!(error, LogError::Incomplete { lost_messages: 1, .. }), "{error}");
                let (seen, completeness) = texts(&disk.bytes());
                assert_eq!(seen, ["a"]);
                assert!(matches!(completeness, Completeness::Truncated { .. }));
            }
        }
    }

    #[test]
    fn what_was_handed_over_is_synced_within_the_period_and_at_the_end() {
        use std::sync::Mutex;
        let disk = FullDisk::with_room(1 << 20);
        // (when, bytes on the disk by then) of every sync.
        let synced = Arc::new(Mutex::new(Vec::new()));
        let (content, log_of_syncs) = (disk.content.clone(), synced.clone());
        let sync = move || {
            let bytes = content.lock().unwrap().len();
            log_of_syncs.lock().unwrap().push((Instant::now(), bytes));
            Ok(())
        };
        let options = WriterOptions { chunk_period_ms: 5, sync_period_ms: 50, ..WriterOptions::new("test") };
        let encoder = encoder(Path::new("x.mcap"), &options).unwrap();
        let mut log = LogWriter::on(Path::new("x.mcap"), Box::new(disk.clone()), sync, options, encoder).unwrap();
        let began = Instant::now();
        let mut n = 0;
        while began.elapsed() < Duration::from_millis(500) {
            say(&mut log, n * 10, "message").unwrap();
            log.tick().unwrap();
            n += 1;
            std::thread::sleep(Duration::from_millis(2));
        }
        let syncs = synced.lock().unwrap().clone();
        // Every 50 ms, at most doubled by a machine that is busy, and each takes what was there.
        let longest = syncs.windows(2).map(|pair| pair[1].0 - pair[0].0).max().unwrap();
        assert!(syncs.len() >= 4 && longest < Duration::from_millis(250), "{} syncs, {longest:?} apart", syncs.len());
        assert!(syncs.windows(2).all(|pair| pair[1].1 > pair[0].1));
        log.finish().unwrap();
        assert_eq!(synced.lock().unwrap().last().unwrap().1, disk.bytes().len(), "the end is on the disk too");
    }

    #[test]
    fn what_is_too_large_for_any_reader_is_refused() {
        let disk = FullDisk::with_room(1 << 20);
        let mut log = writer(&disk, 100);
        let error = log.attach(0, "big", "", &vec![0; MAX_CONTENT_BYTES]).unwrap_err();
        assert!(error.to_string().contains("67108867 bytes"), "{error}");
        log.finish().unwrap();
    }
}
