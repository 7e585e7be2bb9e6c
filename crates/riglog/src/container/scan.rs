//! Steps from record to record through a file, and finds the next chunk where the steps are lost.

use std::io::{self, Read, Seek, SeekFrom};

use crate::{
    completeness::Defect,
    container::{MAX_RECORD_BYTES, RECORD_HEAD_BYTES, chunk::ChunkView, op},
};

/// A whole record and its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) opcode: u8,
    /// Where the record begins.
    pub(crate) at: u64,
    /// Where the next one begins.
    pub(crate) next: u64,
}

/// What stands at the scanner's place.
#[derive(Debug)]
pub(crate) enum Step {
    /// A record; its content is in [`Scanner::content`].
    Record(Place),
    /// The file ends between two records.
    End,
    /// No whole record stands here.
    Lost(Defect),
}

/// Reads records one after the other; memory grows with the largest record, not with the file.
#[derive(Debug)]
pub(crate) struct Scanner<R> {
    source: R,
    at: u64,
    file_bytes: u64,
    content: Vec<u8>,
    head: [u8; RECORD_HEAD_BYTES as usize],
}

impl<R: Read + Seek> Scanner<R> {
    /// Scans `source`, of `file_bytes` bytes, from its current place `at`.
    pub(crate) fn new(source: R, at: u64, file_bytes: u64) -> Self {
        Self { source, at, file_bytes, content: Vec::new(), head: [0; 9] }
    }

    /// Where the next record begins.
    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    pub(crate) fn file_bytes(&self) -> u64 {
        self.file_bytes
    }

    /// The content of the record that was read last.
    pub(crate) fn content(&self) -> &[u8] {
        &self.content
    }

    /// Opcode and length of the record that was read last, for checksums over whole records.
    pub(crate) fn head(&self) -> &[u8] {
        &self.head
    }

    /// Reads the next record.
    pub(crate) fn step(&mut self) -> io::Result<Step> {
        let left_bytes = self.file_bytes.saturating_sub(self.at);
        if left_bytes == 0 {
            return Ok(Step::End);
        }
        let cut = |opcode, wanted_bytes| Defect::Cut { opcode, wanted_bytes, left_bytes };
        if left_bytes < RECORD_HEAD_BYTES {
            return Ok(Step::Lost(cut(0, RECORD_HEAD_BYTES)));
        }
        let mut head = [0; RECORD_HEAD_BYTES as usize];
        self.source.read_exact(&mut head)?;
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        if length > left_bytes - RECORD_HEAD_BYTES {
            return Ok(Step::Lost(cut(opcode, length.saturating_add(RECORD_HEAD_BYTES))));
        }
        if length > MAX_RECORD_BYTES {
            let (what, limit) = ("a record", MAX_RECORD_BYTES);
            return Ok(Step::Lost(Defect::TooLarge { what, bytes: length, limit }));
        }
        // Checked against the bytes that the file has, so the memory taken is bounded by them.
        self.content.resize(length as usize, 0);
        self.source.read_exact(&mut self.content)?;
        self.head = head;
        let place = Place { opcode, at: self.at, next: self.at + RECORD_HEAD_BYTES + length };
        self.at = place.next;
        Ok(Step::Record(place))
    }

    /// Reads `N` raw bytes, as the magic at the end; `None` where the file has fewer.
    pub(crate) fn raw<const N: usize>(&mut self) -> io::Result<Option<[u8; N]>> {
        if self.file_bytes.saturating_sub(self.at) < N as u64 {
            return Ok(None);
        }
        let mut bytes = [0; N];
        self.source.read_exact(&mut bytes)?;
        self.at += N as u64;
        Ok(Some(bytes))
    }

    /// Goes on at `place`.
    pub(crate) fn seek(&mut self, place: u64) -> io::Result<()> {
        self.source.seek(SeekFrom::Start(place))?;
        self.at = place;
        Ok(())
    }

