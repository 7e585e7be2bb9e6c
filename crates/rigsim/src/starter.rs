//! Who started `rigd sim`: a run that dies, however it dies, leaves no simulated rig behind.
//!
//! A person's `rigd sim` outlives the shell that started it; one that a run started for itself ends with the run.

use std::os::unix::process::parent_id;
use std::path::PathBuf;

/// The run that started this process, if a run did.
pub struct Starter {
    run: Option<u32>,
}

impl Starter {
    /// Looks who started this process: a run is the same program.
    #[must_use]
    pub fn look() -> Self {
        let parent = parent_id();
        let theirs = program(&parent.to_string());
        Self { run: theirs.filter(|theirs| program("self").as_ref() == Some(theirs)).map(|_| parent) }
    }

    /// The run is gone: the system has given this process another parent.
    #[must_use]
    pub fn has_died(&self) -> bool {
        self.run.is_some_and(|run| parent_id() != run)
    }
}

/// The file that a process executes; `None` where the system does not tell.
fn program(process: &str) -> Option<PathBuf> {
    std::fs::read_link(format!("/proc/{process}/exe")).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_is_not_a_run_may_end_without_us() {
        // The test's parent is cargo or a shell, not the test itself.
        let starter = Starter::look();
        assert_eq!(starter.run, None);
        assert!(!starter.has_died());
    }

    #[test]
    fn a_run_that_is_no_longer_our_parent_has_died() {
        assert!(!Starter { run: Some(parent_id()) }.has_died());
        assert!(Starter { run: Some(u32::MAX) }.has_died());
    }
}
