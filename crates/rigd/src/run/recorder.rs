//! The recorder: a thread of its own owns the log, so that compressing and syncing never hold up the encoders.
//!
//! Its queue is long and, when full, makes the sender wait: nothing is dropped here. A write error is kept for the sequencer,
//! which stops the rig; what comes after it is counted, not hidden.

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use riglog::proto::Level;
use riglog::proto::{AngleBatch, Backlash, RigState, TransmissionError};
use riglog::{EncoderMetadata, LogError, LogStatistics, MetadataMap, RotatingWriter, RunMetadata, WriterOptions};

use super::space::{Space, SpaceWatch};
use crate::profile::LogPolicy;

/// Parcels that may wait for the recorder: half a minute and more at a parcel every [`PARCEL_AGE`].
const QUEUE: usize = 4096;

/// Entries travel in parcels, for waking a thread costs more than most entries; a parcel leaves at this age or size.
const PARCEL_AGE: Duration = Duration::from_millis(8);
const PARCEL: usize = 64;

/// One entry of the log.
#[derive(Debug)]
pub enum Entry {
    /// `/rig/angles`.
    Angles(AngleBatch),
    /// `/rig/state`.
    State(RigState),
    /// `/rig/te`.
    Te(TransmissionError),
    /// `/rig/backlash`.
    Backlash(Backlash),
    /// `/rig/events`.
    Event(Level, &'static str, String),
    /// Metadata `rig.run`.
    Run(Box<RunMetadata>),
    /// Metadata `rig.encoders`.
    Encoders(EncoderMetadata),
    /// Metadata of another name.
    Metadata(&'static str, MetadataMap),
    /// An attachment: name, media type, content.
    Attachment(&'static str, &'static str, Vec<u8>),
}

struct Stamped {
    log_time_ns: u64,
    publish_time_ns: u64,
    entry: Entry,
}

/// What the recorder's thread shares.
#[derive(Default)]
struct Shared {
    failure: Mutex<Option<LogError>>,
    unwritten: AtomicU64,
}

/// Handle of the recorder.
pub struct Recorder {
    path: PathBuf,
    queue: Option<SyncSender<Vec<Stamped>>>,
    parcel: RefCell<Vec<Stamped>>,
    sent: Cell<Instant>,
    thread: Option<JoinHandle<Result<LogStatistics, LogError>>>,
    shared: Arc<Shared>,
}

impl Recorder {
    /// Makes the log and starts the thread.
    ///
    /// # Errors
    /// [`LogError`] when the file cannot be made.
    pub fn create(path: &Path, options: WriterOptions, policy: &LogPolicy) -> Result<Self, LogError> {
        let mut watch = SpaceWatch::new(path, policy);
        let first_look = watch.look();
        if let Space::Short(error) = first_look {
            return Err(error);
        }
        let writer = RotatingWriter::create(path, options, policy.rotation(), &uuid::Uuid::new_v4().to_string())?;
        let (queue, parcels) = sync_channel(QUEUE);
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || record(writer, &parcels, &theirs, watch, first_look))
            .map_err(|source| LogError::Io { path: path.into(), action: "start the recorder's thread for", source })?;
        Ok(Self {
            path: path.into(),
            queue: Some(queue),
            parcel: RefCell::default(),
            sent: Cell::new(Instant::now()),
            thread: Some(thread),
            shared,
        })
    }

    /// Where the log is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Hands an entry to the recorder; waits when its queue is full.
    pub fn write(&self, log_time_ns: u64, publish_time_ns: u64, entry: Entry) {
        self.parcel.borrow_mut().push(Stamped { log_time_ns, publish_time_ns, entry });
        if self.parcel.borrow().len() >= PARCEL || self.sent.get().elapsed() >= PARCEL_AGE {
            self.send();
        }
    }

    fn send(&self) {
        let parcel = self.parcel.replace(Vec::with_capacity(PARCEL));
        let entries = parcel.len() as u64;
        let sent = self.queue.as_ref().map(|queue| queue.send(parcel));
        if !matches!(sent, Some(Ok(()))) {
            self.shared.unwritten.fetch_add(entries, Ordering::Relaxed);
        }
        self.sent.set(Instant::now());
    }

    /// The write error, once.
    #[must_use]
    pub fn take_failure(&self) -> Option<LogError> {
        self.shared.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Entries that could not be written after a failure.
    #[must_use]
    pub fn unwritten(&self) -> u64 {
        self.shared.unwritten.load(Ordering::Relaxed)
    }

    /// Writes what is queued, then the end of the log.
    ///
    /// # Errors
    /// [`LogError`] when the end could not be written; the log is then readable up to its last whole chunk.
    pub fn finish(mut self) -> Result<LogStatistics, LogError> {
        self.send();
        self.queue = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(outcome)) => outcome,
            // The thread's panic goes on in ours: the message was printed where it arose.
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            None => unreachable!("finish consumes the recorder"),
        }
    }
}

