//! What the writer has handed to the operating system, and what it does when that takes no more.

use std::{
    io,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use super::{
    store::{Store, Tail},
    sync::Syncer,
};
use crate::error::LogError;

/// A file that grows by whole records.
pub(super) struct Output {
    path: PathBuf,
    tail: Tail,
    syncer: Syncer,
    sync_period: Duration,
    synced_at: Instant,
    dirty: bool,
    failure: Option<Failure>,
}

/// What a failed write did not write, kept for another try at the end.
struct Failure {
    records: Vec<u8>,
    messages: u64,
}

impl Output {
    /// An empty file; `sync` brings to the disk what was written, on a thread of its own.
    pub(super) fn new(
        path: &Path,
        store: Box<dyn Store>,
        sync: impl FnMut() -> io::Result<()> + Send + 'static,
        sync_period: Duration,
    ) -> Result<Self, LogError> {
        Ok(Self {
            path: path.to_owned(),
            tail: Tail::new(store),
            syncer: Syncer::new(sync).map_err(LogError::io("start a thread to sync", path))?,
            sync_period,
            synced_at: Instant::now(),
            dirty: false,
            failure: None,
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Where the next record will stand.
    pub(super) fn at_byte(&self) -> u64 {
        self.tail.at_byte()
    }

    pub(super) fn has_failed(&self) -> bool {
        self.failure.is_some()
    }

    /// Refuses everything after a failed write, so that nothing stands behind a hole.
    pub(super) fn check_open(&self) -> Result<(), LogError> {
        match self.failure {
            None => Ok(()),
            Some(_) => Err(LogError::Stopped { path: self.path.clone(), at_byte: self.at_byte() }),
        }
    }

    /// Hands whole records, with so many messages in them, to the operating system.
    pub(super) fn hand_over(&mut self, records: Vec<u8>, messages: u64) -> Result<(), LogError> {
        match self.tail.append(&records) {
            Ok(()) => {
                self.dirty = true;
                Ok(())
            }
            Err(source) => {
                let wanted_bytes = records.len();
                self.failure = Some(Failure { records, messages });
                Err(self.write_error(wanted_bytes, source))
            }
        }
    }

    pub(super) fn request_sync(&mut self) {
        self.syncer.request();
        (self.dirty, self.synced_at) = (false, Instant::now());
    }

    pub(super) fn sync_if_due(&mut self) -> Result<(), LogError> {
        if let Some(source) = self.syncer.error() {
            return Err(LogError::io("sync", &self.path)(source));
        }
        if self.dirty && self.synced_at.elapsed() >= self.sync_period {
            self.request_sync();
        }
        Ok(())
    }

    /// Tries once more what could not be written.
    ///
    /// Where it still cannot, the file stays without an end, which would speak of what is missing; the next start
    /// gives it one.
    pub(super) fn retry(&mut self) -> Result<(), LogError> {
        let Some(Failure { records, messages }) = self.failure.take() else { return Ok(()) };
        let Err(source) = self.tail.append(&records) else { return Ok(()) };
        self.syncer.request();
        // Of two errors the first is the one to act on.
        let _ = self.syncer.finish();
        Err(LogError::Incomplete {
            path: self.path.clone(),
            lost_messages: messages,
            at_byte: self.tail.at_byte(),
            wanted_bytes: records.len() as u64,
            source,
        })
    }

    /// Writes the end and waits until all is on the disk.
    pub(super) fn finish(&mut self, end: &[u8]) -> Result<(), LogError> {
        let ended = self.tail.append(end);
        self.syncer.request();
        let not_synced = self.syncer.finish();
        ended.map_err(|source| self.write_error(end.len(), source))?;
        match not_synced {
            Some(source) => Err(LogError::io("sync", &self.path)(source)),
            None => Ok(()),
        }
    }

    fn write_error(&self, wanted_bytes: usize, source: io::Error) -> LogError {
        let (path, at_byte) = (self.path.clone(), self.tail.at_byte());
        LogError::Write { path, at_byte, wanted_bytes: wanted_bytes as u64, source }
    }
}
