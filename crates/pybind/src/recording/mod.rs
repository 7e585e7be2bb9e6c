//! `Recording`: the samples of a run, or of any two encoders.

mod table;

use std::borrow::Cow;

use gearmodel::Direction;
use gearmodel::recording::{self as model, Columns, RecordingError};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PySlice, PyTuple};

use crate::array::{Numbers, array};
use crate::error::{InputError, Result};

/// Sampled angles of two shafts with their conditions: a run of a rig, or any drive with two encoders.
///
/// The arrays are 1-D float64 of equal length and read-only; float64 arrays are referred to, not copied.
///
/// Args:
///     time_s: time of the samples, s, increasing. All recordings that are compared share one clock.
///     theta1_rad: angle of the driver, rad, unwrapped, decreasing in a cw recording. NaN is a gap.
///     theta2_rad: angle of the driven shaft, rad, in its own positive sense: it increases where theta1 does. NaN is a gap.
///     load_nm: torque on the driven shaft, N m; a number, or a value a sample.
///     speed_rpm: driver speed, rpm, positive in both senses, 0 = not known; a number, or a value a sample.
///     direction: "ccw", "cw", or "auto": taken from the motion (see :meth:`split`).
///     input_lines: lines of the input encoder's disc, None where it is not known.
///     output_lines: lines of the output encoder's disc.
///
/// Raises:
///     ValueError: names field, index and limit: unequal lengths, no sample, a time that is NaN or does not increase, an
///         infinite angle, angles that move against the direction.
///     TypeError: a column that does not hold real numbers.
///
/// >>> import gearmodel as gm, numpy as np
/// >>> t = np.arange(0, 12, 0.01)
/// >>> rec = gm.Recording(t, 0.5 * t, 0.5 * t + 1e-4 * np.sin(0.5 * t), 10.0, 4.77, "ccw")
/// >>> rec
/// Recording(1200 samples, 11.99 s, 0.954 turns, direction='ccw', load_nm=10.0, speed_rpm=4.77)
#[pyclass(frozen, module = "gearmodel", name = "Recording")]
pub struct Recording {
    time_s: Py<PyArray1<f64>>,
    theta1_rad: Py<PyArray1<f64>>,
    theta2_rad: Py<PyArray1<f64>>,
    load_nm: Condition,
    speed_rpm: Condition,
    /// `None` = "auto".
    direction: Option<Direction>,
    input_lines: Option<u64>,
    output_lines: Option<u64>,
}

/// One value for all samples, or one a sample.
enum Condition {
    All(f64),
    Each(Py<PyArray1<f64>>),
}

impl Condition {
    fn take(field: &'static str, given: &Bound<'_, PyAny>) -> Result<Self> {
        Ok(match Numbers::take(field, given)? {
            Numbers::One(value) => Self::All(value),
            Numbers::Many(_) => Self::Each(column(field, given)?.unbind()),
        })
    }

    fn read<'py>(&self, py: Python<'py>) -> ReadCondition<'py> {
        match self {
            Self::All(value) => ReadCondition::All(*value),
            Self::Each(values) => ReadCondition::Each(values.bind(py).readonly()),
        }
    }

    fn object<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        match self {
            Self::All(value) => pyo3::types::PyFloat::new(py, *value).into_any(),
            Self::Each(values) => values.bind(py).clone().into_any(),
        }
    }

    fn part<'py>(&self, py: Python<'py>, samples: &Bound<'py, PySlice>) -> Result<Bound<'py, PyAny>> {
        Ok(match self {
            Self::All(_) => self.object(py),
            Self::Each(values) => values.bind(py).get_item(samples)?,
        })
    }
}

/// A read-only 1-D float64 view of an array-like.
fn column<'py>(field: &'static str, given: &Bound<'py, PyAny>) -> Result<Bound<'py, PyArray1<f64>>> {
    let py = given.py();
    let values = array(field, given)?;
    let dimensions = values.ndim();
    // A view, so that the caller's own array stays as writeable as it was.
    let view = values.call_method0(intern!(py, "view"))?;
    view.getattr(intern!(py, "flags"))?.setattr(intern!(py, "writeable"), false)?;
    view.cast_into::<PyArray1<f64>>().map_err(|_| InputError::Dimensions { field, dimensions }.into())
}

fn lines(field: &'static str, given: Option<i64>) -> Result<Option<u64>> {
    given
        .map(|value| match u64::try_from(value) {
            Ok(lines) if lines > 0 => Ok(lines),
            _ => Err(RecordingError::Lines { field, value }.into()),
        })
        .transpose()
}

