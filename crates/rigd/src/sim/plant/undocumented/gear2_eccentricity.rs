//! Gear 2 sits on its shaft with another eccentricity than documented.

use super::super::PlantSpec;

/// Adds (−5, +10) µm to the documented vector of gear 2.
pub fn apply(spec: &mut PlantSpec) {
    spec.gears.displace_gear2(-5e-3, 10e-3);
}
