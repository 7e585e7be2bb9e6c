//! The input encoder's disc was clamped out of round.

use super::super::PlantSpec;

/// Squeezes the disc: (b − a)/(b + a) of its half axes becomes 3e-5.
pub fn apply(spec: &mut PlantSpec) {
    spec.encoders.input.ellipticity = 3e-5;
    spec.encoders.input.ellipticity_phase_rad = 0.8;
}
