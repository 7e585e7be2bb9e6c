//! Logs to read and the pair to read them with, as several commands take them.

use std::path::PathBuf;

/// Logs and their pair.
#[derive(Debug, clap::Args)]
pub struct Recorded {
    /// The logs, in their order
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    /// The gear pair with all that is known of it [default: the one in the first log]
    #[arg(long, value_name = "FILE")]
    pub pair: Option<PathBuf>,
}
