//! `Errors`: the documented errors of a pair.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::error::Result;

/// Documented errors of a pair: what the nominal model contains beside the perfect, rigid gears.
///
/// The arguments are the keys of ``[documented]`` in ``pair.toml``; all default to 0. Instances do not change.
///
/// Args:
///     e1_mm: eccentricity of gear 1, from its shaft's axis to the true centre of its pitch curve, mm, >= 0.
///     phi1_rad: its phase, rad: the vector stands at theta1 + phi1 from the centre line, counter-clockwise.
///     e2_mm: eccentricity of gear 2, mm, >= 0.
///     phi2_rad: its phase, rad: the vector stands at theta2 + phi2, counted in the driven (clockwise) sense.
///     shaft_compliance_output_rad_per_nm: of the driven shaft, rad/(N m).
///     shaft_compliance_input_rad_per_nm: of the driving shaft, rad/(N m); seen at the driven shaft times i21 squared.
///     mesh_compliance_mm2_rad_per_nm: along the common normal, mm2 rad/(N m) = 1000 / stiffness in N/mm.
///
/// Raises:
///     GeometryError: a value that is not finite, or a length or compliance below zero.
///
/// >>> import gearmodel as gm
/// >>> gm.Errors(e1_mm=0.05, phi1_rad=0.3)
/// Errors(e1_mm=0.05, phi1_rad=0.3)
#[pyclass(frozen, eq, from_py_object, module = "gearmodel", name = "Errors")]
#[derive(Clone, PartialEq)]
pub struct Errors(pub gearmodel::Errors);

/// Field name and value, in the order of the constructor.
fn fields(errors: &gearmodel::Errors) -> [(&'static str, f64); 7] {
    [
        ("e1_mm", errors.e1_mm),
        ("phi1_rad", errors.phi1_rad),
        ("e2_mm", errors.e2_mm),
        ("phi2_rad", errors.phi2_rad),
        ("shaft_compliance_output_rad_per_nm", errors.shaft_compliance_output_rad_per_nm),
        ("shaft_compliance_input_rad_per_nm", errors.shaft_compliance_input_rad_per_nm),
        ("mesh_compliance_mm2_rad_per_nm", errors.mesh_compliance_mm2_rad_per_nm),
    ]
}

#[pymethods]
impl Errors {
    #[new]
    #[pyo3(signature = (*, e1_mm=0.0, phi1_rad=0.0, e2_mm=0.0, phi2_rad=0.0, shaft_compliance_output_rad_per_nm=0.0,
        shaft_compliance_input_rad_per_nm=0.0, mesh_compliance_mm2_rad_per_nm=0.0))]
    fn new(
        e1_mm: f64,
        phi1_rad: f64,
        e2_mm: f64,
        phi2_rad: f64,
        shaft_compliance_output_rad_per_nm: f64,
        shaft_compliance_input_rad_per_nm: f64,
        mesh_compliance_mm2_rad_per_nm: f64,
    ) -> Result<Self> {
        let errors = gearmodel::Errors {
            e1_mm,
            phi1_rad,
            e2_mm,
            phi2_rad,
            shaft_compliance_output_rad_per_nm,
            shaft_compliance_input_rad_per_nm,
            mesh_compliance_mm2_rad_per_nm,
        };
        errors.check()?;
        Ok(Self(errors))
    }

    /// Eccentricity of gear 1, mm.
    #[getter]
    fn e1_mm(&self) -> f64 {
        self.0.e1_mm
    }

    /// Phase of gear 1's eccentricity, rad.
    #[getter]
    fn phi1_rad(&self) -> f64 {
        self.0.phi1_rad
    }

    /// Eccentricity of gear 2, mm.
    #[getter]
    fn e2_mm(&self) -> f64 {
        self.0.e2_mm
    }

    /// Phase of gear 2's eccentricity, rad.
    #[getter]
    fn phi2_rad(&self) -> f64 {
        self.0.phi2_rad
    }

    /// Compliance of the driven shaft, rad/(N m).
    #[getter]
    fn shaft_compliance_output_rad_per_nm(&self) -> f64 {
        self.0.shaft_compliance_output_rad_per_nm
    }

    /// Compliance of the driving shaft, rad/(N m).
    #[getter]
    fn shaft_compliance_input_rad_per_nm(&self) -> f64 {
        self.0.shaft_compliance_input_rad_per_nm
    }

    /// Compliance of the mesh along the common normal, mm2 rad/(N m).
    #[getter]
    fn mesh_compliance_mm2_rad_per_nm(&self) -> f64 {
        self.0.mesh_compliance_mm2_rad_per_nm
    }

    /// The same errors with some of them replaced.
    ///
    /// >>> import gearmodel as gm
    /// >>> gm.Errors(e1_mm=0.05).replace(e2_mm=0.03)
    /// Errors(e1_mm=0.05, e2_mm=0.03)
    #[pyo3(signature = (**changes))]
    fn replace<'py>(slf: &Bound<'py, Self>, changes: Option<&Bound<'py, PyDict>>) -> Result<Bound<'py, PyAny>> {
        let all = slf.get().to_dict(slf.py())?;
        if let Some(changes) = changes {
            all.update(changes.as_mapping())?;
        }
        Ok(slf.get_type().call((), Some(&all))?)
    }

    /// All errors by name, as plain floats.
    fn to_dict<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, value) in fields(&self.0) {
            all.set_item(name, value)?;
        }
        Ok(all)
    }

    /// Only what is not zero: a perfect pair reads `Errors()`.
    pub fn __repr__(&self) -> String {
        let given: Vec<String> = fields(&self.0)
            .into_iter()
            .filter(|(_, value)| *value != 0.0)
            .map(|(name, value)| format!("{name}={value:?}"))
            .collect();
        format!("Errors({})", given.join(", "))
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::empty(py), self.to_dict(py)?))
    }
}
