//! The output encoder's disc is not centred on the shaft.

use super::super::PlantSpec;

/// Displaces the disc by 4e-5 of its track radius (1.6 µm at 40 mm).
pub fn apply(spec: &mut PlantSpec) {
    spec.encoders.output.eccentricity = 4e-5;
    spec.encoders.output.eccentricity_phase_rad = 1.2;
}
