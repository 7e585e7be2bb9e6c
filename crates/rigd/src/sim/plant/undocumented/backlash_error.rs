//! The teeth were ground thinner than the drawing says: both flanks recede, whatever the load.

use super::super::PlantSpec;

/// Thins the teeth by another 20 µm along the pitch curve.
pub fn apply(spec: &mut PlantSpec) {
    spec.gears.backlash_mm += 0.02;
}
