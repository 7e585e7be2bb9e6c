//! What can go wrong with a log, each with the file, the place and the next step.

use std::{
    io,
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::completeness::Defect;

/// A failure to write, read or repair a rig log.
#[derive(Debug, Error)]
pub enum LogError {
    /// The file is there already; a log is never overwritten.
    #[error("{} exists already; logs are never overwritten: choose another name or move it away", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// Another process holds the file's lock, so it is being written.
    #[error("{} is being written by another process; wait for the run to end or stop it with `rigd stop`", path.display())]
    Locked {
        /// The file.
        path: PathBuf,
    },
    /// An operating system call other than writing the log's content failed.
    #[error("cannot {action} {}: {source}; {}", path.display(), advice(source))]
    Io {
        /// What was tried, as a verb.
        action: &'static str,
        /// The file or directory.
        path: PathBuf,
        /// What the operating system answered.
        source: io::Error,
    },
    /// The log's content could not be handed to the operating system.
    #[error("cannot write {wanted_bytes} bytes at byte {at_byte} of {}: {source}; the log stays readable up to there; {}", path.display(), advice(source))]
    Write {
        /// The file.
        path: PathBuf,
        /// Where the file's last whole record ends.
        at_byte: u64,
        /// How much was to be written there.
        wanted_bytes: u64,
        /// What the operating system answered.
        source: io::Error,
    },
    /// The log refuses more after an earlier failure to write.
    #[error("{} takes no more messages since writing failed at byte {at_byte}; stop the run and finish the log", path.display())]
    Stopped {
        /// The file.
        path: PathBuf,
        /// Where the file's last whole record ends.
        at_byte: u64,
    },
    /// The log was ended, but not with everything that it was given.
    #[error("{} lacks its last {lost_messages} messages: {wanted_bytes} bytes at byte {at_byte} could not be written: {source}; what is there is readable and is finalised at the next start; {}",
        path.display(), advice(source))]
    Incomplete {
        /// The file.
        path: PathBuf,
        /// Messages that were accepted and are not in the file.
        lost_messages: u64,
        /// Where the loss begins.
        at_byte: u64,
        /// How much was to be written there.
        wanted_bytes: u64,
        /// What the operating system answered.
        source: io::Error,
    },
    /// The disk is nearly full: the run ends while there is room for the end of its log.
    #[error("only {:.1} MB are free in {} (limit {:.1} MB, log.stop_free_mb); what was recorded is kept and ended in order: free space, or record elsewhere with --out",
        *free_bytes as f64 * 1e-6, directory.display(), *limit_bytes as f64 * 1e-6)]
    DiskShort {
        /// The log's directory.
        directory: PathBuf,
        /// What is free.
        free_bytes: u64,
        /// What shall be.
        limit_bytes: u64,
    },
    /// The file is something else.
    #[error("{} is not an MCAP file: it begins with {found}; give a log written by `rigd run` or `rigd import`", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
        /// Its first bytes.
        found: String,
    },
    /// An MCAP file of another kind of recording.
    #[error("{} holds no rig channels (found {}); a rig log has /rig/angles and /rig/state: convert columns with `rigd import`", path.display(), list(topics))]
    NoRigChannels {
        /// The file.
        path: PathBuf,
        /// The topics that it has instead.
        topics: Vec<String>,
    },
    /// A message of a whole chunk does not decode.
    #[error("the message on {topic} at log time {log_time_ns} ns in the chunk at byte {at_byte} of {} is no {schema}: {source}; the program that wrote it disagrees with the schema of this topic", path.display())]
    BadMessage {
        /// The file.
        path: PathBuf,
        /// The message's topic.
        topic: &'static str,
        /// The type that the topic carries.
        schema: &'static str,
        /// The message's log time.
        log_time_ns: u64,
        /// Where its chunk begins.
        at_byte: u64,
        /// What the decoder says.
        source: prost::DecodeError,
    },
    /// A batch of angles contradicts itself.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// A metadata record does not say what it must.
    #[error("metadata `{record}`, key `{key}`: expected {expected}, got {}; correct the profile that recorded it", got(value.as_deref()))]
    Metadata {
        /// The record.
        record: &'static str,
        /// The key.
        key: &'static str,
        /// What stands there; `None` where the key is missing.
        value: Option<String>,
        /// What may stand there.
        expected: &'static str,
    },
    /// Counts cannot become angles.
    #[error("{} holds no `rig.encoders` record, so its counts are no angles; the run ended before homing, record it again", path.display())]
    NoEncoders {
        /// The file.
        path: PathBuf,
    },
    /// A recorded stretch does not say which way the driver turned.
    #[error("the state at {at_ns} ns (device time) in {} records with no direction; `direction` must be CCW or CW while `phase` is RECORD", path.display())]
    NoDirection {
        /// The file.
        path: PathBuf,
        /// The state message's device time.
        at_ns: u64,
    },
    /// Device time runs backwards.
    #[error("device time jumps back from {before_ns} ns to {at_ns} ns at sample {first_sample} of {}; the device's clock was reset in between: split the log there", path.display())]
    TimeReversed {
        /// The file.
        path: PathBuf,
        /// The first sample after the jump.
        first_sample: u64,
        /// Its time.
        at_ns: u64,
        /// The time of the sample before it.
        before_ns: u64,
    },
    /// Too little of the file is left to make a log of it.
    #[error("{} cannot be finalised: {why}; it holds no samples, delete it", path.display())]
    NothingToRecover {
        /// The file.
        path: PathBuf,
        /// What is wrong with its beginning.
        why: Defect,
    },
    /// The compressor refused; it does so only when memory is short.
    #[error("cannot compress a chunk of {bytes} bytes for {}: {source}; free memory", path.display())]
    Compress {
        /// The file.
        path: PathBuf,
        /// The size of the chunk.
        bytes: usize,
        /// What the compressor says.
        source: io::Error,
    },
    /// A name, text or file is larger than a record of the format may be.
    #[error("{what} of {bytes} bytes does not fit into {}: the limit is {limit} bytes; shorten it", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What it is.
        what: &'static str,
        /// Its size.
        bytes: usize,
        /// The largest allowed.
        limit: u64,
    },
}

