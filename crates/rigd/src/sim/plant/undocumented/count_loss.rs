//! The output's counter misses edges now and then, always to the same side.

use super::super::PlantSpec;

/// Loses 24 counts (21 µrad) at random, 0.7 times a driver revolution.
pub fn apply(spec: &mut PlantSpec) {
    spec.encoders.output_count_loss.counts = 24;
    spec.encoders.output_count_loss.losses_per_rev = 0.7;
}
