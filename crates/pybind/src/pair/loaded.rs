//! TE under load with elastic teeth.

use gearmodel::Direction;
use gearmodel::contact::ContactError;
use gearmodel::loaded::{LoadedModel, Material, Supports};
use pyo3::prelude::*;

use super::GearPair;
use super::increment::contact_model;
use crate::array::{Numbers, record_array};
use crate::error::Result;
use crate::errors::Errors;
use crate::tooth_errors::ToothErrors;

/// A gear pair with elastic teeth, bearings and shafts. Made by :meth:`GearPair.loaded`.
///
/// The pairs within their tips share the load with their gaps, as springs in parallel. A quasi-static elastic system does not
/// accumulate: its TE is the same after every turn, whatever the load.
#[pyclass(frozen, module = "gearmodel", name = "LoadedPair")]
pub struct LoadedPair {
    model: LoadedModel,
    pair: String,
}

#[pymethods]
impl GearPair {
    /// The pair with elastic teeth (Weber-Banaschek), bearings and shafts.
    ///
    /// Args:
    ///     errors: eccentricities and shaft compliances in place of the pair's own; None: its own. Their mesh compliance plays
    ///         no part: the teeth's own does.
    ///     tooth_errors, displacement_mm: as in :meth:`transmission_error`.
    ///     bearing_compliance_mm_per_n: of both gears' bearings along the common normal, mm/N.
    ///     bearing_clearance_mm: of both gears' bearings, taken up along the normal once there is a load, mm.
    ///     youngs_modulus_n_per_mm2, poisson: of both gears' material; steel.
    ///     stiffness_correction: measured over calculated stiffness, C_M of ISO 6336-1.
    ///
    /// Raises:
    ///     GeometryError: teeth that a rack cannot cut, a drive without known teeth, or a number outside its range.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=2, teeth=62, face_width_mm=20)
    /// >>> 19 < pair.loaded().mesh_stiffness_n_per_mm_um(0.3, load_nm=124) < 24     # bracket of ISO 6336
    /// True
    #[pyo3(signature = (errors=None, *, tooth_errors=None, displacement_mm=None, bearing_compliance_mm_per_n=0.0,
        bearing_clearance_mm=0.0, youngs_modulus_n_per_mm2=206_000.0, poisson=0.3, stiffness_correction=0.8))]
    fn loaded(
        &self,
        errors: Option<&Bound<'_, Errors>>,
        tooth_errors: Option<&Bound<'_, ToothErrors>>,
        displacement_mm: Option<(f64, f64)>,
        bearing_compliance_mm_per_n: f64,
        bearing_clearance_mm: f64,
        youngs_modulus_n_per_mm2: f64,
        poisson: f64,
        stiffness_correction: f64,
    ) -> Result<LoadedPair> {
        let nominal = self.model_with(errors.map(Bound::get))?;
        let contact = contact_model(&nominal, tooth_errors.map(Bound::get), displacement_mm.unwrap_or_default())?;
        let supports = Supports {
            shaft_compliance_output_rad_per_nm: nominal.errors.shaft_compliance_output_rad_per_nm,
            shaft_compliance_input_rad_per_nm: nominal.errors.shaft_compliance_input_rad_per_nm,
            bearing_compliance_mm_per_n,
            bearing_clearance_mm,
        };
        let material = Material { youngs_modulus_n_per_mm2, poisson, stiffness_correction };
        Ok(LoadedPair { model: LoadedModel::new(contact, supports, material)?, pair: self.__repr__() })
    }
}

/// A quantity of a loaded pair over angles; an angle that is not known has none.
fn over<'py>(
    py: Python<'py>,
    theta1: &Bound<'py, PyAny>,
    quantity: impl Fn(f64) -> std::result::Result<f64, ContactError> + Sync,
) -> Result<Bound<'py, PyAny>> {
    Numbers::take("theta1", theta1)?
        .try_map(py, |theta1_rad| if theta1_rad.is_nan() { Ok(f64::NAN) } else { quantity(theta1_rad) })
}