    /// Goes to the first chunk after `from` whose header fits into the file; false where there is
    /// none. Whether it really is a chunk its checksum tells.
    pub(crate) fn resync(&mut self, from: u64) -> io::Result<bool> {
        // A chunk record up to the name of its compression, which is what is looked for.
        const NAME: &[u8] = b"\x04\0\0\0zstd";
        const NAME_AT: usize = RECORD_HEAD_BYTES as usize + 8 + 8 + 8 + 4;
        const HEADER: usize = NAME_AT + NAME.len() + 8;
        const WINDOW: usize = 1 << 20;
        let (mut window, mut start) = (Vec::new(), from);
        while start + (HEADER as u64) <= self.file_bytes {
            self.seek(start)?;
            window.clear();
            self.source.by_ref().take(WINDOW as u64).read_to_end(&mut window)?;
            if window.len() < HEADER {
                break;
            }
            let last = window.len() - HEADER;
            for offset in 0..=last {
                let header = &window[offset..offset + HEADER];
                if header[0] == op::CHUNK
                    && &header[NAME_AT..NAME_AT + NAME.len()] == NAME
                    && self.fits(start + offset as u64, header)
                {
                    self.seek(start + offset as u64)?;
                    return Ok(true);
                }
            }
            // Windows overlap by what a header needs.
            start += last as u64 + 1;
        }
        self.seek(self.file_bytes)?;
        Ok(false)
    }

    fn fits(&self, at: u64, header: &[u8]) -> bool {
        let field = |from: usize| {
            let bytes: [u8; 8] = header[from..from + 8].try_into().unwrap_or_default();
            u64::from_le_bytes(bytes)
        };
        let length = field(1);
        let records = field(header.len() - 8);
        let header_content = header.len() as u64 - RECORD_HEAD_BYTES;
        length <= (self.file_bytes - at).saturating_sub(RECORD_HEAD_BYTES)
            && length <= MAX_RECORD_BYTES
            && Some(length) == records.checked_add(header_content)
            && field(25) <= MAX_RECORD_BYTES
    }

    /// The content of the record at `place`, which was read before; for going back to a chunk.
    pub(crate) fn reread(&mut self, place: u64) -> io::Result<Step> {
        self.seek(place)?;
        self.step()
    }

    /// The last record as a chunk.
    pub(crate) fn chunk(&self) -> Result<ChunkView<'_>, Defect> {
        ChunkView::parse(&self.content)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use proptest::prelude::*;

    use super::*;
    use crate::container::{
        bytes::Put,
        chunk::{ChunkBuilder, ChunkCompressor},
    };

    fn chunk_at(at: usize, mut bytes: Vec<u8>) -> Vec<u8> {
        bytes.resize(at, 0xA5);
        let mut builder = ChunkBuilder::default();
        builder.add(1, 0, 5, 5, |out| out.put_u64(77));
        builder.encode(&mut ChunkCompressor::new(1).unwrap(), 0, &mut bytes).unwrap();
        bytes
    }

    fn scanner(bytes: &[u8]) -> Scanner<Cursor<&[u8]>> {
        Scanner::new(Cursor::new(bytes), 0, bytes.len() as u64)
    }

    #[test]
    fn the_next_chunk_is_found_across_windows() {
        for at in [0, 1, 40, (1 << 20) - 60, (1 << 20) - 20, (1 << 20) + 3] {
            let bytes = chunk_at(at, Vec::new());
            let mut scanner = scanner(&bytes);
            assert!(scanner.resync(0).unwrap(), "chunk at {at}");
            assert_eq!(scanner.at(), at as u64);
            assert!(matches!(scanner.step().unwrap(), Step::Record(Place { opcode: op::CHUNK, .. })));
            assert!(scanner.chunk().is_ok());
        }
    }

    #[test]
    fn a_length_beyond_the_file_takes_no_memory() {
        let mut bytes = vec![op::ATTACHMENT];
        bytes.put_u64(u64::MAX);
        let step = scanner(&bytes).step().unwrap();
        assert!(matches!(step, Step::Lost(Defect::Cut { opcode: op::ATTACHMENT, .. })));
    }

    proptest! {
        #[test]
        fn any_bytes_are_stepped_through_without_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let mut scanner = scanner(&bytes);
            while let Step::Record(place) = scanner.step().unwrap() {
                prop_assert!(place.next > place.at && place.next <= bytes.len() as u64);
                let _ = scanner.chunk();
            }
            let _ = scanner.resync(0).unwrap();
        }
    }
}
