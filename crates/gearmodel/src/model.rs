//! The nominal model: a pair with its documented errors under load.

use crate::increment::common_normal;
use crate::{Direction, Errors, GearPair, GeometryError, MeshPoint};

/// A pair and everything documented about it: what a measurement is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct NominalModel {
    /// The pair.
    pub pair: GearPair,
    /// Its documented errors.
    pub errors: Errors,
}

impl NominalModel {
    /// A pair with documented errors.
    ///
    /// # Errors
    /// [`GeometryError`] when an error is not finite or a length or compliance is negative.
    pub fn new(pair: GearPair, errors: Errors) -> Result<Self, GeometryError> {
        errors.check()?;
        Ok(Self { pair, errors })
    }

    /// Predicted TE at θ1, rad: eccentricities and designed backlash along the common normal plus the wind-up under
    /// `load_nm` on the driven shaft.
    #[must_use]
    pub fn te_rad(&self, theta1_rad: f64, direction: Direction, load_nm: f64) -> f64 {
        self.te_at_rad(&self.pair.at(theta1_rad), direction, load_nm)
    }

    /// [`NominalModel::te_rad`] where the kinematics are at hand already.
    #[must_use]
    pub fn te_at_rad(&self, at: &MeshPoint, direction: Direction, load_nm: f64) -> f64 {
        common_normal::eccentricity_te_rad(&self.pair, &self.errors, at, direction)
            + common_normal::designed_backlash_te_rad(&self.pair, at, direction)
            + self.windup_rad(at, direction, load_nm)
    }

    /// Static wind-up seen at the driven encoder, rad, with T = `load_nm`, i = i21 and dir = ±1 the driving sense:
    /// −dir·T·[C_out + C_in i² + C_mesh/(r2 cos(α ∓ μ))²].
    #[must_use]
    pub fn windup_rad(&self, at: &MeshPoint, direction: Direction, load_nm: f64) -> f64 {
        let arm_mm = common_normal::driven_base_arm_mm(&self.pair, at, direction);
        let compliance_rad_per_nm = self.errors.shaft_compliance_output_rad_per_nm
            + self.errors.shaft_compliance_input_rad_per_nm * at.ratio * at.ratio
            + self.errors.mesh_compliance_mm2_rad_per_nm / (arm_mm * arm_mm);
        -direction.sign() * load_nm * compliance_rad_per_nm
    }

    /// Predicted backlash at θ1 under load, rad at the driven shaft: TE_cw − TE_ccw.
    #[must_use]
    pub fn backlash_rad(&self, theta1_rad: f64, load_nm: f64) -> f64 {
        let at = self.pair.at(theta1_rad);
        self.te_at_rad(&at, Direction::Cw, load_nm) - self.te_at_rad(&at, Direction::Ccw, load_nm)
    }
}