/// The arrays of a recording, held for reading.
pub struct Read<'py> {
    time_s: PyReadonlyArray1<'py, f64>,
    theta1_rad: PyReadonlyArray1<'py, f64>,
    theta2_rad: PyReadonlyArray1<'py, f64>,
    load_nm: ReadCondition<'py>,
    speed_rpm: ReadCondition<'py>,
    direction: Option<Direction>,
    input_lines: Option<u64>,
    output_lines: Option<u64>,
}

enum ReadCondition<'py> {
    All(f64),
    Each(PyReadonlyArray1<'py, f64>),
}

fn slice<'a>(values: &'a PyReadonlyArray1<'_, f64>) -> Result<Cow<'a, [f64]>> {
    Ok(Cow::Borrowed(values.as_slice().map_err(PyErr::from)?))
}

impl ReadCondition<'_> {
    fn condition(&self) -> Result<model::Condition<'_>> {
        Ok(match self {
            Self::All(value) => model::Condition::All(*value),
            Self::Each(values) => model::Condition::Each(slice(values)?),
        })
    }
}

impl Read<'_> {
    fn columns(&self) -> Result<Columns<'_>> {
        Ok(Columns {
            time_s: slice(&self.time_s)?,
            theta1_rad: slice(&self.theta1_rad)?,
            theta2_rad: slice(&self.theta2_rad)?,
            load_nm: self.load_nm.condition()?,
            speed_rpm: self.speed_rpm.condition()?,
            direction: self.direction,
            input_lines: self.input_lines,
            output_lines: self.output_lines,
        })
    }

    /// The recording as the model knows it; it borrows the arrays.
    pub fn recording(&self) -> Result<model::Recording<'_>> {
        // The caller may have written into his own arrays since: shape and numbers are looked at again.
        Ok(model::Recording::of_log(self.columns()?)?)
    }
}

impl Recording {
    /// Columns that a log holds.
    pub fn from_run(py: Python<'_>, run: riglog::RecordedRun, lines: Option<(u64, u64)>) -> Result<Self> {
        let column = |field, values: Vec<f64>| column(field, PyArray1::from_vec(py, values).as_any());
        let this = Self {
            time_s: column("time_s", run.time_s)?.unbind(),
            theta1_rad: column("theta1_rad", run.theta1_rad)?.unbind(),
            theta2_rad: column("theta2_rad", run.theta2_rad)?.unbind(),
            load_nm: Condition::All(run.load_nm),
            speed_rpm: Condition::All(run.speed_rpm),
            direction: Some(run.direction),
            input_lines: lines.map(|(input, _)| input),
            output_lines: lines.map(|(_, output)| output),
        };
        this.read(py).recording()?;
        Ok(this)
    }

    /// The arrays, held for reading.
    pub fn read<'py>(&self, py: Python<'py>) -> Read<'py> {
        let array = |values: &Py<PyArray1<f64>>| values.bind(py).readonly();
        Read {
            time_s: array(&self.time_s),
            theta1_rad: array(&self.theta1_rad),
            theta2_rad: array(&self.theta2_rad),
            load_nm: self.load_nm.read(py),
            speed_rpm: self.speed_rpm.read(py),
            direction: self.direction,
            input_lines: self.input_lines,
            output_lines: self.output_lines,
        }
    }
}

#[pymethods]
impl Recording {
    #[new]
    #[pyo3(signature = (time_s, theta1_rad, theta2_rad, load_nm, speed_rpm, direction, *, input_lines=None, output_lines=None))]
    fn new(
        time_s: &Bound<'_, PyAny>,
        theta1_rad: &Bound<'_, PyAny>,
        theta2_rad: &Bound<'_, PyAny>,
        load_nm: &Bound<'_, PyAny>,
        speed_rpm: &Bound<'_, PyAny>,
        direction: &str,
        input_lines: Option<i64>,
        output_lines: Option<i64>,
    ) -> Result<Self> {
        let py = time_s.py();
        let this = Self {
            time_s: column("time_s", time_s)?.unbind(),
            theta1_rad: column("theta1_rad", theta1_rad)?.unbind(),
            theta2_rad: column("theta2_rad", theta2_rad)?.unbind(),
            load_nm: Condition::take("load_nm", load_nm)?,
            speed_rpm: Condition::take("speed_rpm", speed_rpm)?,
            direction: model::parse_direction(direction)?,
            input_lines: lines("input_lines", input_lines)?,
            output_lines: lines("output_lines", output_lines)?,
        };
        let read = this.read(py);
        let columns = read.columns()?;
        py.detach(|| model::Recording::new(columns).map(drop))?;
        Ok(this)
    }

