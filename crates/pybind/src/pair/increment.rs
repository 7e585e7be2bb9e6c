//! TE and backlash by method: which function of the model answers.

use gearmodel::contact::{ContactError, ContactModel};
use gearmodel::increment::published;
use gearmodel::{Direction, NominalModel};
use pyo3::prelude::*;

use super::GearPair;
use crate::array::Numbers;
use crate::error::{InputError, Result};
use crate::errors::Errors;

/// How TE is computed.
#[derive(Clone, Copy, PartialEq)]
enum Method {
    /// Meshing line increment along the common normal, first order.
    CommonNormal,
    /// Exact tooth contact.
    Exact,
    /// The printed equations of the source document.
    Published,
}

impl Method {
    /// The method of a name.
    fn parse(name: &str) -> Result<Self> {
        match name {
            "common_normal" => Ok(Self::CommonNormal),
            "exact" => Ok(Self::Exact),
            "published" => Ok(Self::Published),
            _ => Err(InputError::Method { given: name.to_owned() }.into()),
        }
    }
}

/// Passes a load that the method can take.
fn check_load(method: Method, load_nm: f64) -> Result<()> {
    if !load_nm.is_finite() {
        return Err(InputError::Load { load_nm }.into());
    }
    if method == Method::Published && load_nm != 0.0 {
        return Err(InputError::PublishedLoad { load_nm }.into());
    }
    Ok(())
}

/// Exact TE, rigid contact and wind-up; an angle that is a gap stays one, as with the other methods.
fn exact_te(
    model: &NominalModel,
    contact: &ContactModel,
    theta1_rad: f64,
    direction: Direction,
    load_nm: f64,
) -> std::result::Result<f64, ContactError> {
    if theta1_rad.is_finite() {
        let windup_rad = model.windup_rad(&model.pair.at(theta1_rad), direction, load_nm);
        contact.te_rad(theta1_rad, direction).map(|rigid_rad| rigid_rad + windup_rad)
    } else {
        Ok(f64::NAN)
    }
}

/// TE at θ1 in one sense, rad, in the shape of `theta1`.
fn transmission_error<'py>(
    py: Python<'py>,
    model: &NominalModel,
    theta1: &Numbers<'py>,
    direction: Direction,
    method: Method,
    load_nm: f64,
    relative_to_start: bool,
) -> Result<Bound<'py, PyAny>> {
    check_load(method, load_nm)?;
    match method {
        Method::CommonNormal => {
            let te = |theta1_rad| model.te_rad(theta1_rad, direction, load_nm);
            let start = if relative_to_start { te(0.0) } else { 0.0 };
            theta1.map(py, |theta1_rad| te(theta1_rad) - start)
        }
        Method::Exact => {
            let contact = ContactModel::new(model.pair.clone(), &model.errors)?;
            let te = |theta1_rad: f64| exact_te(model, &contact, theta1_rad, direction, load_nm);
            let start = if relative_to_start { te(0.0)? } else { 0.0 };
            theta1.try_map(py, |theta1_rad| te(theta1_rad).map(|te_rad| te_rad - start))
        }
        // The start terms are part of the printed form.
        Method::Published => {
            theta1.map(py, |theta1_rad| published::te_rad(&model.pair, &model.errors, theta1_rad, direction))
        }
    }
}

/// Backlash at θ1, rad at the driven shaft, in the shape of `theta1`.
fn backlash<'py>(
    py: Python<'py>,
    model: &NominalModel,
    theta1: &Numbers<'py>,
    method: Method,
    load_nm: f64,
) -> Result<Bound<'py, PyAny>> {
    check_load(method, load_nm)?;
    match method {
        Method::CommonNormal => theta1.map(py, |theta1_rad| model.backlash_rad(theta1_rad, load_nm)),
        Method::Exact => {
            let contact = ContactModel::new(model.pair.clone(), &model.errors)?;
            theta1.try_map(py, |theta1_rad| {
                let [ccw, cw] =
                    Direction::BOTH.map(|direction| exact_te(model, &contact, theta1_rad, direction, load_nm));
                Ok::<_, ContactError>(cw? - ccw?)
            })
        }
        Method::Published => {
            theta1.map(py, |theta1_rad| published::backlash_rad(&model.pair, &model.errors, theta1_rad))
        }
    }
}

