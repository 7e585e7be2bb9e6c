//! What someone with the token may do: stop, pause, start a plan. Nothing here speaks to a device: a run is told as from a terminal, and a
//! plan is started as a process of its own, which outlives this one.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use thiserror::Error;

use crate::run::registry;

/// Why a wish is not granted.
#[derive(Debug, Error)]
pub enum ControlError {
    /// Nothing runs.
    #[error("no run of this user is under way")]
    NoRun,
    /// The run would die of the signal.
    #[error("the run under way cannot be paused")]
    NotPausable,
    /// One is enough.
    #[error("a run is under way; stop it first")]
    Busy,
    /// The service was given no plans.
    #[error("no plans are served; start the service with --plans DIR")]
    NoPlans,
    /// There is no such plan.
    #[error("no plan of this name; GET /api/plans lists them")]
    UnknownPlan,
    /// It did not start.
    #[error("the plan did not start: {0}")]
    Start(std::io::Error),
}

/// The plans, and the one that was started.
pub struct Control {
    program: PathBuf,
    plans: Option<PathBuf>,
    out: PathBuf,
    profile: Option<PathBuf>,
    started: Mutex<Option<(String, Child)>>,
}

impl Control {
    /// Control that starts plans of the directory `plans` by `program campaign PLAN --out OUT/NAME`.
    #[must_use]
    pub fn new(program: PathBuf, plans: Option<PathBuf>, out: PathBuf, profile: Option<PathBuf>) -> Self {
        Self { program, plans, out, profile, started: Mutex::new(None) }
    }

    /// Stops every run of this user, as `rigd stop` does.
    ///
    /// # Errors
    /// [`ControlError::NoRun`].
    pub fn stop(&self) -> Result<Value, ControlError> {
        match registry::signal_runs(Signal::SIGINT, |_| true) {
            0 => Err(ControlError::NoRun),
            runs => Ok(json!({"stopping": runs})),
        }
    }

    /// Pauses every run at the end of its revolution, or lets it go on.
    ///
    /// # Errors
    /// [`ControlError::NoRun`], or [`ControlError::NotPausable`] for a run that does not know the signal, which would kill it.
    pub fn pause(&self) -> Result<Value, ControlError> {
        if registry::runs().is_empty() {
            return Err(ControlError::NoRun);
        }
        match registry::signal_runs(Signal::SIGUSR1, |pid| catches(pid, Signal::SIGUSR1)) {
            0 => Err(ControlError::NotPausable),
            runs => Ok(json!({"pausing": runs})),
        }
    }

    /// Names of the plans.
    #[must_use]
    pub fn plans(&self) -> Vec<String> {
        let Some(directory) = &self.plans else { return Vec::new() };
        let mut names: Vec<String> = std::fs::read_dir(directory)
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()))
            .filter_map(|entry| entry.file_name().into_string().ok())
            .filter(|name| Path::new(name).extension().is_some_and(|extension| extension == "toml"))
            .collect();
        names.sort();
        names
    }

    /// Starts a plan by its name in the list; a path is no name.
    ///
    /// # Errors
    /// [`ControlError`] says why not.
    pub fn start(&self, plan: &str) -> Result<Value, ControlError> {
        let directory = self.plans.as_ref().ok_or(ControlError::NoPlans)?;
        let name = self.plans().into_iter().find(|name| name == plan).ok_or(ControlError::UnknownPlan)?;
        let mut started = self.started.lock().unwrap_or_else(PoisonError::into_inner);
        let running = started.as_mut().is_some_and(|(_, child)| matches!(child.try_wait(), Ok(None)));
        if running || !registry::runs().is_empty() {
            return Err(ControlError::Busy);
        }
        let mut command = Command::new(&self.program);
        let own = self.out.join(Path::new(&name).file_stem().unwrap_or_default());
        command.arg("campaign").arg(directory.join(&name)).arg("--out").arg(own);
        if let Some(profile) = &self.profile {
            command.arg("--profile").arg(profile);
        }
        use std::os::unix::process::CommandExt as _;
        // A group of its own: what ends the service does not end the run.
        command.process_group(0).stdin(Stdio::null()).stdout(Stdio::null());
        let child = command.spawn().map_err(ControlError::Start)?;
        let told = json!({"started": name, "pid": child.id()});
        *started = Some((name, child));
        Ok(told)
    }

    /// The plan that was started here, and how it stands.
    #[must_use]
    pub fn started(&self) -> Value {
        let mut started = self.started.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((name, child)) = started.as_mut() else { return Value::Null };
        let exit = match child.try_wait() {
            Ok(Some(status)) => json!(status.code()),
            _ => Value::Null,
        };
        json!({"plan": name, "pid": child.id(), "exit_code": exit})
    }
}

/// Whether a process handles a signal; one that does not would die of it. (proc(5): SigCgt is a mask, bit n − 1 for signal n.)
fn catches(pid: i32, signal: Signal) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask & (1 << (signal as i32 - 1)) != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_are_started_by_their_name_in_the_list_and_by_no_path() {
        let directory = tempfile::TempDir::new().unwrap();
        let plans = directory.path().join("plans");
        std::fs::create_dir_all(plans.join("deep.toml")).unwrap();
        std::fs::write(plans.join("night.toml"), "").unwrap();
        std::fs::write(plans.join("notes.txt"), "").unwrap();
        std::fs::write(directory.path().join("secret.toml"), "").unwrap();
        let control = Control::new("/bin/true".into(), Some(plans), directory.path().into(), None);
        assert_eq!(control.plans(), ["night.toml"]);
        for name in
            ["../secret.toml", "/etc/passwd", "deep.toml", "notes.txt", "", ".", "night.toml/", "plans/night.toml"]
        {
            assert!(matches!(control.start(name), Err(ControlError::UnknownPlan)), "{name}");
        }
        assert_eq!(control.started(), Value::Null);
        let none = Control::new("/bin/true".into(), None, directory.path().into(), None);
        assert!(matches!(none.start("night.toml"), Err(ControlError::NoPlans)));
    }

    #[test]
    fn a_process_that_would_die_of_a_signal_is_known() {
        let mut sleeper = Command::new("sleep").arg("60").spawn().unwrap();
        let pid = i32::try_from(sleeper.id()).unwrap();
        assert!(!catches(pid, Signal::SIGUSR1));
        assert!(!catches(-1, Signal::SIGUSR1));
        sleeper.kill().unwrap();
        sleeper.wait().unwrap();
    }
}
