//! The table as one structured NumPy array: `numpy.load("x.npy")["te_rad"]`. `direction` is +1 for ccw and −1 for cw; what was lost is
//! NaN, its counts are 0.
//!
//! NPY format version 1.0 (numpy.lib.format): magic, version, length of the header, a Python literal, then the rows, little-endian.

use std::fs::File;
use std::io::{BufWriter, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use super::ExportError;
use super::row::{Row, Table, columns};

/// Magic, version and length of the header take 10 bytes; all together are a multiple of 64.
const PREAMBLE: usize = 10;
const ALIGNMENT: usize = 64;

pub struct NpyFile {
    path: PathBuf,
    out: BufWriter<File>,
    with_te: bool,
    rows: u64,
    row: Vec<u8>,
}

impl NpyFile {
    /// Creates the table with a header for no rows, which is replaced at the end.
    pub fn create(path: &Path, with_te: bool) -> Result<Self, ExportError> {
        let write = |source| ExportError::Write { path: path.into(), source };
        let file = File::create_new(path).map_err(write)?;
        let mut out = BufWriter::with_capacity(1 << 18, file);
        out.write_all(&header(0, with_te)).map_err(write)?;
        Ok(Self { path: path.into(), out, with_te, rows: 0, row: Vec::new() })
    }
}

fn header(rows: u64, with_te: bool) -> Vec<u8> {
    let kind = |name: &str| match name {
        "direction" => "|i1",
        "run" => "<u4",
        "sample" | "time_unix_ns" => "<u8",
        "input_counts" | "output_counts" => "<i8",
        _ => "<f8",
    };
    let fields: Vec<_> = columns(with_te).iter().map(|name| format!("('{name}', '{}')", kind(name))).collect();
    // The number of rows has room for any, so that the header keeps its length.
    let mut text = format!("{{'descr': [{}], 'fortran_order': False, 'shape': ({rows:>20},), }}", fields.join(", "));
    let length = (PREAMBLE + text.len() + 1).next_multiple_of(ALIGNMENT) - PREAMBLE;
    text.push_str(&" ".repeat(length - 1 - text.len()));
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

impl Table for NpyFile {
    fn push(&mut self, row: &Row) -> Result<(), ExportError> {
        let bytes = &mut self.row;
        bytes.clear();
        let nan = |value: Option<f64>| value.unwrap_or(f64::NAN).to_le_bytes();
        let reading = row.reading;
        bytes.extend((row.since_start_ns as f64 * 1e-9).to_le_bytes());
        bytes.extend(nan(reading.map(|r| r.theta1_rad)));
        bytes.extend(nan(reading.map(|r| r.theta2_rad)));
        bytes.extend(row.load_nm.to_le_bytes());
        bytes.extend(row.speed_rpm.to_le_bytes());
        bytes.extend((row.direction.sign() as i8).to_le_bytes());
        bytes.extend(row.run.to_le_bytes());
        bytes.extend(row.sample.to_le_bytes());
        bytes.extend(row.time_ns.to_le_bytes());
        bytes.extend(reading.map_or(0, |r| r.input_counts).to_le_bytes());
        bytes.extend(reading.map_or(0, |r| r.output_counts).to_le_bytes());
        if self.with_te {
            bytes.extend(nan(reading.and_then(|r| r.te_rad)));
        }
        self.rows += 1;
        self.out.write_all(&self.row).map_err(|source| ExportError::Write { path: self.path.clone(), source })
    }

    fn finish(&mut self) -> Result<(), ExportError> {
        let end = |out: &mut BufWriter<File>, head: Vec<u8>| {
            out.seek(SeekFrom::Start(0))?;
            out.write_all(&head)?;
            out.flush()
        };
        end(&mut self.out, header(self.rows, self.with_te))
            .map_err(|source| ExportError::Write { path: self.path.clone(), source })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_keeps_its_length_whatever_the_number_of_rows() {
        for with_te in [false, true] {
            let (none, many) = (header(0, with_te), header(u64::MAX, with_te));
            assert_eq!(none.len(), many.len());
            assert_eq!(none.len() % ALIGNMENT, 0);
            assert!(none.ends_with(b"\n"));
        }
    }
}
