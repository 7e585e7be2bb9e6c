//! The housing warms up after the start and moves the gears apart, as 1 − exp(−t/τ).

use super::super::PlantSpec;

/// Grows the centre distance by 20 µm with a time constant of 60 s.
pub fn apply(spec: &mut PlantSpec) {
    spec.housing.growth_mm = 0.02;
    spec.housing.time_constant_s = 60.0;
}