/// A batch of angles that contradicts itself.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum BatchError {
    /// One encoder has more samples than the other.
    #[error(
        "the batch of sample {first_sample} has {input} input and {output} output deltas; both must be as many: drop the batch and count it as a loss"
    )]
    Lengths {
        /// The batch's first sample number.
        first_sample: u64,
        /// Number of input deltas.
        input: usize,
        /// Number of output deltas.
        output: usize,
    },
    /// Counts, time or sample numbers run out of their 64 bits.
    #[error(
        "the batch of sample {first_sample}: {quantity} leaves 64 bits after {samples} samples from {start}; drop the batch and count it as a loss"
    )]
    Range {
        /// The batch's first sample number.
        first_sample: u64,
        /// Which quantity.
        quantity: &'static str,
        /// Where it starts.
        start: i128,
        /// How many samples follow.
        samples: usize,
    },
}

impl LogError {
    pub(crate) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { action, path, source }
    }
}

/// What a person does about an error of the operating system.
fn advice(error: &io::Error) -> &'static str {
    use io::ErrorKind::*;
    // EIO has no stable kind of its own.
    const EIO: i32 = 5;
    match error.kind() {
        StorageFull => "the disk is full: free space or choose another directory with --out",
        QuotaExceeded => "the quota is used up: free space or choose another directory with --out",
        FileTooLarge => "the file reached the size limit: raise `ulimit -f` or record shorter runs",
        ReadOnlyFilesystem => "the file system is read-only: choose another directory with --out",
        PermissionDenied => "check the owner and the permissions",
        NotFound => "check the path",
        IsADirectory => "give a file, not a directory",
        _ if error.raw_os_error() == Some(EIO) => {
            "the disk reports a hardware error: check its cable and the kernel log (`dmesg`), record elsewhere"
        }
        _ => "check the disk and the kernel log (`dmesg`)",
    }
}

fn got(value: Option<&str>) -> String {
    value.map_or_else(|| "nothing".to_owned(), |value| format!("{value:?}"))
}

fn list(topics: &[String]) -> String {
    const SHOWN: usize = 8;
    match topics.len() {
        0 => "no channel at all".to_owned(),
        n if n > SHOWN => format!("{} and {} more", topics[..SHOWN].join(", "), n - SHOWN),
        _ => topics.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_named_with_path_place_bytes_and_next_step() {
        const ENOSPC: i32 = 28;
        let error = LogError::Write {
            path: "runs/a.mcap".into(),
            at_byte: 4096,
            wanted_bytes: 812,
            source: io::Error::from_raw_os_error(ENOSPC),
        };
        let text = error.to_string();
        for part in ["runs/a.mcap", "4096", "812", "No space left", "--out"] {
            assert!(text.contains(part), "{text}");
        }
    }

    #[test]
    fn foreign_topics_are_listed_but_not_by_the_hundred() {
        let topics: Vec<_> = (0..100).map(|n| format!("/t{n}")).collect();
        let text = LogError::NoRigChannels { path: "x".into(), topics }.to_string();
        assert!(text.contains("/t7") && text.contains("92 more") && !text.contains("/t8,"), "{text}");
    }
}
