//! Fields of records: appended to a vector, and taken from a slice whose lengths are never trusted.

use std::collections::BTreeMap;

use crate::{completeness::Defect, container::RECORD_HEAD_BYTES};

/// Appends the fields of records to a byte vector; all numbers are little-endian.
pub(crate) trait Put {
    fn put_u16(&mut self, value: u16);
    fn put_u32(&mut self, value: u32);
    fn put_u64(&mut self, value: u64);
    /// A length of 32 bits and the text.
    fn put_str(&mut self, text: &str);
    /// Keys and values, preceded by their length in bytes.
    fn put_map(&mut self, map: &BTreeMap<String, String>);
    /// Opcode, length and what `content` appends.
    fn put_record(&mut self, opcode: u8, content: impl FnOnce(&mut Vec<u8>));
}

impl Put for Vec<u8> {
    fn put_u16(&mut self, value: u16) {
        self.extend_from_slice(&value.to_le_bytes());
    }

    fn put_u32(&mut self, value: u32) {
        self.extend_from_slice(&value.to_le_bytes());
    }

    fn put_u64(&mut self, value: u64) {
        self.extend_from_slice(&value.to_le_bytes());
    }

    fn put_str(&mut self, text: &str) {
        self.put_u32(text.len() as u32);
        self.extend_from_slice(text.as_bytes());
    }

    fn put_map(&mut self, map: &BTreeMap<String, String>) {
        let bytes: usize = map.iter().map(|(key, value)| 8 + key.len() + value.len()).sum();
        self.put_u32(bytes as u32);
        for (key, value) in map {
            self.put_str(key);
            self.put_str(value);
        }
    }

    fn put_record(&mut self, opcode: u8, content: impl FnOnce(&mut Vec<u8>)) {
        self.push(opcode);
        let length_at = self.len();
        self.put_u64(0);
        let content_at = length_at + RECORD_HEAD_BYTES as usize - 1;
        content(self);
        let length = (self.len() - content_at) as u64;
        self[length_at..content_at].copy_from_slice(&length.to_le_bytes());
    }
}

/// Takes the fields of one record from its bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fields<'a> {
    record: &'static str,
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub(crate) fn new(record: &'static str, bytes: &'a [u8]) -> Self {
        Self { record, rest: bytes }
    }

    /// What was not taken yet.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.rest
    }

    pub(crate) fn bytes(&mut self, field: &'static str, length: usize) -> Result<&'a [u8], Defect> {
        let (taken, rest) =
            self.rest.split_at_checked(length).ok_or(Defect::Malformed { record: self.record, field })?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, field: &'static str) -> Result<[u8; N], Defect> {
        let (taken, rest) =
            self.rest.split_first_chunk::<N>().ok_or(Defect::Malformed { record: self.record, field })?;
        self.rest = rest;
        Ok(*taken)
    }

    pub(crate) fn u8(&mut self, field: &'static str) -> Result<u8, Defect> {
        self.array::<1>(field).map(|[byte]| byte)
    }

    pub(crate) fn u16(&mut self, field: &'static str) -> Result<u16, Defect> {
        self.array(field).map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self, field: &'static str) -> Result<u32, Defect> {
        self.array(field).map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self, field: &'static str) -> Result<u64, Defect> {
        self.array(field).map(u64::from_le_bytes)
    }

    pub(crate) fn str(&mut self, field: &'static str) -> Result<&'a str, Defect> {
        let length = self.u32(field)? as usize;
        let bytes = self.bytes(field, length)?;
        std::str::from_utf8(bytes).map_err(|_| Defect::Malformed { record: self.record, field })
    }

    /// A part of the record with a length of 64 bits before it.
    pub(crate) fn long_bytes(&mut self, field: &'static str) -> Result<&'a [u8], Defect> {
        let malformed = Defect::Malformed { record: self.record, field };
        let length = usize::try_from(self.u64(field)?).map_err(|_| malformed)?;
        self.bytes(field, length)
    }

    pub(crate) fn map(&mut self, field: &'static str) -> Result<BTreeMap<String, String>, Defect> {
        let length = self.u32(field)? as usize;
        let mut entries = Fields::new(self.record, self.bytes(field, length)?);
        let mut map = BTreeMap::new();
        while !entries.rest.is_empty() {
            let key = entries.str(field)?.to_owned();
            map.insert(key, entries.str(field)?.to_owned());
        }
        Ok(map)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_record_states_its_own_length() {
        let mut out = vec![7];
        out.put_record(0x0C, |out| out.put_str("ab"));
        assert_eq!(out, [7, 0x0C, 6, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, b'a', b'b']);
    }

    #[test]
    fn a_length_beyond_the_record_is_an_error_not_an_allocation() {
        let mut bytes = Vec::new();
        bytes.put_u64(u64::MAX);
        let error = Fields::new("attachment", &bytes).long_bytes("data").unwrap_err();
        assert_eq!(error, Defect::Malformed { record: "attachment", field: "data" });
    }

    proptest! {
        #[test]
        fn maps_come_back(map in prop::collection::btree_map(".{0,8}", ".{0,8}", 0..6)) {
            let mut bytes = Vec::new();
            bytes.put_map(&map);
            let mut fields = Fields::new("metadata", &bytes);
            prop_assert_eq!(fields.map("map"), Ok(map));
            prop_assert!(fields.rest().is_empty());
        }

        #[test]
        fn any_bytes_are_either_fields_or_a_defect(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            let _ = Fields::new("metadata", &bytes).map("map");
            let _ = Fields::new("metadata", &bytes).str("name");
        }
    }
}
