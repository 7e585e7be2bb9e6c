//! The shaft between gear 2 and output encoder is softer than documented.

use super::super::PlantSpec;

/// Adds 6e-6 rad/(N·m).
pub fn apply(spec: &mut PlantSpec) {
    spec.shafts.compliance_output_rad_per_nm += 6e-6;
}
