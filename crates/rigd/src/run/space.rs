//! Room on the log's disk: a warning while there is time to make room, a stop in order while the log can still be ended.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use riglog::LogError;

use crate::profile::LogPolicy;

/// How often the file system is asked.
const PERIOD: Duration = Duration::from_secs(1);
const BYTES_PER_MB: f64 = 1e6;

/// Watches the free space of one directory.
pub struct SpaceWatch {
    directory: PathBuf,
    warn_bytes: u64,
    stop_bytes: u64,
    looked: Option<Instant>,
    warned: bool,
    stopped: bool,
}

/// What a look found, where it is new.
#[derive(Debug)]
pub enum Space {
    /// Nothing to say.
    Enough,
    /// Less is free than the profile wants to be warned at; told once.
    Low {
        /// What to say.
        warning: String,
    },
    /// So little is free that the run has to end; told once.
    Short(LogError),
}

impl SpaceWatch {
    /// Watches the disk of the log at `path`.
    #[must_use]
    pub fn new(path: &Path, policy: &LogPolicy) -> Self {
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        Self {
            directory: parent.unwrap_or(Path::new(".")).to_owned(),
            warn_bytes: (policy.warn_free_mb * BYTES_PER_MB) as u64,
            stop_bytes: (policy.stop_free_mb * BYTES_PER_MB) as u64,
            looked: None,
            warned: false,
            stopped: false,
        }
    }

    /// Looks, where the last look is long enough ago.
    pub fn look(&mut self) -> Space {
        if self.looked.is_some_and(|looked| looked.elapsed() < PERIOD) {
            return Space::Enough;
        }
        self.looked = Some(Instant::now());
        // A file system that does not say is no reason to stop: a write that fails still is.
        free_bytes(&self.directory).map_or(Space::Enough, |free_bytes| self.judge(free_bytes))
    }

    fn judge(&mut self, free_bytes: u64) -> Space {
        if free_bytes < self.stop_bytes && !std::mem::replace(&mut self.stopped, true) {
            self.warned = true;
            return Space::Short(LogError::DiskShort {
                directory: self.directory.clone(),
                free_bytes,
                limit_bytes: self.stop_bytes,
            });
        }
        if free_bytes < self.warn_bytes && !std::mem::replace(&mut self.warned, true) {
            let warning = format!(
                "{:.1} MB are free in {} (warning under {} MB, log.warn_free_mb; the run stops under {} MB): free space, or move old logs away (`rigd prune`)",
                free_bytes as f64 / BYTES_PER_MB,
                self.directory.display(),
                self.warn_bytes as f64 / BYTES_PER_MB,
                self.stop_bytes as f64 / BYTES_PER_MB,
            );
            return Space::Low { warning };
        }
        Space::Enough
    }
}

/// Space that this user may use there.
#[must_use]
pub fn free_bytes(directory: &Path) -> Option<u64> {
    let facts = nix::sys::statvfs::statvfs(directory).ok()?;
    Some(facts.blocks_available().saturating_mul(facts.fragment_size()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::Profile;

    #[test]
    fn each_threshold_is_told_once_and_from_its_own_side() {
        let policy = LogPolicy { warn_free_mb: 100.0, stop_free_mb: 10.0, ..Profile::simulated().log };
        let mut watch = SpaceWatch::new(Path::new("runs/x.mcap"), &policy);
        assert!(matches!(watch.judge(100_000_000), Space::Enough));
        assert!(
            matches!(watch.judge(99_999_999), Space::Low { warning } if warning.contains("runs") && warning.contains("under 100 MB"))
        );
        assert!(matches!(watch.judge(50_000_000), Space::Enough));
        assert!(matches!(watch.judge(10_000_000), Space::Enough));
        let Space::Short(error) = watch.judge(9_999_999) else { panic!("told") };
        assert!(error.to_string().contains("log.stop_free_mb"), "{error}");
        assert!(matches!(watch.judge(0), Space::Enough), "told once");
    }

    #[test]
    fn the_file_system_says_how_much_is_free() {
        let directory = tempfile::TempDir::new().unwrap();
        assert!(free_bytes(directory.path()).unwrap() > 0);
        assert_eq!(free_bytes(Path::new("/nowhere/at/all")), None);
    }
}
