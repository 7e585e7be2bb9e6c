//! `diagnose`: the gap between a pair's nominal model and recordings.

use std::path::PathBuf;

use diagnosis::{CampaignLogs, Options};
use gearmodel::Direction;
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::array::Numbers;
use crate::error::{Raised, Result};
use crate::pair::GearPair;
use crate::recording::Recording;

impl From<diagnosis::GapError> for Raised {
    fn from(error: diagnosis::GapError) -> Self {
        pyo3::exceptions::PyValueError::new_err(error.to_string()).into()
    }
}

/// The native half of a diagnosis.
#[pyclass(frozen, module = "gearmodel._native", name = "NativeDiagnosis")]
pub struct NativeDiagnosis {
    diagnosis: diagnosis::Diagnosis,
    nominal: diagnosis::Nominal,
}

#[pymethods]
impl NativeDiagnosis {
    /// All fields as JSON text.
    fn to_json(&self) -> String {
        self.diagnosis.to_json()
    }

    /// A self-contained page.
    fn to_html(&self) -> String {
        diagnosis::html::page(&self.diagnosis)
    }

    /// The summary for people.
    fn summary(&self) -> String {
        diagnosis::summary::text(&self.diagnosis)
    }

    /// (label, theta1_rad, before_rad, after_rad) of every run.
    fn curves<'py>(&self, py: Python<'py>) -> Vec<CurveArrays<'py>> {
        self.diagnosis
            .curves
            .iter()
            .map(|c| {
                (
                    c.label.clone(),
                    PyArray1::from_slice(py, &c.theta1_rad),
                    PyArray1::from_slice(py, &c.before_rad),
                    PyArray1::from_slice(py, &c.after_rad),
                )
            })
            .collect()
    }

    /// TE of the nominal model with the found effects, and its standard deviation, rad.
    #[pyo3(signature = (theta1, *, direction, load_nm, speed_rpm, time_s, revolutions))]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        direction: &str,
        load_nm: f64,
        speed_rpm: f64,
        time_s: f64,
        revolutions: f64,
    ) -> Result<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let direction: Direction = direction.parse()?;
        let at = gearmodel::effect::predict::Condition { direction, load_nm, speed_rpm, time_s, revolutions };
        let found = &self.diagnosis.found;
        let theta1 = Numbers::take("theta1", theta1)?;
        let te = theta1
            .map(py, |theta1_rad| self.nominal.te_under_rad(theta1_rad, &at) + found.te_rad(theta1_rad, &at).0)?;
        let std = theta1.map(py, |theta1_rad| found.te_rad(theta1_rad, &at).1)?;
        Ok((te, std))
    }

    /// The pair with the found effects documented, and what could not be written down.
    fn calibrated(&self, pair: &Bound<'_, GearPair>) -> Result<(GearPair, Vec<String>)> {
        let (file, left_out) = pair.get().file.with_found(&self.diagnosis.found)?;
        Ok((GearPair::from_file(file)?, left_out))
    }
}

type CurveArrays<'py> = (String, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// The gap between a pair's nominal model and recordings; see `gearmodel.diagnose`.
#[pyfunction]
#[pyo3(signature = (recordings, pair, known, exclude))]
pub fn diagnose(
    py: Python<'_>,
    recordings: Vec<Bound<'_, Recording>>,
    pair: &Bound<'_, GearPair>,
    known: Vec<String>,
    exclude: Vec<String>,
) -> Result<NativeDiagnosis> {
    let reads: Vec<_> = recordings.iter().map(|r| r.get().read(py)).collect();
    let recordings = reads.iter().map(|read| read.recording()).collect::<Result<Vec<_>>>()?;
    let model = pair.get().model.clone();
    let options = Options { known, exclude, ..Options::default() };
    let (diagnosis, nominal) = py.detach(|| diagnosis::diagnose_with_nominal(&recordings, &model, &options))?;
    Ok(NativeDiagnosis { diagnosis, nominal })
}

/// The gap between a pair's nominal model and logs, which are read block by block and never held; see `gearmodel.diagnose`.
#[pyfunction]
#[pyo3(signature = (paths, pair, known, exclude))]
pub fn diagnose_logs(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    pair: &Bound<'_, GearPair>,
    known: Vec<String>,
    exclude: Vec<String>,
) -> Result<(NativeDiagnosis, Vec<String>)> {
    let model = pair.get().model.clone();
    let options = Options { known, exclude, ..Options::default() };
    py.detach(|| {
        let logs = CampaignLogs::open(&paths)?;
        let nominal = logs.nominal(model);
        let reduced = logs.reduce(&nominal, &options.settings)?;
        let incomplete = reduced.incomplete();
        let diagnosis = diagnosis::diagnose_runs(&nominal, reduced.runs, &options)?;
        Ok((NativeDiagnosis { diagnosis, nominal }, incomplete))
    })
}
