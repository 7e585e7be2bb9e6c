//! The nominal model: a pair with its documented errors under load.

use std::collections::BTreeMap;

use crate::effect::predict::Condition;
use crate::effect::{Documented, NominalRig, StatedEffect};
use crate::increment::common_normal;
use crate::{Direction, Errors, GearPair, GeometryError, MeshPoint};

/// A pair and everything documented about it: what a measurement is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct NominalModel {
    /// The pair.
    pub pair: GearPair,
    /// Its documented errors.
    pub errors: Errors,
    /// Documented effects beyond those.
    pub effects: Documented,
}

impl NominalModel {
    /// A pair with documented errors.
    ///
    /// # Errors
    /// [`GeometryError`] when an error is not finite or a length or compliance is negative.
    pub fn new(pair: GearPair, errors: Errors) -> Result<Self, GeometryError> {
        errors.check()?;
        Ok(Self { pair, errors, effects: Documented::default() })
    }

    /// A pair with documented errors, and effects by name and parameters; those that are changes of an error go there.
    ///
    /// # Errors
    /// [`GeometryError`] as for [`NominalModel::new`], and where an effect does not fit the pair or is not fixed by its
    /// parameters.
    pub fn with_effects(
        pair: GearPair,
        mut errors: Errors,
        effects: &BTreeMap<String, Vec<StatedEffect>>,
    ) -> Result<Self, GeometryError> {
        errors.check()?;
        let effects = Documented::from_stated(&pair, &mut errors, effects)?;
        errors.check()?;
        Ok(Self { pair, errors, effects })
    }

    /// The rig that effects are linearised about: this pair with its documented errors, and the encoders as far as they are known.
    #[must_use]
    pub fn rig(&self, lines: [Option<f64>; 2], output_counts_per_rev: Option<f64>) -> NominalRig {
        NominalRig::new(self.pair.clone(), self.errors, lines, output_counts_per_rev)
    }

    /// Predicted TE at θ1, rad: eccentricities and designed backlash along the common normal, the wind-up under
    /// `load_nm` on the driven shaft, and what documented effects add at rest and at the start.
    #[must_use]
    pub fn te_rad(&self, theta1_rad: f64, direction: Direction, load_nm: f64) -> f64 {
        self.te_under_rad(theta1_rad, &Condition::at_rest(direction, load_nm))
    }

    /// Predicted TE at θ1 where speed, time and revolutions matter too, rad.
    #[must_use]
    pub fn te_under_rad(&self, theta1_rad: f64, under: &Condition) -> f64 {
        self.te_at_rad(&self.pair.at(theta1_rad), under.direction, under.load_nm)
            + self.effects_te_rad(theta1_rad, under)
    }

    /// What the documented effects add to the errors' TE, rad.
    #[must_use]
    pub fn effects_te_rad(&self, theta1_rad: f64, under: &Condition) -> f64 {
        self.effects.rig().map_or(0.0, |rig| self.effects.te_rad(&under.operating_point(rig, theta1_rad)))
    }

    /// TE of the errors alone, without documented effects, where the kinematics are at hand already.
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
        self.backlash_under_rad(theta1_rad, &Condition::at_rest(Direction::Ccw, load_nm))
    }

    /// The same where speed, time and revolutions matter too; the sense of `under` does not.
    #[must_use]
    pub fn backlash_under_rad(&self, theta1_rad: f64, under: &Condition) -> f64 {
        let te_rad = |direction| self.te_under_rad(theta1_rad, &Condition { direction, ..*under });
        te_rad(Direction::Cw) - te_rad(Direction::Ccw)
    }
}
