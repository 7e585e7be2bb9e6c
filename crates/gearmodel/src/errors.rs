//! Documented errors of a pair: what the nominal model already contains.

use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

use crate::GeometryError;
use crate::geometry_error::check_range;

/// Measured or specified errors and compliances of a pair; the default is a perfect, rigid pair.
///
/// The fields are the keys of `[documented]` in `pair.toml`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Errors {
    /// Eccentricity of gear 1: distance from its shaft's axis to the true centre of its pitch curve, mm.
    pub e1_mm: f64,
    /// Phase of e1: the vector stands at θ1 + φ1 from +x, counter-clockwise, rad.
    pub phi1_rad: f64,
    /// Eccentricity of gear 2, mm.
    pub e2_mm: f64,
    /// Phase of e2: the vector stands at θ2 + φ2 from +x, counted in the driven sense (clockwise), rad.
    pub phi2_rad: f64,
    /// Compliance of the driven shaft, rad/(N·m).
    pub shaft_compliance_output_rad_per_nm: f64,
    /// Compliance of the driving shaft, rad/(N·m); seen at the driven shaft multiplied by i21².
    pub shaft_compliance_input_rad_per_nm: f64,
    /// Compliance of the mesh along the common normal, mm²·rad/(N·m) = 1000 / stiffness in N/mm.
    pub mesh_compliance_mm2_rad_per_nm: f64,
}

/// Largest eccentricity that the first-order increment still describes as a small displacement, mm.
const MAX_ECCENTRICITY_MM: f64 = 100.0;

impl Errors {
    /// A perfect, rigid pair.
    pub const NONE: Self = Self {
        e1_mm: 0.0,
        phi1_rad: 0.0,
        e2_mm: 0.0,
        phi2_rad: 0.0,
        shaft_compliance_output_rad_per_nm: 0.0,
        shaft_compliance_input_rad_per_nm: 0.0,
        mesh_compliance_mm2_rad_per_nm: 0.0,
    };

    /// Eccentricities of 1 mm along both axes, gear 1's then gear 2's: TE to first order is a sum of what they make, e cos φ times
    /// the first and e sin φ times the second of each gear.
    pub(crate) const UNIT_ECCENTRICITIES: [Self; 4] = [
        Self { e1_mm: 1.0, ..Self::NONE },
        Self { e1_mm: 1.0, phi1_rad: FRAC_PI_2, ..Self::NONE },
        Self { e2_mm: 1.0, ..Self::NONE },
        Self { e2_mm: 1.0, phi2_rad: FRAC_PI_2, ..Self::NONE },
    ];

    /// Passes errors that are finite, with lengths and compliances that are not negative.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] or [`GeometryError::OutOfRange`], naming the field.
    pub fn check(&self) -> Result<(), GeometryError> {
        let angle = (-1.0e9, 1.0e9);
        let length = (0.0, MAX_ECCENTRICITY_MM);
        let compliance = (0.0, 1.0e9);
        let turn = "write a negative eccentricity as a positive one with its phase turned by pi";
        let phase = "reduce the phase by whole turns";
        let stiff = "a compliance cannot be negative";
        check_range("e1_mm", self.e1_mm, "mm", length, turn)?;
        check_range("phi1_rad", self.phi1_rad, "rad", angle, phase)?;
        check_range("e2_mm", self.e2_mm, "mm", length, turn)?;
        check_range("phi2_rad", self.phi2_rad, "rad", angle, phase)?;
        check_range(
            "shaft_compliance_output_rad_per_nm",
            self.shaft_compliance_output_rad_per_nm,
            "rad/(N.m)",
            compliance,
            stiff,
        )?;
        check_range(
            "shaft_compliance_input_rad_per_nm",
            self.shaft_compliance_input_rad_per_nm,
            "rad/(N.m)",
            compliance,
            stiff,
        )?;
        check_range(
            "mesh_compliance_mm2_rad_per_nm",
            self.mesh_compliance_mm2_rad_per_nm,
            "mm2.rad/(N.m)",
            compliance,
            stiff,
        )?;
        Ok(())
    }
}
