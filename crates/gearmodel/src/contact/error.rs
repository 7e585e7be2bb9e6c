//! Why two gears do not touch.

use crate::Direction;

/// Why a pair has no exact contact at an angle.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// A drive of constant ratio has no teeth to touch.
    #[error("a constant-ratio drive has no known teeth: use method common_normal")]
    NoTeeth,
    /// The contact equations have no solution near the nominal position.
    #[error(
        "no tooth contact near theta1 = {theta1_rad} rad ({direction}): the residual stays at {residual_mm:e} mm; the \
         displacements are too large for these teeth"
    )]
    NotConverged {
        /// Driver angle, rad.
        theta1_rad: f64,
        /// Sense.
        direction: Direction,
        /// Residual after the last step, mm.
        residual_mm: f64,
    },
    /// Between two tooth pairs nothing touches.
    #[error(
        "no tooth pair is within its tips at theta1 = {theta1_rad} rad ({direction}): the contact ratio falls below 1 \
         there; give the teeth a larger addendum or a smaller pressure angle"
    )]
    NoPairInZone {
        /// Driver angle, rad.
        theta1_rad: f64,
        /// Sense.
        direction: Direction,
    },
    /// A load that is no load.
    #[error(
        "load {load_nm} N.m on the driven shaft is outside 0 to {limit_nm:e} N.m: the sense is the direction's, the load is positive"
    )]
    Load {
        /// Load given, N·m.
        load_nm: f64,
        /// Largest load accepted, N·m.
        limit_nm: f64,
    },
    /// The angle is not a finite number.
    #[error("theta1 is {theta1_rad}: a finite angle in rad is needed")]
    NotFinite {
        /// The angle given.
        theta1_rad: f64,
    },
}
