//! `analyse`: TE of a recording over angle, revolution by revolution.

use gearmodel::measure::{AngleGrid, Curve, Order, RunFigures, RunTe};
use gearmodel::{Direction, GearPair as ModelPair, NominalModel};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::array::record_array;
use crate::error::{InputError, Result};
use crate::pair::GearPair;
use crate::recording::Recording;

/// Measured TE of a recording over the driver's angle, with its figures and the model's prediction.
///
/// Made by :func:`analyse`. Definitions follow the usual single-flank values in spirit; no conformance is claimed. NaN
/// stands where the recording cannot tell.
#[pyclass(frozen, module = "gearmodel", name = "Analysis")]
pub struct Analysis {
    direction: Direction,
    load_nm: f64,
    speed_rpm: f64,
    samples: u64,
    gaps: u64,
    figures: RunFigures,
    theta1: Py<PyArray1<f64>>,
    te: Py<PyArray2<f64>>,
    mean_curve: Py<PyArray1<f64>>,
    predicted: Py<PyArray1<f64>>,
    spectrum: Py<PyAny>,
}

/// TE of a recording of one sense, sample by sample.
pub fn run_te(py: Python<'_>, recording: &Bound<'_, Recording>, pair: &ModelPair, grid: AngleGrid) -> Result<RunTe> {
    let read = recording.get().read(py);
    let recording = read.recording()?;
    Ok(py.detach(|| recording.te(pair, grid))?)
}

/// TE of the model on the grid, rad.
pub fn predicted(model: &NominalModel, run: &RunTe) -> Curve {
    let conditions = run.conditions();
    Curve::from_fn(run.grid(), |theta1_rad| model.te_rad(theta1_rad, conditions.direction, conditions.load_nm))
}

/// TE of a recording over the driver's angle, revolution by revolution, and its figures against the pair.
///
/// Args:
///     rec: a :class:`Recording` of one sense; gaps are skipped.
///     pair: what it is compared with, documented errors included.
///     bins: bins of theta1 a turn, 8 to 2**20; values stand at their centres.
///     highest_order: highest order of the spectrum, at most (bins - 1)/2.
///
/// Raises:
///     ValueError: the recording reverses (take the parts of its ``split()``), or shows no direction.
///
/// >>> import gearmodel as gm, numpy as np
/// >>> pair = gm.GearPair.circular(module_mm=3, teeth=47)
/// >>> theta1 = np.linspace(0, 6 * np.pi, 30_000)
/// >>> te = 1e-4 * np.sin(theta1) + 1e-5 * np.sin(47 * theta1)
/// >>> a = gm.analyse(gm.Recording(theta1 / 0.5, theta1, theta1 + te, 10.0, 4.8, "ccw"), pair)
/// >>> a.te.shape
/// (3, 720)
/// >>> [f"{order.order}: {order.amplitude_rad * 1e6:.1f} urad" for order in a.spectrum[[0, 46]]]
/// ['1: 100.0 urad', '47: 9.9 urad']
#[pyfunction]
#[pyo3(signature = (rec, pair, *, bins=720, highest_order=180))]
pub fn analyse(
    py: Python<'_>,
    rec: &Bound<'_, Recording>,
    pair: &Bound<'_, GearPair>,
    bins: usize,
    highest_order: u32,
) -> Result<Analysis> {
    let grid = AngleGrid::new(bins)?;
    let limit = (bins - 1) / 2;
    if highest_order == 0 || highest_order as usize > limit {
        return Err(InputError::HighestOrder { given: highest_order, limit, bins }.into());
    }
    let model = &pair.get().model;
    let run = run_te(py, rec, &model.pair, grid)?;
    let conditions = run.conditions();
    let (figures, mean_curve, predicted, orders) = py.detach(|| {
        let mean_curve = run.mean_curve();
        let orders = Order::of(grid, &mean_curve, highest_order);
        (RunFigures::of(&run, model, None), mean_curve, predicted(model, &run), orders)
    });
    let mut revolutions: Vec<Vec<f64>> = run.whole_revolutions().map(|(_, curve)| curve.values_rad).collect();
    if revolutions.is_empty() {
        revolutions.push(mean_curve.values_rad.clone());
    }
    Ok(Analysis {
        direction: conditions.direction,
        load_nm: conditions.load_nm,
        speed_rpm: conditions.speed_rpm,
        samples: run.samples(),
        gaps: run.rejected(),
        figures,
        theta1: PyArray1::from_iter(py, grid.centres()).unbind(),
        te: PyArray2::from_vec2(py, &revolutions).map_err(PyErr::from)?.unbind(),
        mean_curve: PyArray1::from_vec(py, mean_curve.values_rad).unbind(),
        predicted: PyArray1::from_vec(py, predicted.values_rad).unbind(),
        spectrum: spectrum(py, &orders)?,
    })
}

