//! Long and short waves of a curve, parted by a Gaussian filter in orders.
//!
//! Transmission of the long waves at order o with the cut-off at o_c:
//!
//! T(o) = exp(−ln 2 · (o/o_c)²),   T(o_c) = 50 %
//!
//! the transmission of the Gaussian filter for closed profiles of ISO 16610-21, exp(−π (α λ_c/λ)²) with α = √(ln 2/π),
//! written in orders. It has no phase shift. The short waves are the rest, 1 − T. No conformance is claimed.

use std::f64::consts::LN_2;

use serde::{Deserialize, Serialize};

use super::figures::tooth_to_tooth;
use super::grid::{AngleGrid, Curve};
use super::spectrum::{AxisPoints, OrderAxis, SpectrumError, check_whole};
use crate::GearPair;

/// The cut-off stays this many times below the highest line that is resolved: T is under 0.2 % there (2⁻⁹), and what lies
/// above is left whole to the short waves.
const CUT_OFF_MARGIN: f64 = 3.0;
/// Below this transmission a line adds nothing that a double can hold.
const SMALLEST_TRANSMISSION: f64 = 1e-18;

/// Parameters of the filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WaveFilter {
    /// The axis over which orders are counted.
    pub axis: OrderAxis,
    /// Order on the axis at which half the amplitude passes to the long waves.
    pub cut_off_order: f64,
}

/// Figures of one part. Definitions follow the usual single-flank values in spirit; no conformance is claimed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WaveFigures {
    /// F'is-like: peak-to-peak over the turn, rad.
    pub f_is_total_rad: f64,
    /// f'is-like: largest peak-to-peak within one pitch of arc length, rad. NaN without teeth.
    pub f_is_tooth_rad: f64,
    /// √(mean of squares over θ1) about the part's mean, rad.
    pub fluctuation_rms_rad: f64,
}

/// A curve in two parts, long + short = curve.
#[derive(Clone, Debug, PartialEq)]
pub struct WaveSplit {
    /// The filter that parted it.
    pub filter: WaveFilter,
    /// Long waves with the mean, rad.
    pub long: Curve,
    /// Short waves, rad.
    pub short: Curve,
    /// Figures of the long waves.
    pub long_figures: WaveFigures,
    /// Figures of the short waves.
    pub short_figures: WaveFigures,
}

impl WaveFilter {
    /// Share of an amplitude at an order of the axis that passes to the long waves, 0 to 1.
    #[must_use]
    pub fn transmission(&self, order: f64) -> f64 {
        // T = exp(−ln 2 (o/o_c)²), ISO 16610-21 in orders
        (-LN_2 * (order / self.cut_off_order).powi(2)).exp()
    }

    /// Parts a curve on a grid.
    ///
    /// # Errors
    /// [`SpectrumError`] for a curve of another grid or with gaps, a pair without teeth on the mesh axis, or a cut-off that
    /// is not positive or lies above a third of the highest order that the grid resolves on the axis.
    pub fn split(&self, grid: AngleGrid, curve: &Curve, pair: &GearPair) -> Result<WaveSplit, SpectrumError> {
        check_whole(grid, curve)?;
        let points = AxisPoints::of(grid, pair, self.axis)?;
        let limit = f64::from(points.highest_line) * points.order_of_line / CUT_OFF_MARGIN;
        if !(self.cut_off_order > 0.0 && self.cut_off_order <= limit) {
            return Err(SpectrumError::CutOff { order: self.cut_off_order, limit, bins: grid.bins() });
        }
        let mean_rad = points.mean(&curve.values_rad);
        let centred: Vec<f64> = curve.values_rad.iter().map(|value| value - mean_rad).collect();
        let mut long = vec![mean_rad; grid.bins()];
        for n in 1..=points.highest_line {
            let transmission = self.transmission(f64::from(n) * points.order_of_line);
            if transmission < SMALLEST_TRANSMISSION {
                break;
            }
            let (cosine, sine) = points.line(&centred, n);
            for (value, xi_rad) in long.iter_mut().zip(&points.xi_rad) {
                let (sin, cos) = (f64::from(n) * xi_rad).sin_cos();
                *value += transmission * (cosine * cos + sine * sin);
            }
        }
        // By difference, so that the parts add up to the curve whatever was filtered.
        let short = curve.values_rad.iter().zip(&long).map(|(whole, long)| whole - long).collect();
        let (long, short) = (Curve { values_rad: long }, Curve { values_rad: short });
        Ok(WaveSplit {
            filter: *self,
            long_figures: WaveFigures::of(grid, &long, pair),
            short_figures: WaveFigures::of(grid, &short, pair),
            long,
            short,
        })
    }
}

