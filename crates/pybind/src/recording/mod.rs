//! `Recording`: the samples of a run, or of any two encoders.

pub mod check;
pub mod split;
mod table;

use gearmodel::Direction;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PySlice, PyTuple};

use crate::array::{Numbers, array};
use crate::error::Result;
use check::{RecordingError, check_column, check_sense, check_time};

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
    fn take(field: &'static str, given: &Bound<'_, PyAny>, samples: usize) -> Result<Self> {
        if let Numbers::One(value) = Numbers::take(field, given)? {
            if !value.is_finite() {
                return Err(RecordingError::Condition { field, value }.into());
            }
            return Ok(Self::All(value));
        }
        let values = column(field, given)?;
        check_column(field, values.readonly().as_slice().map_err(PyErr::from)?, samples, false)?;
        Ok(Self::Each(values.unbind()))
    }

    /// The value, or the mean of the values: what the model is evaluated at.
    fn mean(&self, py: Python<'_>) -> Result<f64> {
        Ok(match self {
            Self::All(value) => *value,
            Self::Each(values) => {
                let values = values.bind(py).readonly();
                let values = values.as_slice().map_err(PyErr::from)?;
                values.iter().sum::<f64>() / values.len() as f64
            }
        })
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
    view.cast_into::<PyArray1<f64>>().map_err(|_| RecordingError::Dimensions { field, dimensions }.into())
}

fn lines(field: &'static str, given: Option<i64>) -> Result<Option<u64>> {
    given
        .map(|value| match u64::try_from(value) {
            Ok(lines) if lines > 0 => Ok(lines),
            _ => Err(RecordingError::Lines { field, value }.into()),
        })
        .transpose()
}

/// Both angles of a recording of one sense, and what it was recorded at.
pub struct OneSense<'py> {
    /// θ1, rad.
    pub theta1_rad: PyReadonlyArray1<'py, f64>,
    /// θ2, rad.
    pub theta2_rad: PyReadonlyArray1<'py, f64>,
    /// The driver's sense.
    pub direction: Direction,
    /// Mean load, N·m.
    pub load_nm: f64,
    /// Mean speed, rpm.
    pub speed_rpm: f64,
}

impl Recording {
    /// Columns that a log holds; they were checked when it was written and are checked again here.
    pub fn from_run(py: Python<'_>, run: riglog::RecordedRun, lines: Option<(u64, u64)>) -> Result<Self> {
        let column = |field, values: Vec<f64>| column(field, PyArray1::from_vec(py, values).as_any());
        let (time_s, theta1_rad, theta2_rad) = (
            column("time_s", run.time_s)?,
            column("theta1_rad", run.theta1_rad)?,
            column("theta2_rad", run.theta2_rad)?,
        );
        Ok(Self {
            time_s: time_s.unbind(),
            theta1_rad: theta1_rad.unbind(),
            theta2_rad: theta2_rad.unbind(),
            load_nm: Condition::All(run.load_nm),
            speed_rpm: Condition::All(run.speed_rpm),
            direction: Some(run.direction),
            input_lines: lines.map(|(input, _)| input),
            output_lines: lines.map(|(_, output)| output),
        })
    }

