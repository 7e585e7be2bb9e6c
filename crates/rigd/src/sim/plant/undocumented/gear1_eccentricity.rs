//! Gear 1 sits on its shaft with another eccentricity than documented: the mounting was disturbed.

use super::super::PlantSpec;

/// Adds (+9, −6) µm to the documented vector of gear 1.
pub fn apply(spec: &mut PlantSpec) {
    spec.gears.displace_gear1(9e-3, -6e-3);
}
