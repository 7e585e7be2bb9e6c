//! Finds the next chunk of a file where its records do not lead on.

use std::io::{self, Read, Seek, SeekFrom};

use mcap::records::op;

use crate::record::RECORD_HEAD_BYTES;

/// A chunk's times, size and checksum stand before the name of its compression.
const NAME_LENGTH_AT: usize = RECORD_HEAD_BYTES as usize + 8 + 8 + 8 + 4;
/// Names are `zstd`, `lz4` or empty.
const LONGEST_NAME: usize = 8;
/// A chunk record up to its compressed bytes.
const HEADER_BYTES: usize = NAME_LENGTH_AT + 4 + LONGEST_NAME + 8;
const WINDOW_BYTES: u64 = 1 << 20;

/// The place of the first chunk at or after `from` whose lengths agree with each other and fit into the file. Whether
/// it really is a chunk its checksum tells.
pub(super) fn next_chunk<R: Read + Seek>(source: &mut R, from: u64, file_bytes: u64) -> io::Result<Option<u64>> {
    let (mut window, mut start) = (Vec::new(), from);
    while start + (HEADER_BYTES as u64) <= file_bytes {
        source.seek(SeekFrom::Start(start))?;
        window.clear();
        source.by_ref().take(WINDOW_BYTES).read_to_end(&mut window)?;
        if window.len() < HEADER_BYTES {
            break;
        }
        for (offset, header) in window.windows(HEADER_BYTES).enumerate() {
            let at = start + offset as u64;
            if header[0] == op::CHUNK && record_bytes(header).is_some_and(|bytes| bytes <= file_bytes - at) {
                return Ok(Some(at));
            }
        }
        // Windows overlap by what a header needs.
        start += (window.len() - HEADER_BYTES) as u64 + 1;
    }
    Ok(None)
}

/// The length of a chunk record, head included, where its two lengths agree.
fn record_bytes(header: &[u8]) -> Option<u64> {
    let long = |at: usize| Some(u64::from_le_bytes(*header.get(at..)?.first_chunk()?));
    let name_bytes = u32::from_le_bytes(*header.get(NAME_LENGTH_AT..)?.first_chunk()?) as usize;
    if name_bytes > LONGEST_NAME {
        return None;
    }
    let data_at = NAME_LENGTH_AT + 4 + name_bytes + 8;
    let bytes = long(data_at - 8)?.checked_add(data_at as u64)?;
    (long(1)?.checked_add(RECORD_HEAD_BYTES)? == bytes).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn chunk_at(at: usize, name: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0xA5; at];
        let data = [7; 30];
        bytes.push(op::CHUNK);
        bytes.extend((28 + 4 + name.len() as u64 + 8 + data.len() as u64).to_le_bytes());
        bytes.extend([1; 28]);
        bytes.extend((name.len() as u32).to_le_bytes());
        bytes.extend(name);
        bytes.extend((data.len() as u64).to_le_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn the_next_chunk_is_found_across_windows_whatever_its_compression() {
        for at in [0, 1, 40, (1 << 20) - 60, (1 << 20) - 20, (1 << 20) + 3] {
            for name in [&b"zstd"[..], b"lz4", b""] {
                let bytes = chunk_at(at, name);
                let found = next_chunk(&mut Cursor::new(&bytes), 0, bytes.len() as u64).unwrap();
                assert_eq!(found, Some(at as u64), "{name:?}");
            }
        }
    }

    #[test]
    fn a_chunk_that_is_cut_is_none() {
        let bytes = chunk_at(40, b"zstd");
        let cut = bytes.len() as u64 - 1;
        assert_eq!(next_chunk(&mut Cursor::new(&bytes), 0, cut).unwrap(), None);
    }
}
