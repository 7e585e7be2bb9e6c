//! The records of a file, chunks left whole, from any place on: where a step fails, another may be tried.

use std::io::{self, Read, Seek, SeekFrom};

use mcap::{
    McapError,
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

use crate::{
    completeness::Defect,
    record::{MAX_RECORD_BYTES, RECORD_HEAD_BYTES},
};

/// The file is read in blocks of this size.
const BLOCK_BYTES: u64 = 1 << 16;

/// A whole record and its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) opcode: u8,
    /// Where the record begins.
    pub(crate) at: u64,
    /// Where the next one begins.
    pub(crate) next: u64,
}

/// What stands at the reader's place.
#[derive(Debug)]
pub(crate) enum Step {
    /// A record; its content is in [`Records::content`].
    Record(Place),
    /// The end magic, and nothing after it.
    End,
    /// No record that can be used.
    Failed(McapError),
}

/// Reads records one after the other; memory grows with the largest record, not with the file.
pub(crate) struct Records<R> {
    source: R,
    file_bytes: u64,
    /// Up to where the file went into the reader.
    fed_to: u64,
    at: u64,
    reader: LinearReader,
    content: Vec<u8>,
}

impl<R: Read + Seek> Records<R> {
    /// Reads `source`, of `file_bytes` bytes, from its beginning; checksums of data and summary are checked.
    pub(crate) fn new(source: R, file_bytes: u64) -> io::Result<Self> {
        let mut records =
            Self { source, file_bytes, fed_to: 0, at: 0, reader: LinearReader::new(), content: Vec::new() };
        records.go_to(0, options(file_bytes).with_validate_data_section_crc(true))?;
        records.at = mcap::MAGIC.len() as u64;
        Ok(records)
    }

    /// Goes on at the record at `at`. The checksum of the data, whose beginning is then unknown, is not checked; that
    /// of the summary only from the end of the data on.
    pub(crate) fn restart(&mut self, at: u64) -> io::Result<()> {
        self.go_to(at, options(self.file_bytes).with_skip_start_magic(true))
    }

    /// The file has grown.
    pub(crate) fn grow(&mut self, file_bytes: u64) {
        self.file_bytes = self.file_bytes.max(file_bytes);
    }

    fn go_to(&mut self, at: u64, options: LinearReaderOptions) -> io::Result<()> {
        self.source.seek(SeekFrom::Start(at))?;
        (self.fed_to, self.at) = (at, at);
        self.reader = LinearReader::new_with_options(options);
        Ok(())
    }

    /// Where the next record begins.
    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    pub(crate) fn file_bytes(&self) -> u64 {
        self.file_bytes
    }

    pub(crate) fn source(&mut self) -> &mut R {
        &mut self.source
    }

    /// The content of the record that was read last.
    pub(crate) fn content(&self) -> &[u8] {
        &self.content
    }

    /// Reads the next record.
    pub(crate) fn step(&mut self) -> io::Result<Step> {
        loop {
            match self.reader.next_event() {
                None => return Ok(Step::End),
                Some(Ok(LinearReadEvent::ReadRequest(_))) => {}
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    self.content.clear();
                    self.content.extend_from_slice(data);
                    let next = self.at + RECORD_HEAD_BYTES + data.len() as u64;
                    let place = Place { opcode, at: self.at, next };
                    self.at = next;
                    return Ok(Step::Record(place));
                }
                Some(Err(error)) => return Ok(Step::Failed(error)),
            }
            self.feed()?;
        }
    }

    /// Gives the reader the next block, whatever a length in the file makes it ask for.
    fn feed(&mut self) -> io::Result<()> {
        let block = self.file_bytes.saturating_sub(self.fed_to).min(BLOCK_BYTES) as usize;
        let room = self.reader.insert(block);
        let taken = loop {
            match self.source.read(room) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                result => break result?,
            }
        };
        // None tells the reader that the file ends here.
        self.reader.notify_read(taken);
        self.fed_to += taken as u64;
        Ok(())
    }

    /// What is wrong with the record at this place, where [`Records::step`] failed with `error`.
    pub(crate) fn defect(&mut self, error: &McapError) -> io::Result<Defect> {
        let left_bytes = self.file_bytes.saturating_sub(self.at);
        let (opcode, length) = match *error {
            McapError::BadDataCrc { saved, calculated } => return Ok(mismatch("data", saved, calculated)),
            McapError::BadSummaryCrc { saved, calculated } => return Ok(mismatch("summary", saved, calculated)),
            McapError::RecordTooLarge { opcode, len } => (opcode, len),
            McapError::UnexpectedEof if left_bytes == 0 => return Ok(Defect::NoEnd),
            McapError::UnexpectedEof if left_bytes < RECORD_HEAD_BYTES => {
                return Ok(Defect::Cut { opcode: 0, wanted_bytes: RECORD_HEAD_BYTES, left_bytes });
            }
            McapError::UnexpectedEof => {
                let mut head = [0; RECORD_HEAD_BYTES as usize];
                self.source.seek(SeekFrom::Start(self.at))?;
                match self.source.read_exact(&mut head) {
                    // A file that shrinks under its reader is cut.
                    Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(Defect::NoEnd),
                    result => result?,
                }
                let [opcode, length @ ..] = head;
                (opcode, u64::from_le_bytes(length))
            }
            _ => return Ok(Defect::Malformed { record: "file", field: "record" }),
        };
        let wanted_bytes = length.saturating_add(RECORD_HEAD_BYTES);
        if wanted_bytes > left_bytes {
            return Ok(Defect::Cut { opcode, wanted_bytes, left_bytes });
        }
        Ok(Defect::TooLarge { what: "a record", bytes: length, limit: MAX_RECORD_BYTES as u64 })
    }
}

fn options(file_bytes: u64) -> LinearReaderOptions {
    // No record is larger than its file: what says so is not waited for.
    let limit = usize::try_from(file_bytes).unwrap_or(usize::MAX).min(MAX_RECORD_BYTES);
    LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_check_finishes_after_end_magic(true)
        .with_validate_summary_section_crc(true)
        .with_record_length_limit(limit)
}

fn mismatch(what: &'static str, expected: u32, found: u32) -> Defect {
    Defect::Checksum { what, expected, found }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use mcap::records::op;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_length_beyond_the_file_takes_no_memory() {
        let mut bytes = mcap::MAGIC.to_vec();
        bytes.push(op::ATTACHMENT);
        bytes.extend(u64::MAX.to_le_bytes());
        let mut records = Records::new(Cursor::new(&bytes), bytes.len() as u64).unwrap();
        let Step::Failed(error) = records.step().unwrap() else { panic!("no record stands there") };
        let defect = records.defect(&error).unwrap();
        assert!(matches!(defect, Defect::Cut { opcode: op::ATTACHMENT, .. }), "{defect}");
    }

    proptest! {
        #[test]
        fn any_bytes_are_stepped_through_without_panic(noise in prop::collection::vec(any::<u8>(), 0..200)) {
            let bytes = [mcap::MAGIC, &noise].concat();
            let mut records = Records::new(Cursor::new(&bytes), bytes.len() as u64).unwrap();
            loop {
                match records.step().unwrap() {
                    Step::Record(place) => prop_assert!(place.next > place.at && place.next <= bytes.len() as u64),
                    Step::End => break,
                    Step::Failed(error) => {
                        let _ = records.defect(&error).unwrap();
                        break;
                    }
                }
            }
        }
    }
}