    /// Time of the samples, s, shape (n,).
    #[getter]
    fn time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.time_s.bind(py).clone()
    }

    /// Angle of the driver, rad, shape (n,); NaN is a gap.
    #[getter]
    fn theta1_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.theta1_rad.bind(py).clone()
    }

    /// Angle of the driven shaft, rad, shape (n,); NaN is a gap.
    #[getter]
    fn theta2_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.theta2_rad.bind(py).clone()
    }

    /// Torque on the driven shaft, N m: a float, or shape (n,).
    #[getter]
    fn load_nm<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.load_nm.object(py)
    }

    /// Driver speed, rpm: a float, or shape (n,); 0 = not known.
    #[getter]
    fn speed_rpm<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.speed_rpm.object(py)
    }

    /// "ccw", "cw" or "auto".
    #[getter]
    fn direction(&self) -> &'static str {
        self.direction.map_or("auto", Direction::as_str)
    }

    /// Lines of the input encoder's disc; None where it is not known.
    #[getter]
    fn input_lines(&self) -> Option<u64> {
        self.input_lines
    }

    /// Lines of the output encoder's disc; None where it is not known.
    #[getter]
    fn output_lines(&self) -> Option<u64> {
        self.output_lines
    }

    /// Turns of the driver between the first and the last sample that are no gap, > 0.
    #[getter]
    fn revolutions(&self, py: Python<'_>) -> Result<f64> {
        Ok(self.read(py).recording()?.turns())
    }

    /// Time from the first to the last sample, s.
    #[getter]
    fn duration_s(&self, py: Python<'_>) -> Result<f64> {
        Ok(self.read(py).recording()?.duration_s())
    }

    /// The parts of one sense each, in order, as recordings with "ccw" or "cw"; views, no copies.
    ///
    /// A recording with a stated direction is returned whole. An "auto" one is cut where theta1 turns back by more than
    /// 0.01 rad.
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> t = np.linspace(0, 10, 1001)
    /// >>> there_and_back = gm.Recording(t, np.sin(0.5 * t), np.sin(0.5 * t), 0.0, 0.0, "auto")
    /// >>> [part.direction for part in there_and_back.split()]
    /// ['ccw', 'cw', 'ccw']
    fn split<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyList>> {
        let (py, this) = (slf.py(), slf.get());
        let parts = PyList::empty(py);
        if this.direction.is_some() {
            parts.append(slf)?;
            return Ok(parts);
        }
        let read = this.read(py);
        let recording = read.recording()?;
        for segment in py.detach(|| recording.segments()) {
            let samples = PySlice::new(py, segment.from as isize, segment.to as isize, 1);
            let part = |values: &Py<PyArray1<f64>>| -> Result<Py<PyArray1<f64>>> {
                column("part", &values.bind(py).get_item(&samples)?).map(Bound::unbind)
            };
            parts.append(Bound::new(
                py,
                Self {
                    time_s: part(&this.time_s)?,
                    theta1_rad: part(&this.theta1_rad)?,
                    theta2_rad: part(&this.theta2_rad)?,
                    load_nm: Condition::take("load_nm", &this.load_nm.part(py, &samples)?)?,
                    speed_rpm: Condition::take("speed_rpm", &this.speed_rpm.part(py, &samples)?)?,
                    direction: Some(segment.direction),
                    input_lines: this.input_lines,
                    output_lines: this.output_lines,
                },
            )?)?;
        }
        Ok(parts)
    }

    /// Number of samples.
    fn __len__(&self, py: Python<'_>) -> usize {
        self.time_s.bind(py).len()
    }

    /// A summary in one line.
    fn __repr__(&self, py: Python<'_>) -> Result<String> {
        let read = self.read(py);
        let recording = read.recording()?;
        let condition = |condition: &model::Condition<'_>| match condition {
            model::Condition::All(value) => format!("{value:?}"),
            model::Condition::Each(_) => format!("array(mean {:.4})", condition.mean()),
        };
        Ok(format!(
            "Recording({} samples, {} s, {:.3} turns, direction='{}', load_nm={}, speed_rpm={})",
            recording.samples(),
            (recording.duration_s() * 1e3).round() / 1e3,
            recording.turns(),
            self.direction(),
            condition(&recording.columns().load_nm),
            condition(&recording.columns().speed_rpm),
        ))
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("input_lines", self.input_lines)?;
        keywords.set_item("output_lines", self.output_lines)?;
        let arguments = (
            self.time_s(py),
            self.theta1_rad(py),
            self.theta2_rad(py),
            self.load_nm(py),
            self.speed_rpm(py),
            self.direction(),
        );
        Ok((arguments.into_pyobject(py)?, keywords))
    }
}
