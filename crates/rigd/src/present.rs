//! Numbers as people read them: arcsec and µrad side by side.

/// An angle error in arcsec and µrad.
#[must_use]
pub fn angle(value_rad: f64) -> String {
    format!("{:.1}\" ({:.1} µrad)", arcsec(value_rad), value_rad * 1e6)
}

/// Radian to arcsec.
#[must_use]
pub fn arcsec(value_rad: f64) -> f64 {
    value_rad.to_degrees() * 3600.0
}
