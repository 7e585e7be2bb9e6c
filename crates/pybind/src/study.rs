//! `sweep` and `tolerance`: many pairs at once, on all cores. The tables that come back are Python's.

use std::sync::Mutex;

use gearmodel::Direction;
use gearmodel::sensitivity::Parameter;
use gearmodel::sweep::{Sweep, SweepFigure, SweepMethod};
use gearmodel::tolerance::{Scatter, ToleranceStudy};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyMapping};

use crate::array::{column, count};
use crate::error::{InputError, Result};
use crate::errors::Errors;
use crate::pair::GearPair;

/// The parameter of a name, and how many of its units are one of the name's.
fn parameter(name: &str) -> Result<(Parameter, f64)> {
    // Drawings and constructors have the pressure angle in degrees.
    if name == "pressure_angle_deg" {
        return Ok((Parameter::PressureAngleRad, 1_f64.to_radians()));
    }
    let found = Parameter::from_name(name).ok_or_else(|| InputError::unknown_parameter(name))?;
    Ok((found, 1.0))
}

/// Tells a Python callable `(done, total)` about once a hundredth. Its first exception is raised after the run.
struct Progress {
    callable: Option<Py<PyAny>>,
    total: usize,
    next: Mutex<usize>,
    raised: Mutex<Option<PyErr>>,
}

impl Progress {
    fn new(callable: Option<&Bound<'_, PyAny>>, total: usize) -> Self {
        let callable = callable.map(|callable| callable.clone().unbind());
        Self { callable, total, next: Mutex::new(0), raised: Mutex::new(None) }
    }

    fn hear(&self, done: usize) {
        let Some(callable) = &self.callable else { return };
        // A poisoned lock means that another thread panicked: the run ends there anyway.
        let Ok(mut next) = self.next.lock() else { return };
        if done < *next && done != self.total {
            return;
        }
        *next = done.saturating_add((self.total / 100).max(1));
        drop(next);
        let error = Python::attach(|py| callable.call1(py, (done, self.total)).err());
        if let (Some(error), Ok(mut raised), Ok(mut next)) = (error, self.raised.lock(), self.next.lock()) {
            raised.get_or_insert(error);
            *next = usize::MAX;
        }
    }

    fn finish(self) -> Result<()> {
        match self.raised.into_inner().ok().flatten() {
            Some(error) => Err(error.into()),
            None => Ok(()),
        }
    }
}

/// A figure of TE or backlash over a grid of parameters, labelled; on all cores.
///
/// Args:
///     pair: at the grid's origin, of any kind. Where a size of its gears is swept its centre distance follows closure.
///     over: name of a parameter to its values, in the unit of the name: "eccentricity", "e1_mm", "phi1_rad", "e2_mm",
///         "phi2_rad", "backlash_mm", "centre_distance_error_mm", "pressure_angle_rad" (or _deg), "module_mm", "load_nm",
///         "theta1_rad" or a compliance of :class:`Errors`. "eccentricity" belongs to elliptic and lobed pairs and to two
///         equal circular gears; "harmonic_scale", a factor on all amplitudes, to Fourier and transmission curves.
///     of: "te_pp", "te_rms" (about its mean), "te_mean", "backlash_pp" or "backlash_mean", all rad.
///     errors: at the grid's origin; None: the pair's own.
///     direction: "ccw" or "cw", for the figures of TE.
///     method: "common_normal" or "exact".
///     load_nm: torque on the driven shaft, N m.
///     angles: angles a turn.
///     progress: called with (cells done, cells) about a hundred times, from any thread.
///
/// Returns:
///     SweepTable: ``values`` with an axis a parameter, ``axes``, ``faults``; a cell whose pair cannot be made is NaN.
///
/// Raises:
///     ValueError: an unknown name.
///     GeometryError: a parameter of another kind of pair, an empty axis, or too many cells.
///
/// >>> import gearmodel as gm
/// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3)
/// >>> table = gm.sweep(pair, over={"eccentricity": [0.2, 0.4, 0.6], "e1_mm": [0.0, 0.05]}, of="te_pp")
/// >>> table.values.shape
/// (3, 2)
#[pyfunction]
#[pyo3(signature = (pair, over, of="te_pp", *, errors=None, direction="ccw", method="common_normal", load_nm=0.0, angles=720,
    progress=None))]
