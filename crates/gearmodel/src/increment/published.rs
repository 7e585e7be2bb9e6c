//! The equations of the source document as printed, in rad instead of degrees.
//!
//! Kept to the letter for comparison. What is wrong in them: α has the same sign for driver and driven and in both
//! senses, the divisor is the driver's r1 cos α instead of the driven gear's base arm, the inclination of the tangent is
//! missing, and the start term of the cw sense has the sign opposite to the document's own ΔL10, ΔL20. The start terms
//! are part of the printed form and are always subtracted.

use crate::{Direction, Errors, GearPair};

/// Printed TE, rad.
///
/// ccw (Δφ_n): [e1 (sin(θ1+φ1−α) − sin(φ1−α)) + e2 (sin(θ2+φ2−α) − sin(φ2−α))]/(r1 cos α),
/// cw (Δφ_s): [−e1 (sin(θ1+φ1−α) + sin(φ1−α)) − e2 (sin(θ2+φ2−α) + sin(φ2−α))]/(r1 cos α).
#[must_use]
pub fn te_rad(pair: &GearPair, errors: &Errors, theta1_rad: f64, direction: Direction) -> f64 {
    let at = pair.at(theta1_rad);
    let alpha = pair.pressure_angle_rad();
    let base_radius_mm = at.r1_mm * alpha.cos();
    let sign = direction.sign();
    let line = |e_mm: f64, theta_rad: f64, phi_rad: f64| {
        e_mm * (sign * (theta_rad + phi_rad - alpha).sin() - (phi_rad - alpha).sin())
    };
    (line(errors.e1_mm, theta1_rad, errors.phi1_rad) + line(errors.e2_mm, at.theta2_rad, errors.phi2_rad))
        / base_radius_mm
}

/// Printed periodic backlash, rad: b_v ≈ 2 tan α/(r1 cos α) · [e2 cos(θ2+φ2) − e1 cos(θ1+φ1)].
#[must_use]
pub fn backlash_rad(pair: &GearPair, errors: &Errors, theta1_rad: f64) -> f64 {
    let at = pair.at(theta1_rad);
    let alpha = pair.pressure_angle_rad();
    2.0 * alpha.tan() / (at.r1_mm * alpha.cos())
        * (errors.e2_mm * (at.theta2_rad + errors.phi2_rad).cos() - errors.e1_mm * (theta1_rad + errors.phi1_rad).cos())
}
