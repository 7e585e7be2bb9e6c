//! Arrays in, arrays of the same shape out; scalars in, floats out.

use std::num::NonZero;
use std::thread;

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt};

use crate::error::{InputError, Raised, Result};

/// Real numbers as they came: one, or an array of any shape.
pub enum Numbers<'py> {
    /// One number.
    One(f64),
    /// An array, C-contiguous.
    Many(PyReadonlyArrayDyn<'py, f64>),
}

impl<'py> Numbers<'py> {
    /// Takes a number or any array-like of real numbers; `field` names it in an error. Masked values become NaN.
    pub fn take(field: &'static str, given: &Bound<'py, PyAny>) -> Result<Self> {
        if let Some(array) = as_it_is(given) {
            return Ok(Self::Many(array.readonly()));
        }
        Ok(if is_scalar(given)? { Self::One(given.extract()?) } else { Self::Many(array(field, given)?.readonly()) })
    }

    /// The values of `f` in the same shape. Releases the GIL and shares long arrays over the cores.
    pub fn map(&self, py: Python<'py>, f: impl Fn(f64) -> f64 + Sync) -> Result<Bound<'py, PyAny>> {
        self.try_map(py, |x| Ok::<_, Never>(f(x)))
    }

    /// [`Numbers::map`] of what may fail; the first failure counts.
    pub fn try_map<E: Send + Into<Raised>>(
        &self,
        py: Python<'py>,
        f: impl Fn(f64) -> std::result::Result<f64, E> + Sync,
    ) -> Result<Bound<'py, PyAny>> {
        self.try_map_all(py, |xs| xs.iter().map(|x| f(*x)).collect())
    }

    /// [`Numbers::try_map`] of what takes many values at once and gives as many: less work together than one by one.
    pub fn try_map_all<E: Send + Into<Raised>>(
        &self,
        py: Python<'py>,
        f: impl Fn(&[f64]) -> std::result::Result<Vec<f64>, E> + Sync,
    ) -> Result<Bound<'py, PyAny>> {
        match self {
            Self::One(x) => Ok(PyFloat::new(py, f(&[*x]).map_err(Into::into)?[0]).into_any()),
            Self::Many(array) => {
                let xs = array.as_slice().map_err(PyErr::from)?;
                let ys = py.detach(|| map_slice(xs, &f)).map_err(Into::into)?;
                Ok(PyArray1::from_vec(py, ys).reshape(array.shape().to_vec())?.into_any())
            }
        }
    }
}

/// The error of what cannot fail.
enum Never {}

impl From<Never> for Raised {
    fn from(never: Never) -> Self {
        match never {}
    }
}

/// A plain, C-contiguous float64 array: what needs no conversion needs none of numpy's questions either, which take longer
/// than a thousand angles of TE.
fn as_it_is<'a, 'py>(given: &'a Bound<'py, PyAny>) -> Option<&'a Bound<'py, PyArrayDyn<f64>>> {
    let array = given.is_exact_instance_of::<PyUntypedArray>().then(|| given.cast().ok())??;
    array.is_c_contiguous().then_some(array)
}

/// True for Python's and numpy's real scalars and for anything else that is a number and no container.
pub fn is_scalar(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    let py = given.py();
    if given.is_instance_of::<PyFloat>() || given.is_instance_of::<PyInt>() {
        return Ok(true);
    }
    let numpy = py.import(intern!(py, "numpy"))?;
    if given.is_instance(&numpy.getattr(intern!(py, "generic"))?)? {
        let kinds = (numpy.getattr(intern!(py, "floating"))?, numpy.getattr(intern!(py, "integer"))?);
        return Ok(given.is_instance(&kinds.0)? || given.is_instance(&kinds.1)?);
    }
    Ok(!given.hasattr(intern!(py, "__array__"))?
        && !given.hasattr(intern!(py, "__len__"))?
        && given.hasattr(intern!(py, "__float__"))?)
}

