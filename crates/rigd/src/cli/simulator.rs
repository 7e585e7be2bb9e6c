//! `rigd sim` as a process of its own, for `rigd run --time-scale 1`.

use std::io::{BufRead as _, BufReader};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::profile::Profile;

/// The process; ended when dropped.
pub struct Simulator {
    process: Child,
    directory: PathBuf,
    profile: Profile,
}

impl Simulator {
    /// Starts the process and waits until its ports are there.
    ///
    /// # Errors
    /// Why it did not start.
    pub fn start(seed: u64, pair: Option<&Path>, undocumented: &[String]) -> Result<Self, String> {
        let failed = |reason: String| format!("the simulated rig did not start: {reason}");
        let directory = std::env::temp_dir().join(format!("rigd-sim-{}", std::process::id()));
        let program = std::env::current_exe().map_err(|error| failed(error.to_string()))?;
        let mut command = Command::new(program);
        command.arg("sim").arg("--pty-dir").arg(&directory).arg("--seed").arg(seed.to_string());
        if let Some(pair) = pair {
            command.arg("--pair").arg(pair);
        }
        for name in undocumented {
            command.arg("--undocumented").arg(name);
        }
        // A group of its own: Ctrl-C stops the run, and only then the rig.
        command.process_group(0).stdin(Stdio::null()).stdout(Stdio::piped());
        let mut process = command.spawn().map_err(|error| failed(error.to_string()))?;
        let ready = process
            .stdout
            .take()
            .is_some_and(|output| BufReader::new(output).lines().map_while(Result::ok).any(|line| line == "ready"));
        let profile = if ready {
            Profile::load(&directory.join("profile.toml")).map_err(|error| error.to_string())
        } else {
            Err("it ended before it was ready".into())
        };
        match profile {
            Ok(profile) => Ok(Self { process, directory, profile }),
            Err(error) => {
                end(&mut process);
                Err(failed(error))
            }
        }
    }

    /// The profile that finds its ports.
    #[must_use]
    pub fn profile(&self) -> &Profile {
        &self.profile
    }
}

/// Asks the process to end, then makes it.
fn end(process: &mut Child) {
    let pid = nix::unistd::Pid::from_raw(process.id() as i32);
    let _ = nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGTERM);
    for _ in 0..50 {
        if matches!(process.try_wait(), Ok(Some(_))) {
            return;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let _ = process.kill();
    let _ = process.wait();
}

impl Drop for Simulator {
    fn drop(&mut self) {
        end(&mut self.process);
        let _ = std::fs::remove_dir_all(&self.directory);
    }
}
