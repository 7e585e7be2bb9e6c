//! The shaft between input encoder and gear 1 is softer than documented: a key that gives, a longer shaft.

use super::super::PlantSpec;

/// Adds 4e-6 rad/(N·m).
pub fn apply(spec: &mut PlantSpec) {
    spec.shafts.compliance_input_rad_per_nm += 4e-6;
}
