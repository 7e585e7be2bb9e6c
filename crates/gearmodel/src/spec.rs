//! What a drawing says about a pair, before it is checked.

use serde::{Deserialize, Serialize};

/// A pair of identical elliptic gears, each turning about a focus.
///
/// The tooth condition (perimeter = π m Z) fixes the size of the ellipse; closure fixes the centre distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EllipticalSpec {
    /// Module m, mm.
    pub module_mm: f64,
    /// Teeth of the driver and of the driven gear; a simple elliptic pair needs equal numbers.
    pub teeth: (u32, u32),
    /// Eccentricity k of the pitch ellipse, 0 (circle) to below 1.
    pub eccentricity: f64,
    /// Pressure angle α of the rack, deg.
    pub pressure_angle_deg: f64,
    /// Centre distance of the drawing, mm; checked against closure, `None` = the one that closes.
    pub centre_distance_mm: Option<f64>,
    /// Designed backlash of both gears together along the pitch curve, mm.
    pub backlash_mm: f64,
    /// Face width, mm.
    pub face_width_mm: f64,
    /// Addendum in modules.
    pub addendum: f64,
    /// Clearance of the dedendum over the mate's addendum, in modules.
    pub dedendum_clearance: f64,
}

impl Default for EllipticalSpec {
    /// m = 3 mm, 47 teeth, k = 0.3287, α = 20°, no backlash: the pair of the source document.
    fn default() -> Self {
        Self {
            module_mm: 3.0,
            teeth: (47, 47),
            eccentricity: 0.3287,
            pressure_angle_deg: 20.0,
            centre_distance_mm: None,
            backlash_mm: 0.0,
            face_width_mm: 30.0,
            addendum: 1.0,
            dedendum_clearance: 0.25,
        }
    }
}

/// A pair of circular gears.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CircularSpec {
    /// Module m, mm.
    pub module_mm: f64,
    /// Teeth of the driver and of the driven gear.
    pub teeth: (u32, u32),
    /// Pressure angle α of the rack, deg.
    pub pressure_angle_deg: f64,
    /// Centre distance of the drawing, mm; checked against m (Z1 + Z2)/2, `None` = that one.
    pub centre_distance_mm: Option<f64>,
    /// Designed backlash of both gears together along the pitch curve, mm.
    pub backlash_mm: f64,
    /// Face width, mm.
    pub face_width_mm: f64,
    /// Addendum in modules.
    pub addendum: f64,
    /// Clearance of the dedendum over the mate's addendum, in modules.
    pub dedendum_clearance: f64,
}

impl Default for CircularSpec {
    /// m = 3 mm, 47 teeth on both gears, α = 20°, no backlash.
    fn default() -> Self {
        Self {
            module_mm: 3.0,
            teeth: (47, 47),
            pressure_angle_deg: 20.0,
            centre_distance_mm: None,
            backlash_mm: 0.0,
            face_width_mm: 30.0,
            addendum: 1.0,
            dedendum_clearance: 0.25,
        }
    }
}
