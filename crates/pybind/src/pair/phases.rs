//! `optimal_phases`: how to mount two eccentric gears.

use gearmodel::Direction;
use gearmodel::phase::{self, PhaseFreedom, PhaseObjective, PhaseStudy};
use pyo3::prelude::*;
use pyo3::types::PyString;

use super::GearPair;
use crate::error::{InputError, Result};
use crate::errors::Errors;

/// Mounting phases and what they give.
#[pyclass(frozen, eq, get_all, module = "gearmodel", name = "PhaseValue")]
#[derive(Clone, Copy, PartialEq)]
pub struct PhaseValue {
    /// Phase of gear 1's eccentricity, rad, in (-pi, pi].
    phi1_rad: f64,
    /// Phase of gear 2's eccentricity, rad, in (-pi, pi].
    phi2_rad: f64,
    /// The objective there, rad peak-to-peak.
    value_rad: f64,
}

impl From<phase::PhaseValue> for PhaseValue {
    fn from(value: phase::PhaseValue) -> Self {
        Self { phi1_rad: value.phi1_rad, phi2_rad: value.phi2_rad, value_rad: value.value_rad }
    }
}

#[pymethods]
impl PhaseValue {
    /// The three values.
    fn __repr__(&self) -> String {
        let Self { phi1_rad, phi2_rad, value_rad } = self;
        format!("PhaseValue(phi1_rad={phi1_rad:.6}, phi2_rad={phi2_rad:.6}, value_rad={value_rad:.6e})")
    }
}

/// The best mounting phases beside the printed prescription. Made by :meth:`GearPair.optimal_phases`.
#[pyclass(frozen, module = "gearmodel", name = "Phases")]
pub struct Phases {
    best: PhaseValue,
    published: [PhaseValue; 2],
}

#[pymethods]
impl Phases {
    /// Best phase of gear 1's eccentricity, rad, in (-pi, pi].
    #[getter]
    fn phi1_rad(&self) -> f64 {
        self.best.phi1_rad
    }

    /// Best phase of gear 2's eccentricity, rad, in (-pi, pi].
    #[getter]
    fn phi2_rad(&self) -> f64 {
        self.best.phi2_rad
    }

    /// The objective there, rad peak-to-peak.
    #[getter]
    fn value_rad(&self) -> f64 {
        self.best.value_rad
    }

    /// The printed prescription phi1 = pi - alpha +- n pi, phi2 = alpha +- n pi, with n even for both, and with n even
    /// and odd: a tuple of two :class:`PhaseValue`.
    #[getter]
    fn published(&self) -> (PhaseValue, PhaseValue) {
        self.published.into()
    }

    /// The best, and the better of the printed ones.
    fn __repr__(&self) -> String {
        let [even, odd] = &self.published;
        let printed = even.value_rad.min(odd.value_rad);
        let PhaseValue { phi1_rad, phi2_rad, value_rad } = self.best;
        format!(
            "Phases(phi1_rad={phi1_rad:.6}, phi2_rad={phi2_rad:.6}, value_rad={value_rad:.6e}; published at best {printed:.6e})"
        )
    }
}

fn freedom(gear: &'static str, given: &Bound<'_, PyAny>) -> Result<PhaseFreedom> {
    let refused = || InputError::Freedom { gear, given: given.to_string() };
    if let Ok(text) = given.cast::<PyString>() {
        return match text.to_str()? {
            "hub" => Ok(PhaseFreedom::Hub),
            "fixed" => Ok(PhaseFreedom::Fixed),
            _ => Err(refused().into()),
        };
    }
    match given.extract::<u32>() {
        Ok(steps) if (1..=100_000).contains(&steps) => Ok(PhaseFreedom::Index { steps }),
        _ => Err(refused().into()),
    }
}

#[pymethods]
impl GearPair {
    /// Mounting phases that make an error smallest: the global minimum over the freedoms that assembly has.
    ///
    /// Args:
    ///     errors: their eccentricities and, where a gear is not free, phases; None: the pair's own.
    ///     objective: "backlash" (peak-to-peak of the periodic backlash), "te_ccw", "te_cw" (of TE in one sense), "te_both"
    ///         (the larger of both senses).
    ///     driver, driven: how each gear's eccentricity can be turned: "hub" (by any angle), "fixed", or the number of
    ///         steps a turn by which it can be indexed (the teeth of a circular gear).
    ///
    /// Returns:
    ///     Phases: phi1_rad, phi2_rad, value_rad (rad peak-to-peak), and the printed prescription as ``published``.
    ///
    /// Error: the peak-to-peak is taken on 720 angles, 1e-5 of itself; first order in the errors (common normal).
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
    /// >>> phases = pair.optimal_phases(gm.Errors(e1_mm=0.05, e2_mm=0.05))
    /// >>> [f"{np.degrees(p.value_rad):.4f} deg" for p in (phases, *phases.published)]
    /// ['0.0222 deg', '0.1221 deg', '0.0506 deg']
    #[pyo3(signature = (errors=None, objective="backlash", driver=None, driven=None))]
    fn optimal_phases(
        &self,
        py: Python<'_>,
        errors: Option<&Bound<'_, Errors>>,
        objective: &str,
        driver: Option<&Bound<'_, PyAny>>,
        driven: Option<&Bound<'_, PyAny>>,
    ) -> Result<Phases> {
        let objective = match objective {
            "backlash" => PhaseObjective::Backlash,
            "te_ccw" => PhaseObjective::TransmissionError(Direction::Ccw),
            "te_cw" => PhaseObjective::TransmissionError(Direction::Cw),
            "te_both" => PhaseObjective::TransmissionErrorBoth,
            _ => return Err(InputError::Objective { given: objective.to_owned() }.into()),
        };
        let driver = driver.map_or(Ok(PhaseFreedom::Hub), |given| freedom("driver", given))?;
        let driven = driven.map_or(Ok(PhaseFreedom::Hub), |given| freedom("driven", given))?;
        let model = self.model_with(errors.map(Bound::get))?;
        let phases = py.detach(|| {
            Ok::<_, gearmodel::GeometryError>(
                PhaseStudy::new(&model.pair, &model.errors, objective)?.optimal(driver, driven),
            )
        })?;
        Ok(Phases { best: phases.best.into(), published: phases.published.map(Into::into) })
    }
}
