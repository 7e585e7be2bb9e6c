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
use crate::{container::summary::Summary, error::LogError};

/// A file that grows by whole records, and the summary of them.
pub(super) struct Output {
    path: PathBuf,
    tail: Tail,
    summary: Summary,
    syncer: Syncer,
    sync_period: Duration,
    synced_at: Instant,
    dirty: bool,
    failure: Option<Failure>,
}

/// A failed write, kept for another try at the end.
struct Failure {
    source: io::Error,
    records: Vec<u8>,
    summary: Summary,
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
            summary: Summary::default(),
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

    pub(super) fn summary(&self) -> &Summary {
        &self.summary
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

    /// Hands whole records to the operating system; `summary` tells what they hold.
    pub(super) fn hand_over(&mut self, records: Vec<u8>, summary: Summary) -> Result<(), LogError> {
        match self.tail.append(&records) {
            Ok(()) => {
                self.summary.append(summary);
                self.dirty = true;
                Ok(())
            }
            Err(source) => {
                let error = self.write_error(records.len(), copy_of(&source));
                self.failure = Some(Failure { source, records, summary });
                Err(error)
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

    /// Writes the end and waits until all is on the disk.
    pub(super) fn finish(&mut self) -> Result<(), LogError> {
        let lost = self.failure.take().and_then(|failure| self.retry(failure));
        let end = self.summary.encode_end(self.tail.at_byte(), self.tail.crc());
        let at_byte = self.tail.at_byte();
        let ended = self.tail.append(&end);
        self.syncer.request();
        let not_synced = self.syncer.finish();
        if let Some(Failure { source, records, summary }) = lost {
            return Err(LogError::Incomplete {
                path: self.path.clone(),
                lost_messages: summary.messages(),
                at_byte,
                wanted_bytes: records.len() as u64,
                finalised: ended.is_ok(),
                source,
            });
        }
        ended.map_err(|source| self.write_error(end.len(), source))?;
        match not_synced {
            Some(source) => Err(LogError::io("sync", &self.path)(source)),
            None => Ok(()),
        }
    }

    /// Tries once more what could not be written; returns what still cannot.
    fn retry(&mut self, failure: Failure) -> Option<Failure> {
        let Failure { records, summary, .. } = failure;
        match self.tail.append(&records) {
            Ok(()) => {
                self.summary.append(summary);
                None
            }
            Err(source) => Some(Failure { source, records, summary }),
        }
    }

    fn write_error(&self, wanted_bytes: usize, source: io::Error) -> LogError {
        let (path, at_byte) = (self.path.clone(), self.tail.at_byte());
        LogError::Write { path, at_byte, wanted_bytes: wanted_bytes as u64, source }
    }
}

/// The same error once more: one for the caller, one for the end of the log.
fn copy_of(error: &io::Error) -> io::Error {
    error.raw_os_error().map_or_else(|| error.kind().into(), io::Error::from_raw_os_error)
}
