//! Finalises what a killed writer left: copies every record that can be read into a log with an end, which then takes
//! the file's name.

use std::{
    ffi::OsString,
    fs::{File, OpenOptions, TryLockError},
    io::{self, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use mcap::{
    Attachment, McapError,
    records::{Metadata, Record, op},
};

use crate::{
    completeness::{Completeness, Defect},
    error::LogError,
    reader::{check_channels, open},
    record::{RECORD_HEAD_BYTES, parse},
    walk::{
        Event, Walk,
        records::{Records, Step},
    },
    write::{
        WriterOptions,
        encoder::{Encoder, io_error},
        sync_directory_of,
    },
};

/// Footer record and end magic.
const TAIL_BYTES: u64 = RECORD_HEAD_BYTES + FOOTER_BYTES as u64 + mcap::MAGIC.len() as u64;
const FOOTER_BYTES: usize = 8 + 8 + 4;
/// The record that ends the data, right before the summary.
const DATA_END_BYTES: u64 = RECORD_HEAD_BYTES + 4;
/// Messages outside of chunks are gathered into chunks of this size.
const CHUNK_BYTES: usize = 1 << 20;

/// What [`recover()`] did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recovery {
    /// The file.
    pub path: PathBuf,
    /// It had its end already and was not touched.
    pub already_complete: bool,
    /// Messages in the file.
    pub kept_messages: u64,
    /// Bytes that belonged to no whole record, or to an end that broke off, and were left out.
    pub dropped_bytes: u64,
    /// What was found. `Truncated` is what a killed writer leaves. Where it is `Damaged`, the file as it was is kept
    /// beside the recovered one, under its name with `.damaged` added.
    pub found: Completeness,
}

/// A file of a directory and what became of it.
pub type RecoveredFile = (PathBuf, Result<Recovery, LogError>);

/// Gives a log that was cut off its end: what can be read of it is copied to a file beside it, which takes its name
/// once it is whole and on the disk. A crash in the middle leaves the file as it was. A file that has an end is left
/// as it is.
///
/// # Errors
/// Another process writes the file, it is no rig log, not even its head is whole, or there is no room for the copy.
pub fn recover(path: impl AsRef<Path>) -> Result<Recovery, LogError> {
    let path = path.as_ref();
    if let Some(kept_messages) = messages_by_footer(path)? {
        return Ok(untouched(path, kept_messages, Completeness::Complete));
    }
    // Opened for writing, though it is not written: who may not change the log may not replace it.
    let file = OpenOptions::new().read(true).write(true).open(path).map_err(LogError::io("open", path))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Err(LogError::Locked { path: path.to_owned() }),
        Err(TryLockError::Error(source)) => return Err(LogError::io("lock", path)(source)),
    }
    // Whoever held the lock until now may have finished the file, or put another in its place.
    if let Some(kept_messages) = messages_by_footer(path)? {
        return Ok(untouched(path, kept_messages, Completeness::Complete));
    }
    finalise(path)
}

/// Recovers every `*.mcap` file in a directory, each by itself: one that cannot be recovered does not keep the
/// others from it. A directory that does not exist holds none.
///
/// # Errors
/// The directory cannot be listed.
pub fn recover_directory(directory: impl AsRef<Path>) -> Result<Vec<RecoveredFile>, LogError> {
    let directory = directory.as_ref();
    let entries = match std::fs::read_dir(directory) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(LogError::io("list", directory)(error)),
    };
    let mut paths = Vec::new();
    for entry in entries {
        let path = entry.map_err(LogError::io("list", directory))?.path();
        if path.extension().is_some_and(|extension| extension == "mcap") && path.is_file() {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths.into_iter().map(|path| (path.clone(), recover(&path))).collect())
}

fn untouched(path: &Path, kept_messages: u64, found: Completeness) -> Recovery {
    Recovery { path: path.to_owned(), already_complete: true, kept_messages, dropped_bytes: 0, found }
}

/// Number of messages of a file whose summary is whole, found at its end without reading its data.
fn messages_by_footer(path: &Path) -> Result<Option<u64>, LogError> {
    let (mut source, bytes) = open(path)?;
    let io = |source| LogError::Io { action: "read", path: path.to_owned(), source };
    let Some(tail_at) = bytes.checked_sub(TAIL_BYTES) else { return Ok(None) };
    let mut footer = [0; RECORD_HEAD_BYTES as usize + FOOTER_BYTES];
    source.seek(SeekFrom::Start(tail_at)).map_err(io)?;
    source.read_exact(&mut footer).map_err(io)?;
    let (head, footer) = footer.split_at(RECORD_HEAD_BYTES as usize);
    let Ok(Record::Footer(footer)) = parse(op::FOOTER, footer) else { return Ok(None) };
    let data_end_at = footer.summary_start.checked_sub(DATA_END_BYTES);
    let Some(data_end_at) = data_end_at.filter(|at| head[0] == op::FOOTER && *at < tail_at) else { return Ok(None) };
    // From the end of the data on, checksum and end magic of the summary are checked.
    let mut records = Records::new(source, bytes).map_err(io)?;
    records.restart(data_end_at).map_err(io)?;
    let (mut messages, mut first) = (None, true);
    loop {
        match records.step().map_err(io)? {
            Step::Record(place) if first && place.opcode != op::DATA_END => return Ok(None),
            Step::Record(place) if place.opcode == op::STATISTICS => {
                if let Ok(Record::Statistics(statistics)) = parse(op::STATISTICS, records.content()) {
                    messages = Some(statistics.message_count);
                }
            }
            Step::Record(_) => {}
            Step::End => return Ok(messages),
            Step::Failed(_) => return Ok(None),
        }
        first = false;
    }
}

