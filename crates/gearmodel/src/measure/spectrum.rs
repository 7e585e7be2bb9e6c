//! Order spectrum of a curve over the driver's angle, the driven angle or the mesh.
//!
//! A curve repeats with each turn of the driver. Every axis is therefore mapped to a phase ξ(θ1) that grows by 2π a turn:
//!
//! | axis | ξ | dξ/dθ1 | order of line n |
//! |---|---|---|---|
//! | driver | θ1 | 1 | n a turn of the driver |
//! | driven | f(θ1)/c, c = closure | i21/c | n/c a turn of the driven gear |
//! | mesh | 2π s(θ1)/s(2π) | 2π (r1/cos μ)/s(2π) | n/Z1 a tooth |
//!
//! Normalisation: curve = mean + Σ A_n cos(n ξ − φ_n), A_n the peak amplitude (not RMS, not squared), and mean and RMS are
//! averages over ξ, not over θ1. So mean² + Σ A_n²/2 = RMS² where all lines are taken (Parseval).

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::grid::{AngleGrid, Curve};
use crate::GearPair;

/// The variable over which orders are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OrderAxis {
    /// θ1: order 1 is once a turn of the driver.
    Driver,
    /// θ2 = f(θ1): order 1 is once a turn of the driven gear.
    Driven,
    /// Tooth phase s/(π m): order 1 is once a tooth.
    Mesh,
}

/// Why a curve has no spectrum or no split.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpectrumError {
    /// The curve belongs to another grid.
    #[error(
        "a curve of {values} values does not lie on a grid of {bins} bins a turn: pass the grid it was analysed on"
    )]
    Length {
        /// Values of the curve.
        values: usize,
        /// Bins of the grid.
        bins: usize,
    },
    /// Bins without a finite value.
    #[error(
        "{unseen} of {bins} bins hold no finite value, the first at theta1 = {theta1_rad:.4} rad: a spectrum needs a \
         whole turn, so record more revolutions or take a coarser grid"
    )]
    Gaps {
        /// Bins without a finite value.
        unseen: usize,
        /// Bins of the grid.
        bins: usize,
        /// Centre of the first of them, rad.
        theta1_rad: f64,
    },
    /// Mesh orders of a pair without teeth.
    #[error("a pair of kind {kind} has no teeth and so no mesh orders: take the driver's or the driven axis")]
    NoTeeth {
        /// Kind of the pair.
        kind: &'static str,
    },
    /// A line that the grid cannot resolve.
    #[error(
        "line {asked} a turn of the driver is above {limit}, the highest that {bins} bins resolve everywhere on this \
         axis: ask for fewer lines or take a finer grid"
    )]
    HighestLine {
        /// Line asked for, periods a turn of the driver.
        asked: u32,
        /// Highest that is resolved.
        limit: u32,
        /// Bins of the grid.
        bins: usize,
    },
    /// A cut-off outside what the grid can filter.
    #[error(
        "a cut-off order of {order} is outside 0 (excluded) to {limit} on this axis with {bins} bins: choose it inside, \
         or take a finer grid"
    )]
    CutOff {
        /// Cut-off asked for, order of the axis.
        order: f64,
        /// Highest accepted, order of the axis.
        limit: f64,
        /// Bins of the grid.
        bins: usize,
    },
}

/// One line: amplitude·cos(n·ξ − phase).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpectrumLine {
    /// n, periods a turn of the driver.
    pub per_driver_turn: u32,
    /// Order on the axis: periods a turn of the driver, a turn of the driven gear, or a tooth.
    pub order: f64,
    /// Peak amplitude, rad, ≥ 0.
    pub amplitude_rad: f64,
    /// Phase, rad, in [−π, π].
    pub phase_rad: f64,
}

