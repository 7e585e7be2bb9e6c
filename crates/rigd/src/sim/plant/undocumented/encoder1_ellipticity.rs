//! The input encoder's disc was clamped out of round.

use super::super::PlantSpec;

/// Squeezes the disc to half axes that differ by 3e-5 of their mean, twice.
pub fn apply(spec: &mut PlantSpec) {
    spec.encoders.input.ellipticity = 3e-5;
    spec.encoders.input.ellipticity_phase_rad = 0.8;
}
