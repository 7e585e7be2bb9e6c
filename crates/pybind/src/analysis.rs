//! `analyse`: TE of a recording over angle, revolution by revolution.

use gearmodel::measure::{
    AngleGrid, Curve, Order, OrderAxis, OrderSpectrum, RepeatabilityFloor, RunFigures, RunTe, WaveFigures, WaveFilter,
};
use gearmodel::{Direction, GearPair as ModelPair, NominalModel};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::count;
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
    floor: Py<PyAny>,
    grid: AngleGrid,
    pair: Py<GearPair>,
    recording: Py<Recording>,
}

/// Orders of a spectrum where nobody asks for more or fewer: nearly four times the mesh of 47 teeth.
const DEFAULT_HIGHEST_ORDER: u32 = 180;

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
///     highest_order: highest order of the spectra in periods a turn of the driver, at most (bins - 1)/2; None: 180, or what
///         there is. The axes of the driven shaft and the mesh end where the bins resolve no more everywhere.
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
/// >>> [f"{order.order:.0f}: {order.amplitude_rad * 1e6:.1f} urad" for order in a.spectrum[[0, 46]]]
/// ['1: 100.0 urad', '47: 9.9 urad']
#[pyfunction]
#[pyo3(signature = (rec, pair, *, bins=720, highest_order=None))]
pub fn analyse(
    py: Python<'_>,
    rec: &Bound<'_, Recording>,
    pair: &Bound<'_, GearPair>,
    bins: i64,
    highest_order: Option<i64>,
) -> Result<Analysis> {
    let bins = count("bins", bins)?;
    let grid = AngleGrid::new(bins)?;
    let limit = (bins - 1) / 2;
    let highest_order = match highest_order {
        None => DEFAULT_HIGHEST_ORDER.min(limit as u32),
        Some(given) => u32::try_from(given)
            .ok()
            .filter(|order| (1..=limit).contains(&(*order as usize)))
            .ok_or(InputError::HighestOrder { given, limit, bins })?,
    };
    let model = &pair.get().model;
    let run = run_te(py, rec, &model.pair, grid)?;
    let conditions = run.conditions();
    let (figures, mean_curve, predicted, spectra, floor) = py.detach(|| {
        let mean_curve = run.mean_curve();
        let spectra = AXES.map(|(axis, _)| lines(grid, &mean_curve, &model.pair, axis, highest_order));
        let figures = RunFigures::of(&run, model, None);
        (figures, mean_curve, predicted(model, &run), spectra, RepeatabilityFloor::of(&run).ok())
    });
    let floor = python_floor(py, &figures, floor.as_ref())?;
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
        spectrum: python_spectra(py, spectra)?,
        floor,
        grid,
        pair: pair.clone().unbind(),
        recording: rec.clone().unbind(),
    })
}

/// The axes of orders by their names here: those of the diagnosis.
const AXES: [(OrderAxis, &str); 3] =
    [(OrderAxis::Driver, "input"), (OrderAxis::Driven, "output"), (OrderAxis::Mesh, "mesh")];

/// The axis of a name.
fn axis_of(name: &str) -> Result<OrderAxis> {
    let found = AXES.iter().find(|(_, known)| *known == name);
    found.map(|(axis, _)| *axis).ok_or_else(|| InputError::Axis { given: name.to_owned() }.into())
}

/// Orders with amplitudes and phases, mean and RMS; or why there are none.
type Lines = std::result::Result<(Vec<[f64; 3]>, f64, f64), String>;

fn lines(grid: AngleGrid, curve: &Curve, pair: &ModelPair, axis: OrderAxis, highest_order: u32) -> Lines {
    let reason = |error: gearmodel::measure::SpectrumError| error.to_string();
    let limit = OrderSpectrum::highest_line(grid, pair, axis).map_err(reason)?;
    match OrderSpectrum::of(grid, curve, pair, axis, highest_order.min(limit)) {
        Ok(found) => {
            let lines = found.lines.iter().map(|line| [line.order, line.amplitude_rad, line.phase_rad]).collect();
            Ok((lines, found.mean_rad, found.rms_rad))
        }
        // Over the driver's angle least squares bridge gaps, where what was seen fixes the orders.
        Err(_) if axis == OrderAxis::Driver => {
            let orders = Order::of(grid, curve, highest_order);
            let lines = orders.iter().map(|order| [f64::from(order.order), order.amplitude_rad, order.phase_rad]);
            Ok((lines.collect(), f64::NAN, f64::NAN))
        }
        Err(error) => Err(reason(error)),
    }
}

/// A class of `gearmodel._analysis`.
fn class<'py>(py: Python<'py>, name: &str) -> Result<Bound<'py, PyAny>> {
    Ok(py.import(intern!(py, "gearmodel._analysis"))?.getattr(name)?)
}

fn python_spectra(py: Python<'_>, spectra: [Lines; 3]) -> Result<Py<PyAny>> {
    let found = PyDict::new(py);
    for ((_, name), lines) in AXES.iter().zip(spectra) {
        match lines {
            Ok((lines, mean_rad, rms_rad)) => {
                let column = |of: usize| PyArray1::from_iter(py, lines.iter().map(|line| line[of]));
                found.set_item(name, (column(0), column(1), column(2), mean_rad, rms_rad))?;
            }
            Err(reason) => found.set_item(name, reason)?,
        }
    }
    Ok(class(py, "Spectra")?.call1((found,))?.unbind())
}

