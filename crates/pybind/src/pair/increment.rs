//! TE and backlash by method: which function of the model answers.

use gearmodel::contact::{ContactError, ContactModel};
use gearmodel::effect::predict::Condition;
use gearmodel::increment::published;
use gearmodel::sensitivity::Parameter;
use gearmodel::{Direction, NominalModel};
use pyo3::prelude::*;

use super::GearPair;
use crate::array::Numbers;
use crate::error::{InputError, Result};
use crate::errors::Errors;
use crate::tooth_errors::ToothErrors;

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

/// What TE is asked of: a model, by a method, under a load.
struct Question {
    model: NominalModel,
    method: Method,
    /// The contact behind the exact method, and behind single teeth and displaced axes.
    contact: Option<ContactModel>,
    load_nm: f64,
    /// Driver speed, time and revolutions since the campaign's start: for documented effects.
    since: Since,
}

/// What documented effects depend on beside angle, sense and load.
#[derive(Clone, Copy, Default)]
struct Since {
    speed_rpm: f64,
    time_s: f64,
    revolutions: f64,
}

/// A contact of a model with errors of single teeth and displaced axes.
pub fn contact_model(
    model: &NominalModel,
    tooth_errors: Option<&ToothErrors>,
    (dx_mm, dy_mm): (f64, f64),
) -> Result<ContactModel> {
    let mut contact = ContactModel::new(model.pair.clone(), &model.errors)?.with_displacement(dx_mm, dy_mm)?;
    if let Some(tooth_errors) = tooth_errors {
        contact = contact.with_tooth_errors(tooth_errors.0.clone())?;
    }
    Ok(contact)
}

impl Question {
    fn new(
        model: NominalModel,
        method: &str,
        load_nm: f64,
        tooth_errors: Option<&Bound<'_, ToothErrors>>,
        displacement_mm: (f64, f64),
    ) -> Result<Self> {
        let method = Method::parse(method)?;
        if !load_nm.is_finite() {
            return Err(InputError::Load { load_nm }.into());
        }
        let beyond_eccentricity = tooth_errors.is_some() || displacement_mm != (0.0, 0.0);
        if method == Method::Published {
            if load_nm != 0.0 {
                return Err(InputError::PublishedLoad { load_nm }.into());
            }
            if beyond_eccentricity {
                return Err(InputError::PublishedErrors.into());
            }
        }
        let contact = if method == Method::Exact || beyond_eccentricity {
            Some(contact_model(&model, tooth_errors.map(Bound::get), displacement_mm)?)
        } else {
            None
        };
        Ok(Self { model, method, contact, load_nm, since: Since::default() })
    }

    /// TE at θ1, rad; an angle that is a gap stays one, whatever the method.
    fn te_rad(&self, theta1_rad: f64, direction: Direction) -> std::result::Result<f64, ContactError> {
        if !theta1_rad.is_finite() {
            return Ok(f64::NAN);
        }
        let model = &self.model;
        let Since { speed_rpm, time_s, revolutions } = self.since;
        let under = Condition { direction, load_nm: self.load_nm, speed_rpm, time_s, revolutions };
        match (self.method, &self.contact) {
            (Method::Published, _) => Ok(published::te_rad(&model.pair, &model.errors, theta1_rad, direction)),
            (_, None) => Ok(model.te_under_rad(theta1_rad, &under)),
            (method, Some(contact)) => {
                let unloaded_rad = if method == Method::Exact {
                    contact.te_rad(theta1_rad, direction)?
                } else {
                    contact.first_order_te_rad(theta1_rad, direction)?
                };
                let windup_rad = model.windup_rad(&model.pair.at(theta1_rad), direction, self.load_nm);
                Ok(unloaded_rad + windup_rad + model.effects_te_rad(theta1_rad, &under))
            }
        }
    }