/// Orders as a record array.
fn spectrum(py: Python<'_>, orders: &[Order]) -> Result<Py<PyAny>> {
    let number = PyArray1::from_iter(py, orders.iter().map(|order| i64::from(order.order)));
    let amplitude = PyArray1::from_iter(py, orders.iter().map(|order| order.amplitude_rad));
    let phase = PyArray1::from_iter(py, orders.iter().map(|order| order.phase_rad));
    let columns =
        vec![("order", number.into_any()), ("amplitude_rad", amplitude.into_any()), ("phase_rad", phase.into_any())];
    record_array(py, columns)
}

#[pymethods]
impl Analysis {
    /// "ccw" or "cw".
    #[getter]
    fn direction(&self) -> &'static str {
        self.direction.as_str()
    }

    /// Load of the recording (its mean), N m.
    #[getter]
    fn load_nm(&self) -> f64 {
        self.load_nm
    }

    /// Driver speed of the recording (its mean), rpm.
    #[getter]
    fn speed_rpm(&self) -> f64 {
        self.speed_rpm
    }

    /// Samples used.
    #[getter]
    fn samples(&self) -> u64 {
        self.samples
    }

    /// Samples skipped because an angle is NaN.
    #[getter]
    fn gaps(&self) -> u64 {
        self.gaps
    }

    /// Whole revolutions behind the mean curve; 0 for a recording of less than one.
    #[getter]
    fn revolutions(&self) -> usize {
        self.figures.revolutions
    }

    /// Centres of the bins of theta1, rad, shape (bins,), in [0, 2 pi).
    #[getter]
    fn theta1<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.theta1.bind(py).clone()
    }

    /// Measured TE, rad, shape (revolutions, bins): bin means at the bin centres; NaN where no sample fell. A recording of
    /// less than one revolution is one row of what there is.
    #[getter]
    fn te<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.te.bind(py).clone()
    }

    /// Mean of the revolutions, rad, shape (bins,).
    #[getter]
    fn mean_curve<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.mean_curve.bind(py).clone()
    }

    /// TE that the pair predicts at the recording's direction and load, rad, shape (bins,).
    #[getter]
    fn predicted<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.predicted.bind(py).clone()
    }

    /// Orders of the mean curve over theta1: record array with the fields order (periods a turn of the driver),
    /// amplitude_rad and phase_rad, for amplitude cos(order theta1 - phase). Empty where too few bins were seen.
    #[getter]
    fn spectrum<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.spectrum.bind(py).clone()
    }

    /// Total deviation over a turn, F'is-like: peak-to-peak of the mean curve, rad.
    #[getter]
    fn f_i_total(&self) -> f64 {
        self.figures.f_is_total_rad
    }

    /// Tooth-to-tooth deviation, f'is-like: largest peak-to-peak of the mean curve within one pitch of arc length, rad.
    #[getter]
    fn f_i_tooth(&self) -> f64 {
        self.figures.f_is_tooth_rad
    }

    /// Offset that accumulates, rad a revolution along the recording: slope of the revolutions' means.
    #[getter]
    fn cumulative_offset(&self) -> f64 {
        self.figures.offset_per_rev_rad
    }

    /// Repeatability of the mean curve, rad RMS: scatter between the revolutions at a bin, each less its own mean, over
    /// the square root of their number.
    #[getter]
    fn floor(&self) -> f64 {
        self.figures.floor_rms_rad
    }

    /// Mean of the mean curve, rad.
    #[getter]
    fn mean_rad(&self) -> f64 {
        self.figures.mean_rad
    }

    /// Root of the mean square of the mean curve, rad, about the encoders' own zero.
    #[getter]
    fn rms_rad(&self) -> f64 {
        self.figures.rms_rad
    }

    /// Zero between measurement and prediction, rad: their mean difference.
    #[getter]
    fn zero_rad(&self) -> f64 {
        self.figures.zero_rad
    }

    /// RMS of measured - predicted - zero over the bins, rad.
    #[getter]
    fn residual_rms_rad(&self) -> f64 {
        self.figures.residual_rms_rad
    }

    /// Share of the bins that hold a value, 0 to 1.
    #[getter]
    fn coverage(&self) -> f64 {
        self.figures.coverage
    }

    /// Draws TE over theta1, measured and predicted, and the order spectrum.
    ///
    /// Returns:
    ///     A matplotlib Figure.
    ///
    /// Raises:
    ///     ImportError: matplotlib is missing; says how to install it.
    fn plot<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyAny>> {
        Ok(slf.py().import("gearmodel._plot")?.call_method1("analysis", (slf,))?)
    }

    /// The figures for people, in urad.
    fn __repr__(&self) -> String {
        let figures = &self.figures;
        let urad = |value: f64| format!("{:.2} urad", value * 1e6);
        format!(
            "Analysis({} {:?} N m {:?} rpm, {} samples, {} revolutions: total {}, tooth-to-tooth {}, offset {}/rev, floor {}, \
             residual {})",
            self.direction,
            self.load_nm,
            self.speed_rpm,
            self.samples,
            figures.revolutions,
            urad(figures.f_is_total_rad),
            urad(figures.f_is_tooth_rad),
            urad(figures.offset_per_rev_rad),
            urad(figures.floor_rms_rad),
            urad(figures.residual_rms_rad),
        )
    }
}
