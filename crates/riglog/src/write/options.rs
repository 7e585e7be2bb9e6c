//! How a log is written, and what came of it.

use std::path::PathBuf;

/// How a log is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WriterOptions {
    /// Program and version, as `rigd 0.1.0`.
    pub library: String,
    /// A chunk is closed when this much log time or this much wall time has passed since its first message.
    pub chunk_period_ms: u32,
    /// A chunk is closed at this size, before compression.
    pub chunk_bytes: usize,
    /// Data is synced to the disk at least this often.
    pub sync_period_ms: u32,
    /// Level of zstd; see [`WriterOptions::new`] for the default.
    pub compression_level: i32,
}

impl WriterOptions {
    /// The project's policy: chunks of 100 ms or 1 MiB, synced every second.
    ///
    /// zstd level 1: of the levels tried by `examples/throughput.rs` on counts of an elliptic pair it is the first that
    /// codes the deltas by their entropy (2.1 B a sample against 3.2 at level −5), at 8 M samples/s, of which a rig
    /// needs a few thousandths; level 3 saves another 4 %.
    pub fn new(library: impl Into<String>) -> Self {
        Self {
            library: library.into(),
            chunk_period_ms: 100,
            chunk_bytes: 1 << 20,
            sync_period_ms: 1000,
            compression_level: 1,
        }
    }
}

/// What a finished log holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogStatistics {
    /// The file.
    pub path: PathBuf,
    /// Messages on all channels.
    pub messages: u64,
    /// Angle samples.
    pub samples: u64,
    /// Chunks.
    pub chunks: u64,
    /// Size of the file.
    pub bytes: u64,
}
