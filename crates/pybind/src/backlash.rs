//! `backlash_from`: measured backlash over angle, with its interval.

use gearmodel::measure::{AngleGrid, MeasuredBacklash as ModelBacklash};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::analysis::{predicted, run_te};
use crate::array::count;
use crate::error::Result;
use crate::pair::GearPair;
use crate::recording::Recording;

/// Measured backlash over the driver's angle.
///
/// Made by :func:`backlash_from`.
#[pyclass(frozen, module = "gearmodel", name = "MeasuredBacklash")]
pub struct MeasuredBacklash {
    theta1: Py<PyArray1<f64>>,
    backlash: Py<PyArray1<f64>>,
    predicted: Py<PyArray1<f64>>,
    low: Py<PyArray1<f64>>,
    high: Py<PyArray1<f64>>,
    min_rad: f64,
    mean_rad: f64,
    max_rad: f64,
    half_width_rad: f64,
}

/// Backlash TE_cw - TE_ccw from a recording of each sense, over theta1, with its 90 % interval.
///
/// Both recordings must share the encoders' zero (one homing): their distance is the backlash. The interval comes from the
/// scatter between the revolutions of each recording, at the bins and of the revolutions' means; with one revolution in
/// either sense it is NaN.
///
/// Args:
///     ccw: the :class:`Recording` of the ccw sense.
///     cw: that of the cw sense.
///     pair: the pair; its documented errors make the prediction, each sense at its own load.
///     bins: bins of theta1 a turn.
///
/// Raises:
///     ValueError: senses exchanged, a recording that reverses, or no common angle.
///
/// >>> import gearmodel as gm, numpy as np
/// >>> pair = gm.GearPair.circular(module_mm=3, teeth=47, backlash_mm=0.1)
/// >>> theta1 = np.linspace(0, 6 * np.pi, 30_000)
/// >>> te_ccw, te_cw = (pair.transmission_error(theta1, direction=d) for d in ("ccw", "cw"))
/// >>> ccw = gm.Recording(theta1, theta1, theta1 + te_ccw, 10, 5, "ccw")
/// >>> cw = gm.Recording(theta1, theta1[::-1], (theta1 + te_cw)[::-1], 10, 5, "cw")
/// >>> b = gm.backlash_from(ccw, cw, pair)
/// >>> round(b.mean_rad * 70.5, 9)
/// 0.1
#[pyfunction]
#[pyo3(signature = (ccw, cw, pair, *, bins=720))]
pub fn backlash_from(
    py: Python<'_>,
    ccw: &Bound<'_, Recording>,
    cw: &Bound<'_, Recording>,
    pair: &Bound<'_, GearPair>,
    bins: i64,
) -> Result<MeasuredBacklash> {
    let grid = AngleGrid::new(count("bins", bins)?)?;
    let model = &pair.get().model;
    let (ccw, cw) = (run_te(py, ccw, &model.pair, grid)?, run_te(py, cw, &model.pair, grid)?);
    let measured = ModelBacklash::of(&ccw, &cw)?;
    let half_width_rad = measured.half_width_rad;
    let measured = measured.backlash;
    let array = |values: &mut dyn Iterator<Item = f64>| PyArray1::from_iter(py, values).unbind();
    let values = &measured.curve.values_rad;
    let predicted_senses = (predicted(model, &cw), predicted(model, &ccw));
    Ok(MeasuredBacklash {
        theta1: array(&mut grid.centres()),
        backlash: array(&mut values.iter().copied()),
        predicted: array(
            &mut predicted_senses.0.values_rad.iter().zip(&predicted_senses.1.values_rad).map(|(cw, ccw)| cw - ccw),
        ),
        low: array(&mut values.iter().map(|value| value - half_width_rad)),
        high: array(&mut values.iter().map(|value| value + half_width_rad)),
        min_rad: measured.min_rad,
        mean_rad: measured.mean_rad,
        max_rad: measured.max_rad,
        half_width_rad,
    })
}

#[pymethods]
impl MeasuredBacklash {
    /// Centres of the bins of theta1, rad, shape (bins,), in [0, 2 pi).
    #[getter]
    fn theta1<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.theta1.bind(py).clone()
    }

    /// Measured backlash at the driven shaft, rad, shape (bins,); NaN where one of the senses was not seen.
    #[getter]
    fn backlash<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.backlash.bind(py).clone()
    }

    /// Backlash that the pair predicts, each sense at its own load, rad, shape (bins,).
    #[getter]
    fn predicted<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.predicted.bind(py).clone()
    }

    /// Lower end of the 90 % interval, rad, shape (bins,).
    #[getter]
    fn low<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.low.bind(py).clone()
    }

    /// Upper end of the 90 % interval, rad, shape (bins,).
    #[getter]
    fn high<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.high.bind(py).clone()
    }

    /// Smallest value over the turn, rad.
    #[getter]
    fn min_rad(&self) -> f64 {
        self.min_rad
    }

    /// Mean over the turn, rad.
    #[getter]
    fn mean_rad(&self) -> f64 {
        self.mean_rad
    }

    /// Largest value over the turn, rad.
    #[getter]
    fn max_rad(&self) -> f64 {
        self.max_rad
    }

    /// Draws backlash over theta1, measured with its interval, and predicted.
    ///
    /// Returns:
    ///     A matplotlib Figure.
    ///
    /// Raises:
    ///     ImportError: matplotlib is missing; says how to install it.
    fn plot<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyAny>> {
        Ok(slf.py().import("gearmodel._plot")?.call_method1("backlash", (slf,))?)
    }

    /// The figures for people, in urad.
    fn __repr__(&self) -> String {
        format!(
            "MeasuredBacklash(min {:.2}, mean {:.2}, max {:.2} urad, 90 % interval +-{:.2} urad)",
            self.min_rad * 1e6,
            self.mean_rad * 1e6,
            self.max_rad * 1e6,
            self.half_width_rad * 1e6,
        )
    }
}
