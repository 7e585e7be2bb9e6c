//! Syncs a file to its disk on a thread of its own: a disk that takes a second to sync must not
//! hold up the chunks of that second.

use std::{
    io,
    sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel},
    thread::JoinHandle,
};

/// Syncs when asked; ends, with a last sync, when dropped.
pub(crate) struct Syncer {
    requests: Option<SyncSender<()>>,
    errors: Receiver<io::Error>,
    thread: Option<JoinHandle<()>>,
}

impl Syncer {
    /// Starts the thread; `sync` is called on it.
    pub(crate) fn new(mut sync: impl FnMut() -> io::Result<()> + Send + 'static) -> io::Result<Self> {
        // One request may wait while one is served; more would ask for the same.
        let (requests, to_serve) = sync_channel(1);
        let (report, errors) = sync_channel(1);
        let thread = std::thread::Builder::new().name("log-sync".into()).spawn(move || {
            while to_serve.recv().is_ok() {
                if let Err(error) = sync() {
                    // One report is enough: the writer stops at it.
                    let _ = report.try_send(error);
                }
            }
        })?;
        Ok(Self { requests: Some(requests), errors, thread: Some(thread) })
    }

    /// Asks for a sync of everything written so far; returns at once.
    pub(crate) fn request(&self) {
        if let Some(requests) = &self.requests {
            match requests.try_send(()) {
                // Full: the waiting request is served later than this and so covers it.
                Ok(()) | Err(TrySendError::Full(())) => {}
                // The thread ends only when `requests` is gone.
                Err(TrySendError::Disconnected(())) => {}
            }
        }
    }

    /// The error of an earlier sync, once.
    pub(crate) fn error(&self) -> Option<io::Error> {
        self.errors.try_recv().ok()
    }

    /// Waits for the requested syncs and returns the error that none has seen yet.
    pub(crate) fn finish(&mut self) -> Option<io::Error> {
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // A panic in there would be ours; the process ends by it elsewhere.
            let _ = thread.join();
        }
        self.error()
    }
}

impl Drop for Syncer {
    fn drop(&mut self) {
        self.finish();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    };

    use super::*;

    #[test]
    fn every_request_is_covered_by_a_later_sync() {
        let (seen, asked) = (Arc::new(AtomicU32::new(0)), Arc::new(AtomicU32::new(0)));
        let (seen_by_sync, asked_by) = (seen.clone(), asked.clone());
        let mut syncer = Syncer::new(move || {
            seen_by_sync.store(asked_by.load(Ordering::SeqCst), Ordering::SeqCst);
            Ok(())
        })
        .unwrap();
        for n in 1..=1000 {
            asked.store(n, Ordering::SeqCst);
            syncer.request();
        }
        assert!(syncer.finish().is_none());
        assert_eq!(seen.load(Ordering::SeqCst), 1000);
    }

    #[test]
    fn an_error_is_reported_once() {
        const EIO: i32 = 5;
        let mut syncer = Syncer::new(|| Err(io::Error::from_raw_os_error(EIO))).unwrap();
        syncer.request();
        assert_eq!(syncer.finish().unwrap().raw_os_error(), Some(EIO));
        assert!(syncer.error().is_none());
    }
}