/// The floor of the figures with its interval. Revolutions with gaps of their own are judged by their common bins: what is
/// taken from there is the interval's width relative to the floor.
fn python_floor(py: Python<'_>, figures: &RunFigures, floor: Option<&RepeatabilityFloor>) -> Result<Py<PyAny>> {
    let rms_rad = figures.floor_rms_rad;
    let end = |bound_rad: f64, floor: &RepeatabilityFloor| {
        if floor.floor_rms_rad > 0.0 { rms_rad * bound_rad / floor.floor_rms_rad } else { bound_rad }
    };
    let (low, high) = floor.map_or((f64::NAN, f64::NAN), |it| (end(it.lower_rms_rad, it), end(it.upper_rms_rad, it)));
    let (confidence, freedom) = floor.map_or((f64::NAN, f64::NAN), |it| (it.confidence, it.degrees_of_freedom));
    let arguments = (rms_rad, low, high, confidence, freedom, figures.revolutions);
    Ok(class(py, "Floor")?.call1(arguments)?.unbind())
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

    /// Orders of the mean curve over both shafts and the mesh: :class:`Spectra` with ``input``, ``output`` and ``mesh``, each
    /// with orders, amplitude_rad and phase_rad; by itself it is that of the input shaft, amplitude cos(order theta1 - phase).
    /// Over the input shaft gaps are bridged by least squares, empty where too few bins were seen.
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
    /// the square root of their number. :class:`Floor`: a float with ``low_rad`` and ``high_rad``, its 90 % interval.
    #[getter]
    fn floor<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.floor.bind(py).clone()
    }

    /// Parts the mean curve into long and short waves by a Gaussian filter without phase shift, written in orders
    /// (transmission of ISO 16610-21; no conformance is claimed).
    ///
    /// Args:
    ///     cut_off_order: the order at which half the amplitude passes to the long waves, > 0, at most a third of the highest
    ///         order that the bins resolve.
    ///     axis: over which orders are counted: "mesh" (once a tooth is order 1), "input" or "output" (once a turn).
    ///
    /// Returns:
    ///     WaveSplit: ``long`` and ``short``, each with its curve, shape (bins,), f_i_total, f_i_tooth, fluctuation_rms_rad.
    ///
    /// Raises:
    ///     ValueError: an unknown axis, a cut-off outside its range, a curve with gaps, no teeth.
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.circular(module_mm=3, teeth=47)
    /// >>> theta1 = np.linspace(0, 4 * np.pi, 40_000)
    /// >>> te = 1e-4 * np.sin(theta1) + 1e-5 * np.sin(47 * theta1)
    /// >>> a = gm.analyse(gm.Recording(theta1, theta1, theta1 + te, 0, 0, "ccw"), pair)
    /// >>> a.waves(cut_off_order=0.3, axis="mesh")
    /// WaveSplit(mesh order 0.3; peak-to-peak in urad long 199.29, short 20.51)
    #[pyo3(signature = (cut_off_order, axis="mesh"))]
    fn waves<'py>(&self, py: Python<'py>, cut_off_order: f64, axis: &str) -> Result<Bound<'py, PyAny>> {
        let filter = WaveFilter { axis: axis_of(axis)?, cut_off_order };
        let curve = Curve { values_rad: self.mean_curve.bind(py).readonly().as_slice().map_err(PyErr::from)?.to_vec() };
        let pair = &self.pair.get().model.pair;
        let split = py.detach(|| filter.split(self.grid, &curve, pair))?;
        let part = |curve: Curve, figures: WaveFigures| {
            let values = PyArray1::from_vec(py, curve.values_rad);
            (values, figures.f_is_total_rad, figures.f_is_tooth_rad, figures.fluctuation_rms_rad)
        };
        let (long, short) = (part(split.long, split.long_figures), part(split.short, split.short_figures));
        Ok(class(py, "WaveSplit")?.call1((axis, cut_off_order, long, short))?)
    }

    /// Mean TE over the angle of a shaft, revolution by revolution of that shaft: what turns with it stays, the rest
    /// averages out. Over the input shaft this is ``mean_curve``.
    ///
    /// Args:
    ///     shaft: "input" or "output".
    ///     bins: bins a turn of the shaft, 8 to 2**20; None: as analysed.
    ///
    /// Returns:
    ///     SynchronousAverage: (theta, te, revolutions, shaft); theta and te in rad, shape (bins,).
    ///
    /// Raises:
    ///     ValueError: an unknown shaft, or bins outside their range.
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.constant(ratio=3.0)
    /// >>> theta1 = np.linspace(0, 24 * np.pi, 100_000)
    /// >>> theta2 = theta1 / 3 + 5e-5 * np.sin(theta1 / 3)
    /// >>> a = gm.analyse(gm.Recording(theta1, theta1, theta2, 0, 0, "ccw"), pair)
    /// >>> a.synchronous_average("output").revolutions, round(1e6 * np.ptp(a.synchronous_average("output").te))
    /// (4, 100)
    #[pyo3(signature = (shaft="input", *, bins=None))]
    fn synchronous_average<'py>(&self, py: Python<'py>, shaft: &str, bins: Option<i64>) -> Result<Bound<'py, PyAny>> {
        let grid = match bins {
            None => self.grid,
            Some(bins) => AngleGrid::new(count("bins", bins)?)?,
        };
        let pair = &self.pair.get().model.pair;
        let read = self.recording.get().read(py);
        let recording = read.recording()?;
        let run = match shaft {
            "input" => py.detach(|| recording.te(pair, grid))?,
            "output" => py.detach(|| recording.te_over_driven(pair, grid))?,
            _ => return Err(InputError::Shaft { given: shaft.to_owned() }.into()),
        };
        let theta = PyArray1::from_iter(py, grid.centres());
        let te = PyArray1::from_vec(py, run.mean_curve().values_rad);
        Ok(class(py, "SynchronousAverage")?.call1((theta, te, run.revolutions(), shaft))?)
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