impl WaveFigures {
    /// Figures of a curve without gaps.
    fn of(grid: AngleGrid, curve: &Curve, pair: &GearPair) -> Self {
        let mean_rad = curve.mean_rad();
        let centred = Curve { values_rad: curve.values_rad.iter().map(|value| value - mean_rad).collect() };
        Self {
            f_is_total_rad: curve.pp_rad(),
            f_is_tooth_rad: tooth_to_tooth(grid, curve, pair),
            fluctuation_rms_rad: centred.rms_rad(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::EllipticalSpec;

    fn pair() -> GearPair {
        GearPair::elliptical(&EllipticalSpec::default()).unwrap()
    }

    fn worst(curve: &Curve, expected: &Curve) -> f64 {
        curve.values_rad.iter().zip(&expected.values_rad).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn half_of_a_wave_at_the_cut_off_passes_on_every_axis() {
        let (grid, pair) = (AngleGrid::default(), pair());
        for (axis, order) in [(OrderAxis::Driver, 5.0), (OrderAxis::Driven, 4.0), (OrderAxis::Mesh, 1.0)] {
            let wave = |theta1: f64| {
                let phase = match axis {
                    OrderAxis::Driver => theta1,
                    OrderAxis::Driven => pair.theta2(theta1),
                    OrderAxis::Mesh => TAU * pair.tooth_phase(theta1).unwrap(),
                };
                1e-3 * (order * phase + 0.3).sin()
            };
            let curve = Curve::from_fn(grid, wave);
            let filter = WaveFilter { axis, cut_off_order: order };
            assert!((filter.transmission(order) - 0.5).abs() < 1e-15);
            let split = filter.split(grid, &curve, &pair).unwrap();
            let half = Curve::from_fn(grid, |theta1| 0.5 * wave(theta1));
            assert!(worst(&split.long, &half) < 1e-13 && worst(&split.short, &half) < 1e-13, "{axis:?}");
        }
    }

    #[test]
    fn the_parts_add_up_and_keep_to_their_side() {
        let (grid, pair) = (AngleGrid::default(), pair());
        let slow = |theta1: f64| 0.4 + 1e-3 * (theta1 + 0.2).cos();
        let fast = |theta1: f64| 1e-4 * (TAU * pair.tooth_phase(theta1).unwrap()).sin();
        // A jagged term that no order describes.
        let jag = |theta1: f64| 1e-5 * (theta1 * 1e4).sin().signum();
        let curve = Curve::from_fn(grid, |theta1| slow(theta1) + fast(theta1) + jag(theta1));
        let filter = WaveFilter { axis: OrderAxis::Mesh, cut_off_order: 0.3 };
        let split = filter.split(grid, &curve, &pair).unwrap();
        let sum: Vec<f64> = split.long.values_rad.iter().zip(&split.short.values_rad).map(|(a, b)| a + b).collect();
        assert!(worst(&Curve { values_rad: sum }, &curve) < 1e-15);
        assert!((split.long_figures.f_is_total_rad - 2e-3).abs() < 3e-5, "{:?}", split.long_figures);
        assert!((split.short_figures.f_is_total_rad - 2e-4).abs() < 4e-5, "{:?}", split.short_figures);
        assert!((split.short_figures.f_is_tooth_rad - 2e-4).abs() < 4e-5, "{:?}", split.short_figures);
        assert!(split.long_figures.f_is_tooth_rad < 2e-4);
    }

    #[test]
    fn a_tooth_wave_swings_fully_within_a_pitch_and_a_constant_not_at_all() {
        let (grid, pair) = (AngleGrid::new(8192).unwrap(), pair());
        let wave = Curve::from_fn(grid, |theta1| 1e-4 * (TAU * pair.tooth_phase(theta1).unwrap()).cos());
        let figures = WaveFigures::of(grid, &wave, &pair);
        assert!((figures.f_is_tooth_rad - 2e-4).abs() < 1e-8);
        let flat = Curve::from_fn(grid, |_| 0.25);
        let split = WaveFilter { axis: OrderAxis::Driver, cut_off_order: 3.0 }.split(grid, &flat, &pair).unwrap();
        assert!(split.long_figures.f_is_total_rad < 1e-15 && split.short_figures.f_is_tooth_rad < 1e-15);
        let bare = WaveFigures::of(grid, &wave, &GearPair::constant(1.0).unwrap());
        assert!(bare.f_is_tooth_rad.is_nan());
    }

    #[test]
    fn cut_offs_without_meaning_are_refused() {
        let (grid, pair) = (AngleGrid::default(), pair());
        let curve = Curve::from_fn(grid, f64::cos);
        for cut_off_order in [0.0, -1.0, f64::NAN, f64::INFINITY, 200.0] {
            let split = WaveFilter { axis: OrderAxis::Driver, cut_off_order }.split(grid, &curve, &pair);
            assert!(matches!(split, Err(SpectrumError::CutOff { .. })), "{cut_off_order}");
        }
    }
}