/// Order spectrum of a curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrderSpectrum {
    /// The axis of the orders.
    pub axis: OrderAxis,
    /// Mean over the axis, rad.
    pub mean_rad: f64,
    /// √(mean of squares over the axis), rad, the mean included.
    pub rms_rad: f64,
    /// Lines 1 to the highest asked for.
    pub lines: Vec<SpectrumLine>,
}

/// ξ and quadrature weights of an axis at the bin centres.
pub(super) struct AxisPoints {
    /// ξ, rad, 0 to 2π.
    pub xi_rad: Vec<f64>,
    /// Share of the turn of ξ that a bin stands for; their sum is 1.
    pub weights: Vec<f64>,
    /// Order on the axis of line 1.
    pub order_of_line: f64,
    /// Highest line resolved everywhere on the axis.
    pub highest_line: u32,
}

impl AxisPoints {
    pub(super) fn of(grid: AngleGrid, pair: &GearPair, axis: OrderAxis) -> Result<Self, SpectrumError> {
        let closure = pair.closure();
        if axis == OrderAxis::Mesh && !pair.has_teeth() {
            return Err(SpectrumError::NoTeeth { kind: pair.kind() });
        }
        // ξ and dξ/dθ1 in closed form at the samples: nothing is interpolated.
        let (xi_rad, slopes): (Vec<f64>, Vec<f64>) = match axis {
            OrderAxis::Driver => grid.centres().map(|theta1_rad| (theta1_rad, 1.0)).unzip(),
            OrderAxis::Driven => grid
                .centres()
                .map(|theta1_rad| (pair.theta2(theta1_rad) / closure, pair.ratio(theta1_rad) / closure))
                .unzip(),
            OrderAxis::Mesh => {
                let xi_of_mm = TAU / pair.perimeter_mm();
                // ds/dθ1 = √(r1² + r1'²) = r1/cos μ
                grid.centres()
                    .map(|theta1_rad| {
                        let at = pair.at(theta1_rad);
                        (xi_of_mm * pair.arc_length_mm(theta1_rad), xi_of_mm * at.r1_mm / at.mu_rad.cos())
                    })
                    .unzip()
            }
        };
        let order_of_line = match axis {
            OrderAxis::Driver => 1.0,
            OrderAxis::Driven => 1.0 / closure,
            OrderAxis::Mesh => 1.0 / f64::from(pair.teeth().0),
        };
        let total: f64 = slopes.iter().sum();
        let steepest = slopes.iter().copied().fold(1.0, f64::max);
        // Line n runs at n·dξ/dθ1 locally; where that stays under half a period a bin, products of two lines do not alias.
        let highest_line = ((0.5 * grid.bins() as f64 / steepest).ceil() - 1.0).max(0.0) as u32;
        // (1/2π) ∮ … dξ as a midpoint sum, spectrally accurate on a closed turn; divided by its own sum, so that a
        // constant is a constant on any grid.
        let weights = slopes.iter().map(|slope| slope / total).collect();
        Ok(Self { xi_rad, weights, order_of_line, highest_line })
    }

    /// Mean over the axis.
    pub(super) fn mean(&self, values: &[f64]) -> f64 {
        values.iter().zip(&self.weights).map(|(value, weight)| value * weight).sum()
    }

    /// (a, b) of line n: a = (1/π) ∮ y cos nξ dξ, b = (1/π) ∮ y sin nξ dξ.
    pub(super) fn line(&self, values: &[f64], n: u32) -> (f64, f64) {
        let (mut cosine, mut sine) = (0.0, 0.0);
        for ((value, weight), xi_rad) in values.iter().zip(&self.weights).zip(&self.xi_rad) {
            let (sin, cos) = (f64::from(n) * xi_rad).sin_cos();
            cosine += 2.0 * weight * value * cos;
            sine += 2.0 * weight * value * sin;
        }
        (cosine, sine)
    }
}

