//! The operator's stop: Ctrl-C, SIGTERM, SIGHUP. A second one skips the ramp.

use std::cell::Cell;
use std::rc::Rc;

use tokio::signal::unix::{SignalKind, signal};

/// How often a stop was asked for.
#[derive(Clone, Default)]
pub struct StopRequests(Rc<Cell<u32>>);

impl StopRequests {
    /// Listens to the signals from now on; needs a local task set.
    ///
    /// # Errors
    /// When the operating system refuses a handler.
    pub fn listen() -> std::io::Result<Self> {
        let requests = Self::default();
        for kind in [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()] {
            let mut signals = signal(kind)?;
            let count = Rc::clone(&requests.0);
            tokio::task::spawn_local(async move {
                while signals.recv().await.is_some() {
                    count.set(count.get() + 1);
                }
            });
        }
        Ok(requests)
    }

    /// A stop was asked for.
    #[must_use]
    pub fn any(&self) -> bool {
        self.0.get() > 0
    }

    /// It was asked for again: skip the ramp.
    #[must_use]
    pub fn hurried(&self) -> bool {
        self.0.get() > 1
    }
}