pub fn sweep<'py>(
    py: Python<'py>,
    pair: &Bound<'py, GearPair>,
    over: &Bound<'py, PyMapping>,
    of: &str,
    errors: Option<&Bound<'py, Errors>>,
    direction: &str,
    method: &str,
    load_nm: f64,
    angles: i64,
    progress: Option<&Bound<'py, PyAny>>,
) -> Result<Bound<'py, PyAny>> {
    let direction = direction.parse::<Direction>()?;
    let figure = match of {
        "te_pp" => SweepFigure::TePp(direction),
        "te_rms" => SweepFigure::TeRms(direction),
        "te_mean" => SweepFigure::TeMean(direction),
        "backlash_pp" => SweepFigure::BacklashPp,
        "backlash_mean" => SweepFigure::BacklashMean,
        _ => return Err(InputError::Figure { given: of.to_owned() }.into()),
    };
    let method = match method {
        "common_normal" => SweepMethod::CommonNormal,
        "exact" => SweepMethod::Exact,
        _ => return Err(InputError::SweptMethod { given: method.to_owned() }.into()),
    };
    let (mut grid, mut shape) = (Vec::new(), Vec::new());
    let axes = PyDict::new(py);
    for item in over.items()?.iter() {
        let (name, values): (String, Bound<'_, PyAny>) = item.extract()?;
        let (parameter, unit) = parameter(&name)?;
        let values = column(parameter.name(), &values)?;
        shape.push(values.len());
        grid.push((parameter, values.iter().map(|value| value * unit).collect()));
        axes.set_item(name, PyArray1::from_vec(py, values))?;
    }
    let sweep = Sweep {
        gears: pair.get().file.gears.clone(),
        errors: errors.map_or(pair.get().model.errors, |errors| errors.get().0),
        load_nm,
        over: grid,
        of: figure,
        method,
        angles: count("angles", angles)?,
    };
    let heard = Progress::new(progress, shape.iter().product());
    let table = py.detach(|| sweep.run(&|done| heard.hear(done)))?;
    heard.finish()?;
    let values = PyArray1::from_vec(py, table.values_rad).reshape(shape)?;
    Ok(py.import("gearmodel._study")?.getattr("SweepTable")?.call1((of, axes, values, table.faults))?)
}

#[pymethods]
impl GearPair {
    /// What scatter of the errors does to TE and backlash: Monte Carlo on the increment along the common normal, on all cores.
    ///
    /// Args:
    ///     errors: nominal errors; None: the pair's own.
    ///     sigma: name of a parameter to its standard deviation, normal about the nominal value: "e1_mm", "phi1_rad",
    ///         "e2_mm", "phi2_rad", "backlash_mm", "centre_distance_error_mm", "load_nm" or a compliance of :class:`Errors`. A
    ///         negative eccentricity drawn is one with its phase turned by pi.
    ///     n: number of pairs drawn, 2 to 2 000 000.
    ///     seed: of the draws; the same seed gives the same pairs on any number of cores.
    ///     uniform: name of a parameter to its half width, uniform about the nominal value (pi for a phase that assembly leaves
    ///         open).
    ///     load_nm: torque on the driven shaft, N m.
    ///     angles: angles a turn.
    ///     progress: called with (pairs done, n) about a hundred times, from any thread.
    ///
    /// Returns:
    ///     Tolerance: figures "te_ccw_pp_rad", "te_cw_pp_rad", "backlash_min_rad", "backlash_mean_rad", "backlash_pp_rad",
    ///     each with its values, quantiles, and the parameters' first-order (Sobol-like) shares.
    ///
    /// Raises:
    ///     ValueError: a parameter that is unknown, no error of made gears, or given twice.
    ///     GeometryError: a number outside its range.
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
    /// >>> t = pair.tolerance(sigma={"e1_mm": 0.02, "e2_mm": 0.02}, uniform={"phi1_rad": np.pi, "phi2_rad": np.pi}, n=2000)
    /// >>> t["te_ccw_pp_rad"].quantile_rad([0.5, 0.95]).shape
    /// (2,)
    #[pyo3(signature = (errors=None, sigma=None, n=100_000, seed=0, *, uniform=None, load_nm=0.0, angles=720, progress=None))]
    fn tolerance<'py>(
        &self,
        py: Python<'py>,
        errors: Option<&Bound<'py, Errors>>,
        sigma: Option<&Bound<'py, PyMapping>>,
        n: i64,
        seed: i128,
        uniform: Option<&Bound<'py, PyMapping>>,
        load_nm: f64,
        angles: i64,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>> {
        let mut scatter = Vec::new();
        for (given, kind) in [(sigma, Scatter::Normal as fn(f64) -> Scatter), (uniform, Scatter::Uniform)] {
            let Some(given) = given else { continue };
            for item in given.items()?.iter() {
                let (name, width): (String, f64) = item.extract()?;
                let (parameter, unit) = parameter(&name)?;
                scatter.push((parameter, kind(width * unit)));
            }
        }
        let (pairs, angles, seed) = (count("n", n)?, count("angles", angles)?, count("seed", seed)?);
        let study = ToleranceStudy { scatter, load_nm, pairs, angles, seed };
        let model = self.model_with(errors.map(Bound::get))?;
        let heard = Progress::new(progress, pairs);
        let figures = py.detach(|| study.run(&model, &|done| heard.hear(done)))?;
        heard.finish()?;
        let tables = PyList::empty(py);
        for figure in figures {
            let shares = PyDict::new(py);
            for (parameter, share) in &figure.shares {
                shares.set_item(parameter.name(), share)?;
            }
            tables.append((
                figure.name,
                PyArray1::from_vec(py, figure.values_rad),
                figure.mean_rad,
                figure.std_rad,
                shares,
            ))?;
        }
        Ok(py.import("gearmodel._study")?.getattr("Tolerance")?.call1((tables,))?)
    }
}
