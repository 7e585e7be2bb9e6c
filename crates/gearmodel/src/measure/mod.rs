//! The measurement: TE over angle from raw samples, its figures, and backlash from both senses.

mod backlash;
mod figures;
mod floor;
mod grid;
mod measured_backlash;
mod order;
mod run_te;
mod spectrum;
mod wave_split;

pub use backlash::BacklashCurve;
pub use figures::{RunFigures, common_zero};
pub use floor::{FloorError, RepeatabilityFloor};
pub use grid::{AngleGrid, Curve};
pub use measured_backlash::MeasuredBacklash;
pub use order::Order;
pub use run_te::{RunConditions, RunTe, TePoint};
pub use spectrum::{OrderAxis, OrderSpectrum, SpectrumError, SpectrumLine};
pub use wave_split::{WaveFigures, WaveFilter, WaveSplit};

/// Why measured curves cannot be combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasureError {
    /// A grid needs a usable number of bins.
    #[error(
        "an angle grid of {bins} bins is outside {lower} to {upper} bins a turn: 720 bins of 0.5 deg is the default"
    )]
    Bins {
        /// Bins asked for.
        bins: usize,
        /// Fewest accepted.
        lower: usize,
        /// Most accepted.
        upper: usize,
    },
    /// Two curves on different grids.
    #[error("curves of {ccw} (ccw) and {cw} (cw) bins a turn cannot be subtracted: analyse both on one grid")]
    GridMismatch {
        /// Bins of the ccw curve.
        ccw: usize,
        /// Bins of the cw curve.
        cw: usize,
    },
    /// Backlash needs one run of each sense.
    #[error("{place} was recorded {found}: backlash needs the ccw recording first, then the cw one")]
    Sense {
        /// The place it was given at.
        place: &'static str,
        /// Its direction.
        found: crate::Direction,
    },
    /// Runs that share no angle.
    #[error("the two recordings share no bin of theta1: record overlapping angles in both senses, or take fewer bins")]
    NoCommonAngle,
}