    /// The angles, where the recording keeps one sense; a stated direction is believed.
    pub fn one_sense<'py>(&self, py: Python<'py>) -> Result<OneSense<'py>> {
        let theta1_rad = self.theta1_rad.bind(py).readonly();
        let theta2_rad = self.theta2_rad.bind(py).readonly();
        let direction = match self.direction {
            Some(direction) => direction,
            None => {
                let theta1 = theta1_rad.as_slice().map_err(PyErr::from)?;
                match py.detach(|| split::stretches(theta1)).as_slice() {
                    [] => return Err(RecordingError::Still { limit_rad: split::REVERSAL_RAD }.into()),
                    [only] => only.direction,
                    [first, rest @ ..] => {
                        return Err(RecordingError::Reverses { reversals: rest.len(), index: first.to }.into());
                    }
                }
            }
        };
        Ok(OneSense {
            theta1_rad,
            theta2_rad,
            direction,
            load_nm: self.load_nm.mean(py)?,
            speed_rpm: self.speed_rpm.mean(py)?,
        })
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
        let direction = match direction {
            "auto" => None,
            given => {
                Some(given.parse::<Direction>().map_err(|_| RecordingError::Direction { given: given.to_owned() })?)
            }
        };
        let time_s = column("time_s", time_s)?;
        let samples = time_s.len();
        let theta = [column("theta1_rad", theta1_rad)?, column("theta2_rad", theta2_rad)?];
        {
            let time = time_s.readonly();
            let time = time.as_slice().map_err(PyErr::from)?;
            py.detach(|| check_time(time))?;
            for (field, values) in ["theta1_rad", "theta2_rad"].into_iter().zip(&theta) {
                let values = values.readonly();
                let values = values.as_slice().map_err(PyErr::from)?;
                py.detach(|| {
                    check_column(field, values, samples, true)?;
                    direction.map_or(Ok(()), |direction| check_sense(field, values, direction))
                })?;
            }
        }
        let [theta1_rad, theta2_rad] = theta.map(Bound::unbind);
        Ok(Self {
            time_s: time_s.unbind(),
            theta1_rad,
            theta2_rad,
            load_nm: Condition::take("load_nm", load_nm, samples)?,
            speed_rpm: Condition::take("speed_rpm", speed_rpm, samples)?,
            direction,
            input_lines: lines("input_lines", input_lines)?,
            output_lines: lines("output_lines", output_lines)?,
        })
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
        let theta1 = self.theta1_rad.bind(py).readonly();
        let theta1 = theta1.as_slice().map_err(PyErr::from)?;
        let mut seen = theta1.iter().filter(|theta| theta.is_finite());
        let first = seen.next().copied().unwrap_or(0.0);
        Ok((seen.next_back().copied().unwrap_or(first) - first).abs() / std::f64::consts::TAU)
    }

    /// Time from the first to the last sample, s.
    #[getter]
    fn duration_s(&self, py: Python<'_>) -> Result<f64> {
        let time = self.time_s.bind(py).readonly();
        let time = time.as_slice().map_err(PyErr::from)?;
        Ok(time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first))
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
        let theta1 = this.theta1_rad.bind(py).readonly();
        let theta1 = theta1.as_slice().map_err(PyErr::from)?;
        for stretch in py.detach(|| split::stretches(theta1)) {
            let samples = PySlice::new(py, stretch.from as isize, stretch.to as isize, 1);
            let part = |values: &Py<PyArray1<f64>>| -> Result<Py<PyArray1<f64>>> {
                column("part", &values.bind(py).get_item(&samples)?).map(Bound::unbind)
            };
            let length = stretch.to - stretch.from;
            parts.append(Bound::new(
                py,
                Self {
                    time_s: part(&this.time_s)?,
                    theta1_rad: part(&this.theta1_rad)?,
                    theta2_rad: part(&this.theta2_rad)?,
                    load_nm: Condition::take("load_nm", &this.load_nm.part(py, &samples)?, length)?,
                    speed_rpm: Condition::take("speed_rpm", &this.speed_rpm.part(py, &samples)?, length)?,
                    direction: Some(stretch.direction),
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
        let condition = |condition: &Condition| match condition {
            Condition::All(value) => Ok(format!("{value:?}")),
            Condition::Each(_) => condition.mean(py).map(|mean| format!("array(mean {mean:.4})")),
        };
        Ok(format!(
            "Recording({} samples, {} s, {:.3} turns, direction='{}', load_nm={}, speed_rpm={})",
            self.__len__(py),
            (self.duration_s(py)? * 1e3).round() / 1e3,
            self.revolutions(py)?,
            self.direction(),
            condition(&self.load_nm)?,
            condition(&self.speed_rpm)?,
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