#[pymethods]
impl LoadedPair {
    /// TE under a torque on the driven shaft, rad: a float, or an array in the shape of theta1.
    ///
    /// Raises:
    ///     ValueError: a load that is negative or not finite, an unknown direction.
    ///     GeometryError: no tooth contact at an angle.
    #[pyo3(signature = (theta1, load_nm, direction="ccw"))]
    fn transmission_error<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        load_nm: f64,
        direction: &str,
    ) -> Result<Bound<'py, PyAny>> {
        let direction = direction.parse::<Direction>()?;
        over(py, theta1, |theta1_rad| self.model.te_rad(theta1_rad, direction, load_nm))
    }

    /// Backlash TE_cw - TE_ccw under a torque on the driven shaft, rad: a float, or an array in the shape of theta1.
    fn backlash<'py>(&self, py: Python<'py>, theta1: &Bound<'py, PyAny>, load_nm: f64) -> Result<Bound<'py, PyAny>> {
        over(py, theta1, |theta1_rad| self.model.backlash_rad(theta1_rad, load_nm))
    }

    /// State of the mesh over theta1 under a torque: record array with the fields theta1_rad, te_rad, force_n (along the common
    /// normal), tooth_deflection_mm (approach by the teeth alone), pairs (tooth pairs that carry), largest_share (of the force
    /// on one pair, 0 to 1).
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.circular(module_mm=3, teeth=40)
    /// >>> mesh = pair.loaded().mesh(np.linspace(0, 0.3, 200), load_nm=50.0)
    /// >>> sorted({int(pairs) for pairs in mesh.pairs})
    /// [1, 2]
    #[pyo3(signature = (theta1, load_nm, direction="ccw"))]
    fn mesh<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        load_nm: f64,
        direction: &str,
    ) -> Result<Py<PyAny>> {
        let direction = direction.parse::<Direction>()?;
        let angles = crate::array::column("theta1", theta1)?;
        let states = py.detach(|| {
            angles
                .iter()
                .map(|theta1_rad| self.model.mesh(*theta1_rad, direction, load_nm))
                .collect::<std::result::Result<Vec<_>, ContactError>>()
        })?;
        let column = |value: &dyn Fn(&gearmodel::loaded::LoadedMesh) -> f64| {
            numpy::PyArray1::from_iter(py, states.iter().map(value)).into_any()
        };
        let pairs = states.iter().map(|state| state.shares.iter().filter(|(_, force_n)| *force_n > 0.0).count() as i64);
        record_array(
            py,
            vec![
                ("theta1_rad", numpy::PyArray1::from_slice(py, &angles).into_any()),
                ("te_rad", column(&|state| state.te_rad)),
                ("force_n", column(&|state| state.force_n)),
                ("tooth_deflection_mm", column(&|state| state.tooth_deflection_mm)),
                ("pairs", numpy::PyArray1::from_iter(py, pairs).into_any()),
                (
                    "largest_share",
                    column(&|state| {
                        state.shares.iter().map(|(_, force_n)| *force_n).fold(0.0, f64::max)
                            / state.shares.iter().map(|(_, force_n)| *force_n).sum::<f64>()
                    }),
                ),
            ],
        )
    }

    /// Mean stiffness of the mesh over a pitch around theta1 per face width, N/(mm um), as c_gamma of ISO 6336 is meant.
    #[pyo3(signature = (theta1, load_nm, direction="ccw"))]
    fn mesh_stiffness_n_per_mm_um<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        load_nm: f64,
        direction: &str,
    ) -> Result<Bound<'py, PyAny>> {
        let direction = direction.parse::<Direction>()?;
        over(py, theta1, |theta1_rad| self.model.mesh_stiffness_n_per_mm_um(theta1_rad, direction, load_nm))
    }

    /// The pair under it.
    fn __repr__(&self) -> String {
        format!("{}.loaded(...)", self.pair)
    }
}
