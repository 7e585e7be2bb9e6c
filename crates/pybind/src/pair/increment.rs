//! TE and backlash by method: which function of the model answers.

use gearmodel::contact::{ContactError, ContactModel};
use gearmodel::increment::published;
use gearmodel::{Direction, NominalModel};
use pyo3::prelude::*;

use crate::array::Numbers;
use crate::error::{InputError, Result};

/// How TE is computed.
#[derive(Clone, Copy, PartialEq)]
pub enum Method {
    /// Meshing line increment along the common normal, first order.
    CommonNormal,
    /// Exact tooth contact.
    Exact,
    /// The printed equations of the source document.
    Published,
}

impl Method {
    /// The method of a name.
    pub fn parse(name: &str) -> Result<Self> {
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
pub fn transmission_error<'py>(
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
pub fn backlash<'py>(
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
