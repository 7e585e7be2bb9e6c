//! The housing was bored, or the slide set, with a larger centre distance than the pair closes at.

use super::super::PlantSpec;

/// Moves the gears 30 µm apart.
pub fn apply(spec: &mut PlantSpec) {
    spec.gears.centre_distance_error_mm += 0.03;
}
