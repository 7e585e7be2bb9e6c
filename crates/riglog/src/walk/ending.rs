//! The end of a file: checksums of data and summary, counts, footer and magic.

use std::io::{Read, Seek};

use super::{Section, Walk};
use crate::{
    completeness::Defect,
    container::{
        MAGIC,
        bytes::Fields,
        op,
        scan::{Place, Step},
    },
    error::LogError,
};

impl<R: Read + Seek> Walk<R> {
    /// Checks the data's checksum; the summary follows.
    pub(super) fn end_of_data(&mut self) {
        let expected = Fields::new("data end", self.scanner.content()).u32("checksum");
        let found = self.crc.clone().finalize();
        match expected {
            Ok(expected) if expected != 0 && expected != found => {
                let defect = Defect::Checksum { what: "data", expected, found };
                self.completeness.add_damage(self.data_end_at, defect);
            }
            Ok(_) => {}
            Err(defect) => self.completeness.add_damage(self.data_end_at, defect),
        }
        self.section = Section::Summary;
        self.crc = crc32fast::Hasher::new();
    }

    /// Reads a record of the summary section.
    pub(super) fn summary_record(&mut self) -> Result<(), LogError> {
        let at = self.scanner.at();
        match self.scanner.step() {
            Ok(Step::Record(place)) => {
                if place.opcode == op::FOOTER {
                    self.footer(place)?;
                    return Ok(());
                }
                if place.opcode == op::STATISTICS {
                    let stated = Fields::new("statistics", self.scanner.content()).u64("messages");
                    self.stated_messages = stated.ok();
                }
                self.crc.update(self.scanner.head());
                self.crc.update(self.scanner.content());
            }
            Ok(Step::End) => {
                self.completeness.add_truncation(at, Defect::NoEnd);
                self.section = Section::Over;
            }
            Ok(Step::Lost(defect)) => {
                self.completeness.add_truncation(at, defect);
                self.section = Section::Over;
            }
            Err(error) => self.read_error(at, error)?,
        }
        Ok(())
    }

    fn footer(&mut self, place: Place) -> Result<(), LogError> {
        self.section = Section::Over;
        let content = self.scanner.content();
        let mut fields = Fields::new("footer", content);
        let stated = fields
            .bytes("summary and offset start", 16)
            .and_then(|_| fields.u32("checksum").map(|crc| (crc, fields.rest().len())));
        match stated {
            Ok((expected, 0)) => {
                self.crc.update(self.scanner.head());
                self.crc.update(&content[..16]);
                let found = self.crc.clone().finalize();
                if expected != 0 && expected != found {
                    let defect = Defect::Checksum { what: "summary", expected, found };
                    self.completeness.add_damage(place.at, defect);
                }
            }
            Ok(_) => {
                let defect = Defect::Malformed { record: "footer", field: "end" };
                self.completeness.add_damage(place.at, defect);
            }
            Err(defect) => self.completeness.add_damage(place.at, defect),
        }
        let found: u64 = self.counts.iter().sum();
        if let Some(stated) = self.stated_messages.filter(|&stated| stated != found) {
            self.completeness.add_damage(place.at, Defect::MessageCount { stated, found });
        }
        let magic = self.scanner.raw().map_err(LogError::io("read", &self.path))?;
        match magic.as_ref() {
            None => self.completeness.add_truncation(place.next, Defect::NoEnd),
            Some(MAGIC) => self.has_end = true,
            Some(_) => {
                let defect = Defect::Malformed { record: "file", field: "end magic" };
                self.completeness.add_damage(place.next, defect);
            }
        }
        let bytes = self.scanner.file_bytes() - self.scanner.at();
        if magic.is_some() && bytes > 0 {
            self.completeness.add_damage(self.scanner.at(), Defect::Trailing { bytes });
        }
        Ok(())
    }
}
