//! The runs of this user that are under way, so that another program can stop them.
//!
//! A run leaves its process number in the user's runtime directory; the number is believed only while a lock on the file is held.

use std::fs::{File, TryLockError};
use std::io::Write as _;
use std::path::PathBuf;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

fn directory() -> PathBuf {
    std::env::var_os("XDG_RUNTIME_DIR").map_or_else(
        || std::env::temp_dir().join(format!("rigd-{}", nix::unistd::Uid::current())),
        |runtime| PathBuf::from(runtime).join("rigd"),
    )
}

/// This process's entry in the list of runs; gone when dropped.
pub struct Running {
    path: PathBuf,
    _lock: File,
}

impl Running {
    /// Enters this process; `None` when the directory cannot be written, and then `rigd stop` does not find it.
    pub fn register() -> Option<Self> {
        let directory = directory();
        std::fs::create_dir_all(&directory).ok()?;
        let path = directory.join(format!("{}.run", std::process::id()));
        let mut file = File::create(&path).ok()?;
        file.lock().ok()?;
        file.write_all(std::process::id().to_string().as_bytes()).ok()?;
        Some(Self { path, _lock: file })
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Process numbers of the runs of this user that are under way. What dead runs left behind is cleared away.
#[must_use]
pub fn runs() -> Vec<i32> {
    let entries =
        std::fs::read_dir(directory()).map(|entries| entries.flatten().collect::<Vec<_>>()).unwrap_or_default();
    let mut runs = Vec::new();
    for entry in entries {
        let path = entry.path();
        let Ok(file) = File::open(&path) else { continue };
        if !matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            // Nobody holds it: the run died, and its number may be another's by now.
            let _ = std::fs::remove_file(&path);
            continue;
        }
        runs.extend(std::fs::read_to_string(&path).ok().and_then(|text| text.trim().parse::<i32>().ok()));
    }
    runs
}

/// Sends a signal to the runs under way that `wanted` chooses; how many got it.
pub fn signal_runs(signal: Signal, wanted: impl Fn(i32) -> bool) -> usize {
    runs().into_iter().filter(|pid| wanted(*pid) && kill(Pid::from_raw(*pid), signal).is_ok()).count()
}
