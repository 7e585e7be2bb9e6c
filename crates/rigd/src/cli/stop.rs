//! `rigd stop`: end a run from another terminal, as Ctrl-C does.

use nix::sys::signal::Signal;

use super::{Exit, print};
use crate::run::registry::signal_runs;

/// End a run from another terminal, as Ctrl-C does.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn main(_: &Args) -> Exit {
    let stopped = signal_runs(Signal::SIGINT, |pid| {
        print(&format!("stopping run {pid}"));
        true
    });
    if stopped == 0 {
        eprintln!("error: no run of this user is under way");
        return Exit::BadInput;
    }
    Exit::Done
}
