//! Key `p` on the terminal: pause at the end of a revolution, and go on.
//!
//! Only while this process is in the terminal's foreground: a background job that reads its terminal is stopped by the system, and a
//! stopped daemon is one that the drive's watchdog has to stop.

use std::io::{IsTerminal as _, Read as _, stdin};
use std::os::fd::AsFd as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::termios::{LocalFlags, SetArg, Termios, tcgetattr, tcsetattr};
use nix::unistd::{getpgrp, tcgetpgrp};
use tokio::sync::mpsc::unbounded_channel;

use super::stop::StopRequests;

/// How often the foreground is looked at.
const PERIOD_MS: u16 = 200;

/// The terminal without line editing; as it was when dropped.
pub struct Keys {
    before: Option<Termios>,
    ended: Arc<AtomicBool>,
}

impl Keys {
    /// Listens where standard input is a terminal and this process is in its foreground; needs a local task set.
    #[must_use]
    pub fn listen(stop: &StopRequests) -> Self {
        let ended = Arc::new(AtomicBool::new(false));
        let before = (stdin().is_terminal() && in_foreground()).then(single_keys).flatten();
        if before.is_some() {
            let (sender, mut keys) = unbounded_channel();
            let theirs = Arc::clone(&ended);
            std::thread::spawn(move || {
                while !theirs.load(Ordering::Relaxed) {
                    match read_key() {
                        Ok(Some(key)) if sender.send(key).is_err() => return,
                        Ok(_) => {}
                        Err(_) => return,
                    }
                }
            });
            let stop = stop.clone();
            tokio::task::spawn_local(async move {
                while let Some(key) = keys.recv().await {
                    if key.eq_ignore_ascii_case(&b'p') {
                        stop.toggle_pause();
                    }
                }
            });
        }
        Self { before, ended }
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(before) = &self.before
            && in_foreground()
        {
            let _ = tcsetattr(stdin(), SetArg::TCSANOW, before);
        }
    }
}

fn in_foreground() -> bool {
    tcgetpgrp(stdin()).is_ok_and(|group| group == getpgrp())
}

/// Keys at once and without echo; Ctrl-C stays a signal. Gives the settings before.
fn single_keys() -> Option<Termios> {
    let before = tcgetattr(stdin()).ok()?;
    let mut settings = before.clone();
    settings.local_flags.remove(LocalFlags::ICANON | LocalFlags::ECHO);
    tcsetattr(stdin(), SetArg::TCSANOW, &settings).ok()?;
    Some(before)
}

/// Waits a little for a key.
fn read_key() -> std::io::Result<Option<u8>> {
    if !in_foreground() {
        std::thread::sleep(Duration::from_millis(u64::from(PERIOD_MS)));
        return Ok(None);
    }
    let input = stdin();
    let mut ready = [PollFd::new(input.as_fd(), PollFlags::POLLIN)];
    if poll(&mut ready, PollTimeout::from(PERIOD_MS))? == 0 || !in_foreground() {
        return Ok(None);
    }
    let mut key = [0];
    let count = input.lock().read(&mut key)?;
    if count == 0 { Err(std::io::ErrorKind::UnexpectedEof.into()) } else { Ok(Some(key[0])) }
}
