//! The angle grid of θ1 and curves on it.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::MeasureError;

/// Equal bins of θ1 over a turn; bin 0 starts at θ1 = 0. The default has 720 bins of 0.5°.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct AngleGrid {
    bins: usize,
}

impl Default for AngleGrid {
    fn default() -> Self {
        Self { bins: 720 }
    }
}

impl AngleGrid {
    const MIN_BINS: usize = 8;
    const MAX_BINS: usize = 1 << 20;

    /// A grid of `bins` equal bins a turn.
    ///
    /// # Errors
    /// [`MeasureError::Bins`] outside 8 to 2²⁰ bins.
    pub fn new(bins: usize) -> Result<Self, MeasureError> {
        let (lower, upper) = (Self::MIN_BINS, Self::MAX_BINS);
        if (lower..=upper).contains(&bins) { Ok(Self { bins }) } else { Err(MeasureError::Bins { bins, lower, upper }) }
    }

    /// Bins a turn.
    #[must_use]
    pub fn bins(self) -> usize {
        self.bins
    }

    /// Width of a bin, rad.
    #[must_use]
    pub fn width_rad(self) -> f64 {
        TAU / self.bins as f64
    }

    /// Bin of an angle, 0..bins, whatever its turn.
    #[must_use]
    pub fn bin_of(self, theta1_rad: f64) -> usize {
        self.wrap(self.unwrapped_bin_of(theta1_rad))
    }

    /// Centre of a bin, rad, in [0, 2π).
    #[must_use]
    pub fn centre(self, bin: usize) -> f64 {
        (bin as f64 + 0.5) * self.width_rad()
    }

    /// Centres of all bins, rad.
    pub fn centres(self) -> impl Iterator<Item = f64> {
        (0..self.bins).map(move |bin| self.centre(bin))
    }

    /// Number of bins between θ1 = 0 and the angle, over all turns.
    #[inline]
    pub(super) fn unwrapped_bin_of(self, theta1_rad: f64) -> i64 {
        // The cast saturates: an absurd angle stays an absurd bin, never undefined.
        (theta1_rad * (self.bins as f64 / TAU)).floor() as i64
    }

    #[inline]
    pub(super) fn wrap(self, unwrapped_bin: i64) -> usize {
        // bins ≤ 2²⁰ and the remainder lies in 0..bins, so both casts are exact.
        unwrapped_bin.rem_euclid(self.bins as i64) as usize
    }
}

/// A quantity over one turn of θ1, rad, one value a bin at its centre; NaN where no sample fell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Values, rad; index = bin.
    pub values_rad: Vec<f64>,
}

impl Curve {
    /// A curve from a function of θ1 at the bin centres.
    pub fn from_fn(grid: AngleGrid, value_rad: impl Fn(f64) -> f64) -> Self {
        Self { values_rad: grid.centres().map(value_rad).collect() }
    }

    /// The values that are there, rad.
    pub fn finite(&self) -> impl Iterator<Item = f64> {
        self.values_rad.iter().copied().filter(|value| value.is_finite())
    }

    /// Share of the bins that hold a value, 0 to 1.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        if self.values_rad.is_empty() { 0.0 } else { self.finite().count() as f64 / self.values_rad.len() as f64 }
    }

    /// Mean over the bins, rad; NaN when no bin was seen.
    #[must_use]
    pub fn mean_rad(&self) -> f64 {
        mean(self.finite())
    }

    /// Largest less smallest value, rad; NaN when no bin was seen.
    #[must_use]
    pub fn pp_rad(&self) -> f64 {
        self.max_rad() - self.min_rad()
    }

    /// Smallest value, rad; NaN when no bin was seen.
    #[must_use]
    pub fn min_rad(&self) -> f64 {
        self.finite().fold(f64::NAN, f64::min)
    }

    /// Largest value, rad; NaN when no bin was seen.
    #[must_use]
    pub fn max_rad(&self) -> f64 {
        self.finite().fold(f64::NAN, f64::max)
    }

    /// √(mean of squares), rad; NaN when no bin was seen.
    #[must_use]
    pub fn rms_rad(&self) -> f64 {
        mean(self.finite().map(|value| value * value)).sqrt()
    }
}

/// Mean of what comes; NaN of nothing.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_u32);
    for value in values {
        sum += value;
        count += 1;
    }
    sum / f64::from(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_wrap_in_both_senses() {
        let grid = AngleGrid::default();
        for bin in [0, 1, 359, 719] {
            let centre = grid.centre(bin);
            for turn in [-3.0, -1.0, 0.0, 5.0] {
                assert_eq!(grid.bin_of(centre + turn * TAU), bin);
            }
        }
        assert_eq!(grid.bin_of(-1e-9), 719);
        assert!(AngleGrid::new(0).is_err());
    }

    #[test]
    fn statistics_skip_unseen_bins() {
        let curve = Curve { values_rad: vec![1.0, f64::NAN, 3.0] };
        assert_eq!((curve.mean_rad(), curve.pp_rad(), curve.rms_rad()), (2.0, 2.0, 5.0_f64.sqrt()));
        let empty = Curve { values_rad: vec![f64::NAN] };
        assert!(empty.mean_rad().is_nan() && empty.pp_rad().is_nan() && empty.rms_rad().is_nan());
    }
}
