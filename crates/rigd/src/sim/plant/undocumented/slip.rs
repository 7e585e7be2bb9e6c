//! The clamp between gear 2 and the output encoder creeps under load: it holds up to a torque, and above it gives way
//! in small events, a little every revolution, so the lag accumulates.

use super::super::PlantSpec;

/// Creeps 4 µrad per driver revolution and N·m above 4 N·m, in slips of about 2 µrad.
pub fn apply(spec: &mut PlantSpec) {
    spec.clamp.creep_rad_per_rev_nm = 4e-6;
    spec.clamp.threshold_nm = 4.0;
    spec.clamp.event_rad = 2e-6;
}
