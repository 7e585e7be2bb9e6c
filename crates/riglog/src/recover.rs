//! Finalises what a killed writer left: keeps every whole record where it is, cuts off what is not whole, and
//! appends the end that is missing.

use std::{
    fs::{File, OpenOptions, TryLockError},
    io::{BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use zstd::bulk::Decompressor;

use crate::{
    completeness::{Completeness, Defect},
    container::{
        MAGIC, RECORD_HEAD_BYTES,
        bytes::Fields,
        chunk::{ChunkIndex, InnerRecord, MessageIndexes, MessageView, put_indexes},
        op,
        scan::Scanner,
        summary::TAIL_BYTES,
    },
    error::LogError,
    reader::{check_channels, open},
    walk::Walk,
};

/// What [`recover()`] did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recovery {
    /// The file.
    pub path: PathBuf,
    /// It had its end already and was not touched.
    pub already_complete: bool,
    /// Messages in the file.
    pub kept_messages: u64,
    /// Bytes that belonged to no whole record, or to an end that broke off, and were cut off.
    pub dropped_bytes: u64,
    /// What was found. `Truncated` is what a killed writer leaves; damage stays in the file, left out of its index.
    pub found: Completeness,
}

/// A file of a directory and what became of it.
pub type RecoveredFile = (PathBuf, Result<Recovery, LogError>);

/// Gives a log that was cut off its end, in place: nothing that is whole is moved or copied, so a crash in the
/// middle leaves a file that can be recovered again. A file that has an end is left as it is.
///
/// # Errors
/// Another process writes the file, it is no rig log, not even its head is whole, or it cannot be written.
pub fn recover(path: impl AsRef<Path>) -> Result<Recovery, LogError> {
    let path = path.as_ref();
    if let Some(kept_messages) = messages_by_footer(path)? {
        return Ok(Recovery {
            path: path.to_owned(),
            already_complete: true,
            kept_messages,
            dropped_bytes: 0,
            found: Completeness::Complete,
        });
    }
    let file = OpenOptions::new().read(true).write(true).open(path).map_err(LogError::io("open", path))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Err(LogError::Locked { path: path.to_owned() }),
        Err(TryLockError::Error(source)) => return Err(LogError::io("lock", path)(source)),
    }
    finalise(file, path)
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
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
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

/// Number of messages of a file whose summary is whole, found at its end without reading its data.
fn messages_by_footer(path: &Path) -> Result<Option<u64>, LogError> {
    let (mut source, bytes) = open(path)?;
    let io = |source| LogError::Io { action: "read", path: path.to_owned(), source };
    if bytes < MAGIC.len() as u64 + TAIL_BYTES {
        return Ok(None);
    }
    let mut tail = [0; TAIL_BYTES as usize];
    source.seek(SeekFrom::Start(bytes - TAIL_BYTES)).map_err(io)?;
    source.read_exact(&mut tail).map_err(io)?;
    let Some(footer) = tail.strip_suffix(MAGIC).filter(|footer| footer[0] == op::FOOTER) else {
        return Ok(None);
    };
    let mut fields = Fields::new("footer", &footer[RECORD_HEAD_BYTES as usize..]);
    let (Ok(summary_at), Ok(_), Ok(crc)) =
        (fields.u64("summary start"), fields.u64("offset start"), fields.u32("checksum"))
    else {
        return Ok(None);
    };
    const LARGEST_SUMMARY: u64 = 64 << 20;
    let crc_at = bytes - MAGIC.len() as u64 - 4;
    if summary_at >= crc_at || crc_at - summary_at > LARGEST_SUMMARY {
        return Ok(None);
    }
    let mut summary = vec![0; (crc_at - summary_at) as usize];
    source.seek(SeekFrom::Start(summary_at)).map_err(io)?;
    source.read_exact(&mut summary).map_err(io)?;
    if crc32fast::hash(&summary) != crc {
        return Ok(None);
    }
    let mut offset = 0;
    while let Ok(Some(record)) = InnerRecord::at(&summary, offset) {
        if record.opcode == op::STATISTICS {
            return Ok(Fields::new("statistics", record.content).u64("messages").ok());
        }
        offset = record.next;
    }
    Ok(None)
}

fn finalise(mut file: File, path: &Path) -> Result<Recovery, LogError> {
    let read = LogError::io("read", path);
    let bytes = file.metadata().map_err(read)?.len();
    let reader = |file: &File| -> Result<_, LogError> {
        let mut source = BufReader::new(file.try_clone().map_err(LogError::io("open", path))?);
        source.seek(SeekFrom::Start(0)).map_err(LogError::io("read", path))?;
        Ok(source)
    };
    // A foreign file is none of ours to touch.
    check_channels(Walk::new(reader(&file)?, bytes, path)?)?;
    let mut walk = Walk::new(reader(&file)?, bytes, path)?;
    while walk.next()?.is_some() {}
    let found = walk.completeness().cloned().unwrap_or(Completeness::Complete);
    let (has_end, data_end_at) = (walk.has_end(), walk.data_end_at());
    if !has_end && !walk.channels().any(|(_, channel)| channel.topic.is_some()) {
        return Err(LogError::NothingToRecover { path: path.to_owned(), why: Defect::NoHead { bytes } });
    }
    let mut summary = walk.into_summary();
    let kept_messages = summary.messages();
    if has_end {
        return Ok(Recovery { path: path.to_owned(), already_complete: true, kept_messages, dropped_bytes: 0, found });
    }
    // The writer may have been cut off between a chunk and its indexes: they are made anew.
    let (mut keep, mut end) = (data_end_at, Vec::new());
    if let Some(chunk) = summary.chunks.last_mut()
        && chunk.offset + chunk.length + chunk.indexes_length == data_end_at
    {
        let indexes = indexes_of(chunk, reader(&file)?, bytes, path)?;
        if indexes.len() != chunk.index_offsets.len() {
            keep = chunk.offset + chunk.length;
            chunk.index_offsets = put_indexes(&indexes, keep, &mut end);
            chunk.indexes_length = end.len() as u64;
        }
    }
    let crc = checksum(reader(&file)?, keep, &end, path)?;
    let data_length = keep + end.len() as u64;
    end.extend(summary.encode_end(data_length, crc));
    append(&mut file, path, keep, &end)?;
    Ok(Recovery {
        path: path.to_owned(),
        already_complete: false,
        kept_messages,
        dropped_bytes: bytes - data_end_at,
        found,
    })
}

/// Where the messages of a chunk lie, read from the chunk itself.
fn indexes_of<R: Read + Seek>(
    chunk: &ChunkIndex,
    source: R,
    bytes: u64,
    path: &Path,
) -> Result<MessageIndexes, LogError> {
    let io = |source| LogError::Io { action: "read", path: path.to_owned(), source };
    let mut scanner = Scanner::new(source, 0, bytes);
    scanner.reread(chunk.offset).map_err(io)?;
    let mut zstd = Decompressor::new().map_err(io)?;
    let (mut records, mut indexes, mut offset) = (Vec::new(), MessageIndexes::new(), 0);
    // The chunk was read before; what does not decode now is not indexed.
    if let Ok(view) = scanner.chunk() {
        let _ = view.decompress(&mut zstd, &mut records);
    }
    while let Ok(Some(record)) = InnerRecord::at(&records, offset) {
        if record.opcode == op::MESSAGE
            && let Ok(message) = MessageView::parse(record.content)
        {
            indexes.entry(message.channel).or_default().push((message.log_time_ns, offset as u64));
        }
        offset = record.next;
    }
    Ok(indexes)
}

/// Checksum of the first `keep` bytes of the file and of `more`.
fn checksum<R: Read>(source: R, keep: u64, more: &[u8], path: &Path) -> Result<u32, LogError> {
    let mut source = source.take(keep);
    let mut crc = crc32fast::Hasher::new();
    let mut block = vec![0; 1 << 16];
    loop {
        let taken = source.read(&mut block).map_err(LogError::io("read", path))?;
        if taken == 0 {
            break;
        }
        crc.update(&block[..taken]);
    }
    crc.update(more);
    Ok(crc.finalize())
}

/// Replaces what follows byte `keep` by `end`. A crash before the sync leaves a prefix of that, which recovers again.
fn append(file: &mut File, path: &Path, keep: u64, end: &[u8]) -> Result<(), LogError> {
    file.set_len(keep).map_err(LogError::io("cut", path))?;
    file.seek(SeekFrom::Start(keep)).map_err(LogError::io("write", path))?;
    if let Err(source) = file.write_all(end) {
        // What is whole stays; half an end would only be cut off again.
        let _ = file.set_len(keep);
        let wanted_bytes = end.len() as u64;
        return Err(LogError::Write { path: path.to_owned(), at_byte: keep, wanted_bytes, source });
    }
    file.sync_all().map_err(LogError::io("sync", path))
}
