//! The coupling between gear 2 and the output encoder runs at an angle and turns unevenly, as Cardan's joint does:
//! tan q_out = tan q_in/cos β.

use super::super::PlantSpec;

/// Bends the joint by 0.8°: ± 49 µrad, twice a turn.
pub fn apply(spec: &mut PlantSpec) {
    spec.shafts.output_cardan_angle_rad = 0.014;
    spec.shafts.output_cardan_phase_rad = 0.5;
}