    /// TE at many angles, rad: by exact contact they cost less together than one by one.
    fn te_curve_rad(&self, theta1_rad: &[f64], direction: Direction) -> std::result::Result<Vec<f64>, ContactError> {
        let Some(contact) = self.contact.as_ref().filter(|_| self.method == Method::Exact) else {
            return theta1_rad.iter().map(|theta| self.te_rad(*theta, direction)).collect();
        };
        let mut te_rad = contact.te_curve_rad(theta1_rad, direction)?;
        if self.load_nm != 0.0 {
            let model = &self.model;
            for (te_rad, theta) in te_rad.iter_mut().zip(theta1_rad) {
                *te_rad += model.windup_rad(&model.pair.at(*theta), direction, self.load_nm);
            }
        }
        Ok(te_rad)
    }

    /// Backlash at many angles, rad at the driven shaft.
    fn backlash_curve_rad(&self, theta1_rad: &[f64]) -> std::result::Result<Vec<f64>, ContactError> {
        if self.method != Method::Exact {
            return theta1_rad.iter().map(|theta| self.backlash_rad(*theta)).collect();
        }
        let mut backlash_rad = self.te_curve_rad(theta1_rad, Direction::Cw)?;
        for (cw, ccw) in backlash_rad.iter_mut().zip(self.te_curve_rad(theta1_rad, Direction::Ccw)?) {
            *cw -= ccw;
        }
        Ok(backlash_rad)
    }