#[pymethods]
impl GearPair {
    /// Predicted TE = theta2 - f(theta1), rad at the driven shaft, positive when the driven gear is ahead.
    ///
    /// Args:
    ///     theta1: driver angle, rad; a number or an array-like of any shape.
    ///     errors: these errors in place of the pair's own; None: its own.
    ///     direction: "ccw" or "cw", the driver's sense of rotation and with it the flank that carries. TE of both senses
    ///         counts in the same positive sense of theta2.
    ///     method: "common_normal" (default), "exact" or "published".
    ///         common_normal: meshing line increment over the driven base arm r2 cos(alpha -+ mu); designed backlash
    ///         included; first order in the errors: 0.03 % (k = 0.3287) to 0.07 % (k = 0.6) of the RMS for e = 0.05 mm.
    ///         exact: rigid contact of rack-generated flanks, solved to 1e-12 mm.
    ///         published: the printed equations of the source document, kept for comparison; 52 to 78 % off.
    ///     load_nm: torque on the driven shaft, N m; winds up the compliances of the errors. 0 with "published".
    ///     relative_to_start: subtract the value at theta1 = 0. "published" keeps its printed start terms either way.
    ///
    /// Returns:
    ///     A float, or a float64 array in the shape of theta1.
    ///
    /// Raises:
    ///     ValueError: an unknown direction or method, or a load that the method cannot take.
    ///     GeometryError: no tooth contact at an angle ("exact").
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
    /// >>> errors = gm.Errors(e1_mm=0.05, phi1_rad=0.3, e2_mm=0.03, phi2_rad=1.1)
    /// >>> te = pair.transmission_error(np.linspace(0, 2 * np.pi, 721), errors)
    /// >>> print(f"{np.ptp(te) * 1e6:.0f} urad p-p")
    /// 2661 urad p-p
    #[pyo3(signature = (theta1, errors=None, direction="ccw", method="common_normal", load_nm=0.0, relative_to_start=false))]
    fn transmission_error<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        errors: Option<&Bound<'py, Errors>>,
        direction: &str,
        method: &str,
        load_nm: f64,
        relative_to_start: bool,
    ) -> Result<Bound<'py, PyAny>> {
        let theta1 = Numbers::take("theta1", theta1)?;
        let (direction, method) = (direction.parse::<Direction>()?, Method::parse(method)?);
        let model = self.model_with(errors.map(Bound::get));
        transmission_error(py, &model, &theta1, direction, method, load_nm, relative_to_start)
    }

    /// Predicted backlash TE_cw - TE_ccw at equal theta1, rad at the driven shaft: designed and periodic.
    ///
    /// Args:
    ///     theta1: driver angle, rad; a number or an array-like of any shape.
    ///     errors: these errors in place of the pair's own; None: its own.
    ///     method: as in :meth:`transmission_error`; "published" is the printed periodic part alone.
    ///     load_nm: torque on the driven shaft, N m.
    ///
    /// Returns:
    ///     A float, or a float64 array in the shape of theta1.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=3, teeth=47, backlash_mm=0.1)
    /// >>> round(pair.backlash(0.0) * 70.5, 12)     # j = b r2
    /// 0.1
    #[pyo3(signature = (theta1, errors=None, method="common_normal", load_nm=0.0))]
    fn backlash<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        errors: Option<&Bound<'py, Errors>>,
        method: &str,
        load_nm: f64,
    ) -> Result<Bound<'py, PyAny>> {
        let theta1 = Numbers::take("theta1", theta1)?;
        let model = self.model_with(errors.map(Bound::get));
        backlash(py, &model, &theta1, Method::parse(method)?, load_nm)
    }
}
