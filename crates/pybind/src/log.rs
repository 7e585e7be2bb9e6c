//! `read_log`: a rig log as recordings, tables and text.

use std::ffi::CString;
use std::path::PathBuf;

use gearmodel::PairFile;
use numpy::PyArray1;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use riglog::proto::{self, Level};
use riglog::{Completeness, EncoderMetadata, LogReader, Record, RunMetadata};

use crate::array::record_array;
use crate::error::Result;
use crate::pair::GearPair;
use crate::recording::Recording;

/// The name of the attachment that holds the gear pair.
const PAIR_FILE: &str = "pair.toml";

/// What a rig recorded: its runs, what they were recorded with, and what the rig computed and said meanwhile.
///
/// Made by :func:`read_log`.
#[pyclass(frozen, module = "gearmodel", name = "Log")]
pub struct Log {
    /// The file that was read.
    #[pyo3(get)]
    path: PathBuf,
    /// The runs in order of time, one a sense and condition: list of :class:`Recording`.
    #[pyo3(get)]
    runs: Py<PyList>,
    /// The metadata records of the file by name, as text: ``metadata["rig.run"]["operator"]``.
    #[pyo3(get)]
    metadata: Py<PyDict>,
    /// What the rig and its program said: list of :class:`Event`.
    #[pyo3(get)]
    events: Py<PyList>,
    /// TE as computed while recording, one raw sample an angle bin of 0.5 deg: record array with the fields time_ns,
    /// direction ("ccw", "cw"), revolution, theta1_rad, theta2_rad, te_rad, model_te_rad, load_nm, speed_rpm.
    #[pyo3(get)]
    te: Py<PyAny>,
    /// Backlash as computed while recording, one value an angle bin: record array with the fields time_ns, theta1_rad,
    /// backlash_rad, model_backlash_rad, load_nm.
    #[pyo3(get)]
    backlash: Py<PyAny>,
    /// Samples that the running number says are missing in the runs.
    #[pyo3(get)]
    losses: u64,
    /// Whether the file is whole, up to its end record.
    #[pyo3(get)]
    complete: bool,
    /// "complete", or where and why the file ends early.
    #[pyo3(get)]
    completeness: String,
    pair_text: Option<String>,
}

#[pymethods]
impl Log {
    /// The gear pair with its documented errors that the log carries; None where it carries none.
    ///
    /// Raises:
    ///     GeometryError: the attached ``pair.toml`` does not describe a pair.
    #[getter]
    fn pair(&self) -> Result<Option<GearPair>> {
        self.pair_text.as_deref().map(|text| GearPair::from_file(PairFile::parse(text)?)).transpose()
    }

    /// A summary in one line.
    fn __repr__(&self, py: Python<'_>) -> String {
        format!(
            "Log({:?}, {} runs, {} lost samples, {})",
            self.path,
            self.runs.bind(py).len(),
            self.losses,
            self.completeness
        )
    }
}

/// A line that the rig or its program said.
#[pyclass(frozen, get_all, module = "gearmodel", name = "Event")]
pub struct Event {
    /// Device time of what the line speaks of, ns since the Unix epoch.
    time_ns: u64,
    /// "debug", "info", "warning", "error", "fatal" or "unknown".
    level: &'static str,
    /// Part of the rig or of the program that speaks.
    name: String,
    /// The line.
    message: String,
}

#[pymethods]
impl Event {
    /// The line with its level and time.
    fn __repr__(&self) -> String {
        format!("Event({}, {:?}, {:?}, {:?})", self.time_ns, self.level, self.name, self.message)
    }
}

impl Event {
    fn of(line: proto::foxglove::Log, log_time_ns: u64) -> Self {
        Self {
            time_ns: line.timestamp.and_then(|time| time.as_ns()).unwrap_or(log_time_ns),
            level: match line.level() {
                Level::Debug => "debug",
                Level::Info => "info",
                Level::Warning => "warning",
                Level::Error => "error",
                Level::Fatal => "fatal",
                Level::Unknown => "unknown",
            },
            name: line.name,
            message: line.message,
        }
    }
}

/// Everything in a log but its samples.
#[derive(Default)]
struct Head {
    metadata: Vec<(String, riglog::MetadataMap)>,
    encoders: Option<EncoderMetadata>,
    pair_text: Option<String>,
    te: Vec<(u64, proto::TransmissionError)>,
    backlash: Vec<(u64, proto::Backlash)>,
    events: Vec<Event>,
    completeness: Option<Completeness>,
}

