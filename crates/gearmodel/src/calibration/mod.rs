//! Calibration of a rig from its own runs: the brake's two branches, the errors of its encoders, and the zeros of its angles.
//!
//! Every result carries an expanded uncertainty (coverage factor 2, some 95 %), made of what the data scatter and of what was stated, not of
//! what one would like. What the data cannot tell is said, not guessed.

mod brake;
mod encoder;
mod zero;

pub use brake::{BrakeCurves, BrakePoint, Stated, Sweep, TorqueReading, brake_curves};
pub use encoder::{EncoderErrors, MountedRun, OrderError, encoder_errors};
pub use zero::{Zero, zero};

use thiserror::Error;

use crate::measure::{AngleGrid, Curve};

/// Coverage factor of every uncertainty here.
pub const COVERAGE: f64 = 2.0;

/// Why there is no calibration.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CalibrationError {
    /// Too few mountings of the encoder.
    #[error(
        "the runs have {found} mounting(s) of the {encoder} encoder; two or more are needed, best 3 equally divided (0°, 120°, 240°): turn the disc on its shaft, state it in the profile (counter.{encoder}_mounted_deg), and run the same loads and senses again"
    )]
    Mountings {
        /// Which encoder.
        encoder: &'static str,
        /// How many there are.
        found: usize,
    },
    /// No load and sense was run at two mountings.
    #[error("no sense, load and speed was run at two mountings or more; run the same plan at each mounting")]
    NoGroup,
    /// Too little of a turn.
    #[error("only {bins} angle bins have values in all runs compared, {needed} are needed; record whole revolutions")]
    Bins {
        /// Bins with values.
        bins: usize,
        /// Bins needed.
        needed: usize,
    },
    /// A sweep without its two zeros.
    #[error("a sweep has {found} readings of the torque without current; it begins and ends with one")]
    Baseline {
        /// How many.
        found: usize,
    },
    /// The branch does not rise.
    #[error(
        "the {branch} branch does not rise between {from_a} A and {to_a} A ({from_nm:.3} N·m to {to_nm:.3} N·m); take more turns a point or fewer points"
    )]
    NotRising {
        /// Which branch.
        branch: &'static str,
        /// Current of the lower point.
        from_a: f64,
        /// Current of the upper point.
        to_a: f64,
        /// Torque of the lower point.
        from_nm: f64,
        /// Torque of the upper point.
        to_nm: f64,
    },
    /// The zeros cannot be told apart.
    #[error(
        "a pair of constant ratio tells only the sum of both zeros, {sum_rad:.3e} rad at the driven gear; use another pair, or set one zero by a mark"
    )]
    ConstantRatio {
        /// The sum.
        sum_rad: f64,
    },
    /// Both senses are needed.
    #[error(
        "no load and speed was run in both senses; backlash and friction would shift the zero: run --direction both"
    )]
    OneSense,
}

/// The grid of a curve.
fn grid_of(curve: &Curve) -> Result<AngleGrid, CalibrationError> {
    let bins = curve.values_rad.len();
    AngleGrid::new(bins).map_err(|_| CalibrationError::Bins { bins, needed: 8 })
}