/// A count that came as Python's integer, in the type that the model takes.
pub fn count<T: TryFrom<i128>>(field: &'static str, given: impl Into<i128>) -> Result<T> {
    let given = given.into();
    T::try_from(given).map_err(|_| InputError::Count { field, given }.into())
}

/// Any array-like of real numbers as a C-contiguous float64 array, without a copy where it is one. Masked values become
/// NaN, which is a gap everywhere else.
pub fn array<'py>(field: &'static str, given: &Bound<'py, PyAny>) -> Result<Bound<'py, PyArrayDyn<f64>>> {
    let py = given.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    let masked = numpy.getattr(intern!(py, "ma"))?.getattr(intern!(py, "MaskedArray"))?;
    let plain = numpy
        .call_method1(intern!(py, "asanyarray"), (given,))
        .map_err(|error| InputError::NoArray { field, reason: error.value(py).to_string() })?;
    let kind: String = plain.getattr(intern!(py, "dtype"))?.getattr(intern!(py, "kind"))?.extract()?;
    if !["b", "i", "u", "f"].contains(&kind.as_str()) {
        let dtype = plain.getattr(intern!(py, "dtype"))?;
        let found =
            if kind == "O" { "objects (missing values are NaN here)".to_owned() } else { format!("dtype {dtype}") };
        return Err(InputError::NotNumbers { field, found }.into());
    }
    let float64 = numpy.getattr(intern!(py, "float64"))?;
    let unmasked = if plain.is_instance(&masked)? {
        plain.call_method1(intern!(py, "astype"), (&float64,))?.call_method1(intern!(py, "filled"), (f64::NAN,))?
    } else {
        plain
    };
    let contiguous = numpy.call_method1(intern!(py, "asarray"), (unmasked, float64, intern!(py, "C")))?;
    Ok(contiguous.cast_into::<PyArrayDyn<f64>>().map_err(PyErr::from)?)
}

/// The values of a 1-D array-like.
pub fn column(field: &'static str, given: &Bound<'_, PyAny>) -> Result<Vec<f64>> {
    let values = array(field, given)?;
    if values.ndim() != 1 {
        return Err(InputError::Dimensions { field, dimensions: values.ndim() }.into());
    }
    Ok(values.readonly().as_slice().map_err(PyErr::from)?.to_vec())
}

/// A numpy record array of named columns.
pub fn record_array<'py>(py: Python<'py>, columns: Vec<(&str, Bound<'py, PyAny>)>) -> Result<Py<PyAny>> {
    let (names, columns): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
    let keywords = PyDict::new(py);
    keywords.set_item("names", names)?;
    let records = py.import("numpy")?.getattr("rec")?.call_method("fromarrays", (columns,), Some(&keywords))?;
    Ok(records.unbind())
}

/// Fewest values worth a thread of their own: some milliseconds of work.
const WORTH_A_THREAD: usize = 1 << 14;

fn map_slice<E: Send>(
    xs: &[f64],
    f: &(impl Fn(&[f64]) -> std::result::Result<Vec<f64>, E> + Sync),
) -> std::result::Result<Vec<f64>, E> {
    if xs.len() <= WORTH_A_THREAD {
        // Asking for the cores reads files, 20 us.
        return f(xs);
    }
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    let share = xs.len().div_ceil(cores).max(WORTH_A_THREAD);
    if xs.len() <= share {
        return f(xs);
    }
    let mut ys = vec![0.0; xs.len()];
    thread::scope(|scope| {
        let fill = |ys: &mut [f64], xs: &[f64]| f(xs).map(|values| ys.copy_from_slice(&values));
        let threads: Vec<_> =
            ys.chunks_mut(share).zip(xs.chunks(share)).map(|(ys, xs)| scope.spawn(move || fill(ys, xs))).collect();
        threads
            .into_iter()
            .try_for_each(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    Ok(ys)
}
