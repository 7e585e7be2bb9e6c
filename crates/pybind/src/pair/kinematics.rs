//! Kinematics of the pitch curves over the driver's angle.

use pyo3::prelude::*;

use super::GearPair;
use crate::array::Numbers;
use crate::error::{InputError, Result};

#[pymethods]
impl GearPair {
    /// Driven angle f(theta1), rad: unwrapped, increasing.
    ///
    /// Error: closed form; 1e-10 rad within a few turns. Source: tan(theta2/2) = ((1 + k)/(1 - k)) tan(theta1/2) for the ellipse.
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
    /// >>> pair.theta2(np.zeros((2, 3))).shape
    /// (2, 3)
    /// >>> round(pair.theta2(np.pi / 2), 6)
    /// 2.205946
    fn theta2<'py>(&self, py: Python<'py>, theta1: &Bound<'py, PyAny>) -> Result<Bound<'py, PyAny>> {
        Numbers::take("theta1", theta1)?.map(py, |theta1_rad| self.model.pair.theta2(theta1_rad))
    }

    /// Driver angle at which f(theta1) = theta2, rad: the inverse of :meth:`theta2`.
    fn theta1<'py>(&self, py: Python<'py>, theta2: &Bound<'py, PyAny>) -> Result<Bound<'py, PyAny>> {
        Numbers::take("theta2", theta2)?.map(py, |theta2_rad| self.model.pair.theta2_inverse(theta2_rad))
    }

    /// Ratio i21 = d theta2 / d theta1 = r1/r2.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.6)
    /// >>> round(pair.ratio(0.0), 9)
    /// 4.0
    #[pyo3(signature = (theta1=None))]
    fn ratio<'py>(&self, py: Python<'py>, theta1: Option<&Bound<'py, PyAny>>) -> Result<Bound<'py, PyAny>> {
        let theta1 = theta1.map_or(Ok(Numbers::One(0.0)), |theta1| Numbers::take("theta1", theta1))?;
        theta1.map(py, |theta1_rad| self.model.pair.ratio(theta1_rad))
    }

    /// Pitch radius at the pitch point, mm: r1 of the driver (gear 1) or r2 = a - r1 of the driven gear (gear 2), both over
    /// the driver's angle.
    ///
    /// Raises:
    ///     ValueError: another gear than 1 or 2.
    #[pyo3(signature = (theta1, gear=1))]
    fn radius<'py>(&self, py: Python<'py>, theta1: &Bound<'py, PyAny>, gear: i64) -> Result<Bound<'py, PyAny>> {
        let theta1 = Numbers::take("theta1", theta1)?;
        match gear {
            1 => theta1.map(py, |theta1_rad| self.model.pair.radius(theta1_rad)),
            2 => theta1.map(py, |theta1_rad| self.model.pair.driven_radius(theta1_rad)),
            _ => Err(InputError::Gear { given: gear }.into()),
        }
    }

    /// Inclination mu of the pitch curves' common tangent from the perpendicular of the centre line, rad: tan mu = r1'/r1.
    fn inclination<'py>(&self, py: Python<'py>, theta1: &Bound<'py, PyAny>) -> Result<Bound<'py, PyAny>> {
        Numbers::take("theta1", theta1)?.map(py, |theta1_rad| self.model.pair.inclination(theta1_rad))
    }

    /// Arc length s(theta1) of the driver's pitch curve from theta1 = 0, mm, unwrapped; s/(pi m) counts the teeth.
    fn arc_length_mm<'py>(&self, py: Python<'py>, theta1: &Bound<'py, PyAny>) -> Result<Bound<'py, PyAny>> {
        Numbers::take("theta1", theta1)?.map(py, |theta1_rad| self.model.pair.arc_length_mm(theta1_rad))
    }
}