/// Passes a curve that fills the grid.
pub(super) fn check_whole(grid: AngleGrid, curve: &Curve) -> Result<(), SpectrumError> {
    let (values, bins) = (curve.values_rad.len(), grid.bins());
    if values != bins {
        return Err(SpectrumError::Length { values, bins });
    }
    match curve.values_rad.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(first) => {
            Err(SpectrumError::Gaps { unseen: bins - curve.finite().count(), bins, theta1_rad: grid.centre(first) })
        }
    }
}

impl OrderSpectrum {
    /// Highest line, periods a turn of the driver, that the grid resolves everywhere on the axis.
    ///
    /// # Errors
    /// [`SpectrumError::NoTeeth`] for mesh orders of a pair without teeth.
    pub fn highest_line(grid: AngleGrid, pair: &GearPair, axis: OrderAxis) -> Result<u32, SpectrumError> {
        Ok(AxisPoints::of(grid, pair, axis)?.highest_line)
    }

    /// Lines 1 to `highest` (periods a turn of the driver) of a curve on a grid, over an axis.
    ///
    /// # Errors
    /// [`SpectrumError`] for a curve of another grid or with gaps, a pair without teeth on the mesh axis, or a line above
    /// [`OrderSpectrum::highest_line`].
    pub fn of(
        grid: AngleGrid,
        curve: &Curve,
        pair: &GearPair,
        axis: OrderAxis,
        highest: u32,
    ) -> Result<Self, SpectrumError> {
        check_whole(grid, curve)?;
        let points = AxisPoints::of(grid, pair, axis)?;
        if highest > points.highest_line {
            return Err(SpectrumError::HighestLine { asked: highest, limit: points.highest_line, bins: grid.bins() });
        }
        let mean_rad = points.mean(&curve.values_rad);
        // The mean goes first: a far-off zero would leak its rounding into every line.
        let centred: Vec<f64> = curve.values_rad.iter().map(|value| value - mean_rad).collect();
        let squares: Vec<f64> = centred.iter().map(|value| value * value).collect();
        let lines = (1..=highest)
            .map(|n| {
                let (cosine, sine) = points.line(&centred, n);
                SpectrumLine {
                    per_driver_turn: n,
                    order: f64::from(n) * points.order_of_line,
                    amplitude_rad: cosine.hypot(sine),
                    phase_rad: sine.atan2(cosine),
                }
            })
            .collect();
        Ok(Self { axis, mean_rad, rms_rad: mean_rad.hypot(points.mean(&squares).sqrt()), lines })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EllipticalSpec;

    fn pair() -> GearPair {
        GearPair::elliptical(&EllipticalSpec::default()).unwrap()
    }

    /// The one line above 1e-9 of the largest.
    fn only_line(spectrum: &OrderSpectrum) -> SpectrumLine {
        let largest =
            spectrum.lines.iter().copied().max_by(|a, b| a.amplitude_rad.total_cmp(&b.amplitude_rad)).unwrap();
        let loud = spectrum.lines.iter().filter(|line| line.amplitude_rad > 1e-9 * largest.amplitude_rad).count();
        assert_eq!(loud, 1, "{:?}", spectrum.axis);
        largest
    }

    #[test]
    fn a_cosine_of_an_axis_is_one_line_there_and_many_elsewhere() {
        let (grid, pair) = (AngleGrid::default(), pair());
        let teeth = pair.teeth().0;
        for (axis, n, order) in
            [(OrderAxis::Driver, 3, 3.0), (OrderAxis::Driven, 2, 2.0), (OrderAxis::Mesh, teeth, 1.0)]
        {
            let curve = Curve::from_fn(grid, |theta1| {
                let phase = match axis {
                    OrderAxis::Driver => theta1,
                    OrderAxis::Driven => pair.theta2(theta1),
                    OrderAxis::Mesh => TAU * pair.tooth_phase(theta1).unwrap(),
                };
                0.7 + 2e-4 * (order * phase - 0.6).cos()
            });
            let spectrum = OrderSpectrum::of(grid, &curve, &pair, axis, 80).unwrap();
            let line = only_line(&spectrum);
            assert_eq!(line.per_driver_turn, n);
            assert!((line.order - order).abs() < 1e-12);
            assert!((line.amplitude_rad - 2e-4).abs() < 1e-14 && (line.phase_rad - 0.6).abs() < 1e-9, "{line:?}");
            assert!((spectrum.mean_rad - 0.7).abs() < 1e-12);
            for other in [OrderAxis::Driver, OrderAxis::Driven, OrderAxis::Mesh] {
                let seen = OrderSpectrum::of(grid, &curve, &pair, other, 80).unwrap();
                let loud = seen.lines.iter().filter(|line| line.amplitude_rad > 1e-6).count();
                assert_eq!(loud == 1, other == axis, "{axis:?} over {other:?}");
                // Parseval over each axis
                let power: f64 = seen.lines.iter().map(|line| 0.5 * line.amplitude_rad.powi(2)).sum();
                let fluctuation = seen.rms_rad.powi(2) - seen.mean_rad.powi(2);
                assert!(other != axis || (power - fluctuation).abs() < 1e-6 * power);
            }
        }
    }

    #[test]
    fn the_moebius_identity_of_elliptic_pairs_has_two_figures() {
        // i21 cos θ1 = (cos θ2 + K)/√(1−K²), K = 2k/(1+k²), up to the sense in which the ellipse is mounted.
        let (grid, pair) = (AngleGrid::default(), pair());
        let curve = Curve::from_fn(grid, |theta1| pair.ratio(theta1) * theta1.cos());
        let spectrum = OrderSpectrum::of(grid, &curve, &pair, OrderAxis::Driven, 40).unwrap();
        let line = only_line(&spectrum);
        assert_eq!(line.per_driver_turn, 1);
        let big_k = (1.0 - line.amplitude_rad.powi(-2)).sqrt();
        assert!((spectrum.mean_rad.abs() - big_k * line.amplitude_rad).abs() < 1e-9);
    }

    #[test]
    fn a_constant_ratio_makes_the_axes_one_up_to_the_count_of_turns() {
        let (grid, pair) = (AngleGrid::default(), GearPair::constant(2.0).unwrap());
        let curve = Curve::from_fn(grid, |theta1| 1e-3 * (4.0 * theta1 - 0.2).cos());
        let driven = only_line(&OrderSpectrum::of(grid, &curve, &pair, OrderAxis::Driven, 20).unwrap());
        assert_eq!((driven.per_driver_turn, driven.order), (4, 8.0));
        assert!((driven.phase_rad - 0.2).abs() < 1e-9);
        assert!(matches!(
            OrderSpectrum::of(grid, &curve, &pair, OrderAxis::Mesh, 20),
            Err(SpectrumError::NoTeeth { .. })
        ));
    }

    #[test]
    fn what_cannot_be_resolved_is_refused() {
        let (grid, pair) = (AngleGrid::default(), pair());
        let mut curve = Curve::from_fn(grid, f64::cos);
        let of = |curve: &Curve, highest| OrderSpectrum::of(grid, curve, &pair, OrderAxis::Driver, highest);
        assert_eq!(OrderSpectrum::highest_line(grid, &pair, OrderAxis::Driver), Ok(359));
        assert!(OrderSpectrum::highest_line(grid, &pair, OrderAxis::Driven).unwrap() < 200);
        assert!(matches!(of(&curve, 360), Err(SpectrumError::HighestLine { limit: 359, .. })));
        curve.values_rad[7] = f64::NAN;
        assert!(matches!(of(&curve, 4), Err(SpectrumError::Gaps { unseen: 1, .. })));
        curve.values_rad.pop();
        assert!(matches!(of(&curve, 4), Err(SpectrumError::Length { values: 719, bins: 720 })));
    }
}
