//! A row of the table, and its columns.

use gearmodel::Direction;

use super::ExportError;

/// One sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Number of the run in the log, from 1.
    pub run: u32,
    /// Running number of the sample in the log.
    pub sample: u64,
    /// Device time, ns since the Unix epoch.
    pub time_ns: u64,
    /// Device time since the log's first sample, ns.
    pub since_start_ns: u64,
    /// The driver's sense.
    pub direction: Direction,
    /// Load set-point, N·m.
    pub load_nm: f64,
    /// Speed set-point, rpm.
    pub speed_rpm: f64,
    /// What was read; `None` for a sample that was lost.
    pub reading: Option<Reading>,
}

/// What was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Angle of the driver, rad.
    pub theta1_rad: f64,
    /// Angle of the driven gear, rad.
    pub theta2_rad: f64,
    /// Transmission error, rad, where the log has its pair.
    pub te_rad: Option<f64>,
    /// Counts of the input encoder.
    pub input_counts: i64,
    /// Counts of the output encoder.
    pub output_counts: i64,
}

/// The names of the columns, in their order.
pub fn columns(with_te: bool) -> Vec<&'static str> {
    let mut names = vec![
        "time_s",
        "theta1_rad",
        "theta2_rad",
        "load_nm",
        "speed_rpm",
        "direction",
        "run",
        "sample",
        "time_unix_ns",
    ];
    names.extend(["input_counts", "output_counts"]);
    if with_te {
        names.push("te_rad");
    }
    names
}

/// A table under way.
pub trait Table {
    /// Adds a row.
    ///
    /// # Errors
    /// The operating system refused.
    fn push(&mut self, row: &Row) -> Result<(), ExportError>;
    /// Ends the table.
    ///
    /// # Errors
    /// As [`Table::push`].
    fn finish(&mut self) -> Result<(), ExportError>;
}
