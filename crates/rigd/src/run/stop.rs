//! What the operator wants: a stop (Ctrl-C, SIGTERM, SIGHUP; a second one skips the ramp), or a pause (SIGUSR1, key p).

use std::cell::Cell;
use std::rc::Rc;

use tokio::signal::unix::{SignalKind, signal};

/// How often a stop was asked for, and whether a pause is wanted.
#[derive(Clone, Default)]
pub struct StopRequests {
    stops: Rc<Cell<u32>>,
    pause: Rc<Cell<bool>>,
}

impl StopRequests {
    /// Listens to the signals of a stop from now on; needs a local task set.
    ///
    /// # Errors
    /// When the operating system refuses a handler.
    pub fn listen() -> std::io::Result<Self> {
        let requests = Self::default();
        for kind in [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()] {
            let mut signals = signal(kind)?;
            let count = Rc::clone(&requests.stops);
            tokio::task::spawn_local(async move {
                while signals.recv().await.is_some() {
                    count.set(count.get() + 1);
                }
            });
        }
        Ok(requests)
    }

    /// Listens to SIGUSR1 too: each one asks for a pause at the end of a revolution, or to go on.
    ///
    /// # Errors
    /// When the operating system refuses a handler.
    pub fn listen_for_pause(&self) -> std::io::Result<()> {
        let mut signals = signal(SignalKind::user_defined1())?;
        let requests = self.clone();
        tokio::task::spawn_local(async move {
            while signals.recv().await.is_some() {
                requests.toggle_pause();
            }
        });
        Ok(())
    }

    /// Asks for a pause, or to go on.
    pub fn toggle_pause(&self) {
        self.pause.set(!self.pause.get());
    }

    /// Asks for a pause.
    pub fn pause(&self) {
        self.pause.set(true);
    }

    /// Takes a pause back.
    pub fn go_on(&self) {
        self.pause.set(false);
    }

    /// Asks for a stop, as a signal does.
    pub fn ask(&self) {
        self.stops.set(self.stops.get() + 1);
    }

    /// A pause is wanted.
    #[must_use]
    pub fn paused(&self) -> bool {
        self.pause.get()
    }

    /// A stop was asked for.
    #[must_use]
    pub fn any(&self) -> bool {
        self.stops.get() > 0
    }

    /// It was asked for again: skip the ramp.
    #[must_use]
    pub fn hurried(&self) -> bool {
        self.stops.get() > 1
    }
}