fn record(
    mut writer: RotatingWriter,
    parcels: &Receiver<Vec<Stamped>>,
    shared: &Shared,
    mut watch: SpaceWatch,
    first_look: Space,
) -> Result<LogStatistics, LogError> {
    let report = |error| *shared.failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
    let mut failed = false;
    let mut found = first_look;
    let mut last_ns = 0;
    loop {
        let outcome = match parcels.recv_timeout(Duration::from_millis(50)) {
            Ok(parcel) if failed => {
                shared.unwritten.fetch_add(parcel.len() as u64, Ordering::Relaxed);
                continue;
            }
            Ok(parcel) => {
                let mut left = parcel.len() as u64;
                last_ns = parcel.last().map_or(last_ns, |stamped| stamped.log_time_ns);
                let outcome = parcel.into_iter().try_for_each(|stamped| {
                    write(&mut writer, stamped)?;
                    left -= 1;
                    Ok(())
                });
                shared.unwritten.fetch_add(left, Ordering::Relaxed);
                outcome
            }
            Err(RecvTimeoutError::Timeout) if failed => continue,
            Err(RecvTimeoutError::Timeout) => writer.tick(),
            Err(RecvTimeoutError::Disconnected) => return writer.finish(),
        };
        if let Err(error) = outcome {
            failed = true;
            report(error);
            continue;
        }
        // The log's own messages date what the disk says; before the first one there is no time to give it.
        match std::mem::replace(&mut found, Space::Enough) {
            Space::Enough => found = watch.look(),
            unsaid if last_ns == 0 => found = unsaid,
            Space::Low { warning } => {
                tracing::warn!("{warning}");
                // Refused, it is told with the next message.
                let _ = writer.event(last_ns, last_ns, Level::Warning, "disk", &warning);
            }
            Space::Short(error) => {
                let _ = writer.event(last_ns, last_ns, Level::Error, "disk", &error.to_string());
                // The sequencer stops the rig; until then everything is written as before.
                report(error);
            }
        }
    }
}

fn write(writer: &mut RotatingWriter, stamped: Stamped) -> Result<(), LogError> {
    let Stamped { log_time_ns, publish_time_ns, entry } = stamped;
    match entry {
        Entry::Angles(batch) => writer.angles(log_time_ns, publish_time_ns, &batch),
        Entry::State(state) => writer.state(log_time_ns, publish_time_ns, &state),
        Entry::Te(te) => writer.te(log_time_ns, publish_time_ns, &te),
        Entry::Backlash(backlash) => writer.backlash(log_time_ns, publish_time_ns, &backlash),
        Entry::Event(level, name, message) => writer.event(log_time_ns, publish_time_ns, level, name, &message),
        Entry::Run(run) => writer.run_metadata(&run),
        Entry::Encoders(encoders) => writer.encoders(&encoders),
        Entry::Metadata(name, map) => writer.named_metadata(name, &map),
        Entry::Attachment(name, media_type, data) => writer.attach(log_time_ns, name, media_type, &data),
    }
}