    /// Backlash at θ1, rad at the driven shaft.
    fn backlash_rad(&self, theta1_rad: f64) -> std::result::Result<f64, ContactError> {
        if self.method == Method::Published {
            return Ok(published::backlash_rad(&self.model.pair, &self.model.errors, theta1_rad));
        }
        Ok(self.te_rad(theta1_rad, Direction::Cw)? - self.te_rad(theta1_rad, Direction::Ccw)?)
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
    ///     load_nm: torque on the driven shaft, N m; winds up the compliances of the errors. 0 with "published". Elastic
    ///         teeth: :meth:`loaded`.
    ///     relative_to_start: subtract the value at theta1 = 0. "published" keeps its printed start terms either way.
    ///     tooth_errors: :class:`ToothErrors` of single teeth; not with "published".
    ///     displacement_mm: (dx, dy) of gear 1's axis against gear 2's, mm, constant in the fixed frame; a centre distance
    ///         grown by da is (-da, 0). Not with "published".
    ///     speed_rpm, time_s, revolutions: driver speed, and time and driver revolutions since the campaign's start, for
    ///         documented effects that depend on them (time_skew, thermal_drift, slip, ...).
    ///
    /// Returns:
    ///     A float, or a float64 array in the shape of theta1.
    ///
    /// Raises:
    ///     ValueError: an unknown direction or method, or a load that the method cannot take.
    ///     GeometryError: an error that does not fit the pair, or no tooth contact at an angle.
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
    /// >>> errors = gm.Errors(e1_mm=0.05, phi1_rad=0.3, e2_mm=0.03, phi2_rad=1.1)
    /// >>> te = pair.transmission_error(np.linspace(0, 2 * np.pi, 721), errors)
    /// >>> print(f"{np.ptp(te) * 1e6:.0f} urad p-p")
    /// 2661 urad p-p
    #[pyo3(signature = (theta1, errors=None, direction="ccw", method="common_normal", load_nm=0.0, relative_to_start=false,
        *, tooth_errors=None, displacement_mm=None, speed_rpm=0.0, time_s=0.0, revolutions=0.0))]
    fn transmission_error<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        errors: Option<&Bound<'py, Errors>>,
        direction: &str,
        method: &str,
        load_nm: f64,
        relative_to_start: bool,
        tooth_errors: Option<&Bound<'py, ToothErrors>>,
        displacement_mm: Option<(f64, f64)>,
        speed_rpm: f64,
        time_s: f64,
        revolutions: f64,
    ) -> Result<Bound<'py, PyAny>> {
        let theta1 = Numbers::take("theta1", theta1)?;
        let direction = direction.parse::<Direction>()?;
        let model = self.model_with(errors.map(Bound::get))?;
        let mut question = Question::new(model, method, load_nm, tooth_errors, displacement_mm.unwrap_or_default())?;
        for (name, value) in [("speed_rpm", speed_rpm), ("time_s", time_s), ("revolutions", revolutions)] {
            if !value.is_finite() {
                return Err(InputError::NotFinite { name, value }.into());
            }
        }
        question.since = Since { speed_rpm, time_s, revolutions };
        // The start terms are part of the printed form.
        let from_start = relative_to_start && question.method != Method::Published;
        let start_rad = if from_start { question.te_rad(0.0, direction)? } else { 0.0 };
        theta1.try_map_all(py, |theta1_rad| {
            let mut te_rad = question.te_curve_rad(theta1_rad, direction)?;
            te_rad.iter_mut().for_each(|te_rad| *te_rad -= start_rad);
            Ok::<_, ContactError>(te_rad)
        })
    }

    /// Predicted backlash TE_cw - TE_ccw at equal theta1, rad at the driven shaft: designed and periodic.
    ///
    /// Args:
    ///     theta1: driver angle, rad; a number or an array-like of any shape.
    ///     errors: these errors in place of the pair's own; None: its own.
    ///     method: as in :meth:`transmission_error`; "published" is the printed periodic part alone.
    ///     load_nm: torque on the driven shaft, N m.
    ///     tooth_errors, displacement_mm: as in :meth:`transmission_error`.
    ///
    /// Returns:
    ///     A float, or a float64 array in the shape of theta1.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=3, teeth=47, backlash_mm=0.1)
    /// >>> round(pair.backlash(0.0) * 70.5, 12)     # j = b r2
    /// 0.1
    #[pyo3(signature = (theta1, errors=None, method="common_normal", load_nm=0.0, *, tooth_errors=None,
        displacement_mm=None))]
    fn backlash<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        errors: Option<&Bound<'py, Errors>>,
        method: &str,
        load_nm: f64,
        tooth_errors: Option<&Bound<'py, ToothErrors>>,
        displacement_mm: Option<(f64, f64)>,
    ) -> Result<Bound<'py, PyAny>> {
        let theta1 = Numbers::take("theta1", theta1)?;
        let model = self.model_with(errors.map(Bound::get))?;
        let question = Question::new(model, method, load_nm, tooth_errors, displacement_mm.unwrap_or_default())?;
        theta1.try_map_all(py, |theta1_rad| question.backlash_curve_rad(theta1_rad))
    }

    /// Exact derivative of the nominal TE (common normal) by a parameter, rad per unit of the parameter.
    ///
    /// Args:
    ///     theta1: driver angle, rad; a number or an array-like of any shape.
    ///     parameter: "e1_mm", "phi1_rad", "e2_mm", "phi2_rad", "backlash_mm", "centre_distance_error_mm",
    ///         "pressure_angle_rad", "module_mm", "eccentricity" (elliptic and lobed pairs), "shaft_compliance_output_rad_per_nm",
    ///         "shaft_compliance_input_rad_per_nm", "mesh_compliance_mm2_rad_per_nm", "load_nm" or "theta1_rad".
    ///     errors, direction, load_nm: as in :meth:`transmission_error`.
    ///
    /// Raises:
    ///     ValueError: an unknown parameter, or one that this kind of pair does not have.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=3, teeth=40)
    /// >>> round(pair.te_derivative(0.0, "backlash_mm") * 60, 12)     # -j/(2 r2)
    /// -0.5
    #[pyo3(signature = (theta1, parameter, errors=None, direction="ccw", load_nm=0.0))]
    fn te_derivative<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        parameter: &str,
        errors: Option<&Bound<'py, Errors>>,
        direction: &str,
        load_nm: f64,
    ) -> Result<Bound<'py, PyAny>> {
        let theta1 = Numbers::take("theta1", theta1)?;
        let direction = direction.parse::<Direction>()?;
        let known = Parameter::from_name(parameter).ok_or_else(|| InputError::unknown_parameter(parameter))?;
        if !load_nm.is_finite() {
            return Err(InputError::Load { load_nm }.into());
        }
        let model = self.model_with(errors.map(Bound::get))?;
        if model.te_derivative(known, 0.0, direction, load_nm).is_none() {
            return Err(InputError::ForeignParameter { given: known.name(), kind: self.model.pair.kind() }.into());
        }
        // A pair has a parameter at every angle or at none.
        theta1.map(py, |theta1_rad| model.te_derivative(known, theta1_rad, direction, load_nm).unwrap_or(f64::NAN))
    }
}