fn finalise(path: &Path) -> Result<Recovery, LogError> {
    let (source, bytes) = open(path)?;
    // A foreign file is none of ours to touch.
    check_channels(Walk::new(source, bytes, path)?)?;
    let mut walk = Walk::new(open(path)?.0, bytes, path)?;
    while walk.next()?.is_some() {}
    let found = walk.completeness().cloned().unwrap_or(Completeness::Complete);
    let kept_messages = walk.channels().map(|channel| channel.messages).sum();
    if walk.has_end() {
        return Ok(untouched(path, kept_messages, found));
    }
    if !walk.channels().any(|channel| channel.topic.is_some()) {
        return Err(LogError::NothingToRecover { path: path.to_owned(), why: Defect::NoHead { bytes } });
    }
    let copy = beside(path, ".recovering");
    let copied = copy_to(&copy, path, &walk).and_then(|()| {
        if let Completeness::Damaged { .. } = found {
            keep_damaged(path)?;
        }
        std::fs::rename(&copy, path).map_err(LogError::io("replace", path))
    });
    if copied.is_err() {
        // The log is as it was; half a copy would only take room.
        let _ = std::fs::remove_file(&copy);
    }
    copied?;
    sync_directory_of(path);
    let dropped_bytes = bytes - walk.data_end_at();
    Ok(Recovery { path: path.to_owned(), already_complete: false, kept_messages, dropped_bytes, found })
}

/// Writes what can be read of the log at `path` to `copy`, chunk by chunk, and syncs it; `seen` has walked over it.
fn copy_to(copy: &Path, path: &Path, seen: &Walk<BufReader<File>>) -> Result<(), LogError> {
    let io = |action| move |source| LogError::Io { action, path: copy.to_owned(), source };
    let encode = |error: McapError| LogError::Compress { path: path.to_owned(), bytes: 0, source: io_error(error) };
    let mut out = File::create(copy).map_err(io("create"))?;
    let level = WriterOptions::new("").compression_level;
    let channels = seen.channels().map(|channel| channel.definition.clone()).collect();
    let mut encoder = Encoder::new(seen.library(), level, channels).map_err(encode)?;
    let (source, bytes) = open(path)?;
    let mut walk = Walk::new(source, bytes, path)?;
    let (mut of_chunk, mut gathered_bytes) = (0, 0);
    while let Some(event) = walk.next()? {
        match event {
            Event::Message { chunk_at, in_chunk, message, .. } => {
                // A chunk stays a chunk, so that it is as long in time as its writer wanted it.
                if (in_chunk && chunk_at != of_chunk) || gathered_bytes >= CHUNK_BYTES {
                    encoder.close_chunk().map_err(encode)?;
                    gathered_bytes = 0;
                }
                of_chunk = chunk_at;
                gathered_bytes += message.data.len();
                encoder.message(&message.header, message.data).map_err(encode)?;
            }
            Event::Metadata { name, map } => {
                encoder.metadata(&Metadata { name, metadata: map }).map_err(encode)?;
            }
            Event::Attachment { header, data } => {
                let (name, media_type, data) = (header.name, header.media_type, data.into());
                let (log_time, create_time) = (header.log_time, header.create_time);
                let attachment = Attachment { log_time, create_time, name, media_type, data };
                encoder.attachment(&attachment).map_err(encode)?;
            }
        }
        let records = encoder.take();
        if !records.is_empty() {
            out.write_all(&records).map_err(io("write"))?;
        }
    }
    let (end, _) = encoder.finish().map_err(encode)?;
    out.write_all(&end).map_err(io("write"))?;
    let facts = std::fs::metadata(path).map_err(LogError::io("read", path))?;
    out.set_permissions(facts.permissions()).map_err(io("set permissions of"))?;
    out.sync_all().map_err(io("sync"))
}

/// Gives a damaged file a second name, so that what the recovery leaves out of it is not lost.
fn keep_damaged(path: &Path) -> Result<(), LogError> {
    let mut number = 1;
    loop {
        let suffix = if number == 1 { ".damaged".to_owned() } else { format!(".damaged{number}") };
        let kept = beside(path, &suffix);
        match std::fs::hard_link(path, &kept) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => number += 1,
            // File systems without links get a copy.
            Err(_) => return std::fs::copy(path, &kept).map(drop).map_err(LogError::io("copy", &kept)),
            Ok(()) => return Ok(()),
        }
    }
}

/// The path with `suffix` added to its name; no log's, whose name would end in `.mcap`.
fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(suffix);
    name.into()
}