impl Head {
    fn read(path: &PathBuf) -> std::result::Result<Self, riglog::LogError> {
        let mut head = Self::default();
        let mut reader = LogReader::open(path)?;
        for record in reader.by_ref() {
            match record? {
                Record::Run(run) => head.metadata.push((RunMetadata::NAME.to_owned(), run.to_map())),
                Record::Encoders(encoders) => {
                    head.metadata.push((EncoderMetadata::NAME.to_owned(), encoders.to_map()));
                    head.encoders = Some(encoders);
                }
                Record::Sealed(hash) => {
                    let map = riglog::MetadataMap::from([("sha256".to_owned(), hash)]);
                    head.metadata.push(("rig.sealed".to_owned(), map));
                }
                Record::Metadata { name, map } => head.metadata.push((name, map)),
                Record::Attachment { name, data, .. } if name == PAIR_FILE => {
                    head.pair_text = Some(String::from_utf8_lossy(&data).into_owned());
                }
                Record::Te { log_time_ns, te, .. } => head.te.push((log_time_ns, te)),
                Record::Backlash { log_time_ns, backlash, .. } => head.backlash.push((log_time_ns, backlash)),
                Record::Event { log_time_ns, event, .. } => head.events.push(Event::of(event, log_time_ns)),
                _ => {}
            }
        }
        head.completeness = reader.completeness().cloned();
        Ok(head)
    }
}

/// Reads a rig log (MCAP).
///
/// Args:
///     path: the file.
///
/// Returns:
///     Log: of a file that was cut off, everything up to its last whole chunk, with a UserWarning that says where it ends.
///
/// Raises:
///     OSError: the file cannot be read.
///     LogError: the file is no rig log, or what it holds contradicts itself.
#[pyfunction]
pub fn read_log(py: Python<'_>, path: PathBuf) -> Result<Log> {
    let (head, runs) = py.detach(|| Ok::<_, riglog::LogError>((Head::read(&path)?, riglog::read_runs(&path)?)))?;
    let completeness = head.completeness.unwrap_or(Completeness::Complete);
    if !completeness.is_complete() {
        let text = format!("{}: {completeness}; what is whole was read", path.display());
        // A text with a NUL byte in it cannot warn; the log says the same by its own field.
        if let Ok(text) = CString::new(text) {
            PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
        }
    }
    let metadata = PyDict::new(py);
    for (name, map) in head.metadata {
        metadata.set_item(name, map)?;
    }
    let losses = runs.iter().map(|run| run.losses).fold(0, u64::saturating_add);
    let lines = head.encoders.map(|encoders| (encoders.input_lines, encoders.output_lines));
    let recordings = PyList::empty(py);
    for run in runs {
        // A run that was broken off before its first sample has nothing to analyse.
        if run.samples > 0 {
            recordings.append(Bound::new(py, Recording::from_run(py, run, lines)?)?)?;
        }
    }
    let events = PyList::empty(py);
    for event in head.events {
        events.append(Bound::new(py, event)?)?;
    }
    Ok(Log {
        runs: recordings.unbind(),
        metadata: metadata.unbind(),
        events: events.unbind(),
        te: te_table(py, &head.te)?,
        backlash: backlash_table(py, &head.backlash)?,
        losses,
        complete: completeness.is_complete(),
        completeness: completeness.to_string(),
        pair_text: head.pair_text,
        path,
    })
}

fn times<'py, T>(
    py: Python<'py>,
    rows: &[(u64, T)],
    time: impl Fn(&T) -> Option<proto::Timestamp>,
) -> Bound<'py, PyAny> {
    // A message without a time of its own came at its log time.
    let time_ns = rows.iter().map(|(log_ns, row)| time(row).and_then(|time| time.as_ns()).unwrap_or(*log_ns));
    PyArray1::from_iter(py, time_ns).into_any()
}

fn te_table(py: Python<'_>, rows: &[(u64, proto::TransmissionError)]) -> Result<Py<PyAny>> {
    let column = |value: fn(&proto::TransmissionError) -> f64| {
        PyArray1::from_iter(py, rows.iter().map(|(_, row)| value(row))).into_any()
    };
    let senses: Vec<&str> =
        rows.iter().map(|(_, row)| row.direction().sense().map_or("", gearmodel::Direction::as_str)).collect();
    let direction = py.import("numpy")?.call_method1("array", (senses, "U3"))?;
    let revolution = PyArray1::from_iter(py, rows.iter().map(|(_, row)| row.revolution)).into_any();
    record_array(
        py,
        vec![
            ("time_ns", times(py, rows, |row| row.timestamp)),
            ("direction", direction),
            ("revolution", revolution),
            ("theta1_rad", column(|row| row.theta1_rad)),
            ("theta2_rad", column(|row| row.theta2_rad)),
            ("te_rad", column(|row| row.te_rad)),
            ("model_te_rad", column(|row| row.model_te_rad)),
            ("load_nm", column(|row| row.load_nm)),
            ("speed_rpm", column(|row| row.speed_rpm)),
        ],
    )
}

fn backlash_table(py: Python<'_>, rows: &[(u64, proto::Backlash)]) -> Result<Py<PyAny>> {
    let column =
        |value: fn(&proto::Backlash) -> f64| PyArray1::from_iter(py, rows.iter().map(|(_, row)| value(row))).into_any();
    record_array(
        py,
        vec![
            ("time_ns", times(py, rows, |row| row.timestamp)),
            ("theta1_rad", column(|row| row.theta1_rad)),
            ("backlash_rad", column(|row| row.backlash_rad)),
            ("model_backlash_rad", column(|row| row.model_backlash_rad)),
            ("load_nm", column(|row| row.load_nm)),
        ],
    )
}
