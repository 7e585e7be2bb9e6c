//! A pitch curve given by its ratio or its radius as a function of θ1, integrated to rounding.

use std::f64::consts::TAU;

use super::panels::PanelSeries;
use super::{Motion, PitchCurve, Roll};

/// A free pitch curve and its mate.
#[derive(Clone, Debug, PartialEq)]
pub struct Numeric {
    kind: &'static str,
    /// i21(θ1) with its integral f.
    ratio: PanelSeries,
    /// ds/dθ1 at unit centre distance, with its integral s.
    speed: PanelSeries,
    closure: f64,
    radius_range: (f64, f64),
    max_inclination: (f64, f64),
}

impl Numeric {
    /// The curve of ratio `i21` and slope, both given by `ratio_and_slope` (positive, period 2π), which turns the driven
    /// gear `closure` times a turn.
    pub(crate) fn from_ratio(
        kind: &'static str,
        knots_rad: &[f64],
        closure: f64,
        ratio_and_slope: impl Fn(f64) -> (f64, f64),
    ) -> Self {
        let ratio = PanelSeries::fit(knots_rad, |theta| ratio_and_slope(theta).0);
        // What quadrature left of the closure is taken out, so that a whole turn is a whole turn.
        let factor = TAU * closure / ratio.total();
        let ratio = ratio.scaled(factor);
        let speed = PanelSeries::fit(knots_rad, |theta| {
            let (i, slope) = ratio_and_slope(theta);
            let (i, slope) = (i * factor, slope * factor);
            let tan_mu = slope / (i * (1.0 + i));
            i / (1.0 + i) * (1.0 + tan_mu * tan_mu).sqrt()
        });
        let radius = |theta: f64| {
            let i = ratio.value(theta);
            i / (1.0 + i)
        };
        let inclination = |theta: f64| {
            let (i, slope) = ratio.value_and_slope(theta);
            (slope / (i * (1.0 + i))).atan().abs()
        };
        let (_, smallest) = highest(|theta| -radius(theta));
        let (_, largest) = highest(radius);
        let (at, mu) = highest(inclination);
        Self { kind, radius_range: (-smallest, largest), max_inclination: (mu, at), ratio, speed, closure }
    }

    /// The curve of radius r1(θ1), in any unit, at the centre distance `distance` in that unit.
    pub(crate) fn from_radius(
        kind: &'static str,
        knots_rad: &[f64],
        closure: f64,
        distance: f64,
        radius_and_slope: impl Fn(f64) -> (f64, f64),
    ) -> Self {
        Self::from_ratio(kind, knots_rad, closure, |theta| {
            let (radius, slope) = radius_and_slope(theta);
            let rest = distance - radius;
            // i = r/(a − r)
            (radius / rest, distance * slope / (rest * rest))
        })
    }
}

/// Cells of the scan for an extremum over a turn.
pub(crate) const CELLS: u32 = 2048;

/// Where a function of period 2π is highest, and how high: a fine scan, then golden section in the best cell.
pub(crate) fn highest(function: impl Fn(f64) -> f64) -> (f64, f64) {
    let scanned = (0..CELLS).map(|n| TAU / f64::from(CELLS) * f64::from(n)).map(|theta| (theta, function(theta)));
    let (best, value) = scanned.fold((0.0, f64::NEG_INFINITY), |best, cell| if cell.1 > best.1 { cell } else { best });
    refine(best, value, function)
}

/// Golden section around the best of [`CELLS`] cells.
pub(crate) fn refine(best: f64, value: f64, function: impl Fn(f64) -> f64) -> (f64, f64) {
    let cell = TAU / f64::from(CELLS);
    let (mut best, mut value) = (best, value);
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (best - cell, best + cell);
    // 32 sections: to 1e-9 rad, as near as a flat top can be told.
    for _ in 0..32 {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        let (at_left, at_right) = (function(left), function(right));
        if at_left > at_right {
            high = right;
        } else {
            low = left;
        }
        for (theta, there) in [(left, at_left), (right, at_right)] {
            if there > value {
                (best, value) = (theta, there);
            }
        }
    }
    (best.rem_euclid(TAU), value)
}

impl PitchCurve for Numeric {
    fn kind(&self) -> &'static str {
        self.kind
    }

    fn closure(&self) -> f64 {
        self.closure
    }

    fn theta2(&self, theta1_rad: f64) -> f64 {
        self.ratio.integral(theta1_rad)
    }

    fn theta2_inverse(&self, theta2_rad: f64) -> f64 {
        self.ratio.integral_inverse(theta2_rad)
    }

    fn motion(&self, theta1_rad: f64) -> Motion {
        let (ratio, ratio_slope) = self.ratio.value_and_slope(theta1_rad);
        Motion { theta2_rad: self.ratio.integral(theta1_rad), ratio, ratio_slope }
    }

    fn ratio_curvature(&self, theta1_rad: f64) -> f64 {
        self.ratio.curvature(theta1_rad)
    }

    fn arc(&self, theta1_rad: f64) -> f64 {
        self.speed.integral(theta1_rad)
    }

    fn roll(&self, theta1_rad: f64) -> Roll {
        Roll::new(self.motion(theta1_rad), self.ratio.curvature(theta1_rad), self.speed.integral(theta1_rad))
    }

    fn radius_range(&self) -> (f64, f64) {
        self.radius_range
    }

    fn max_inclination(&self) -> (f64, f64) {
        self.max_inclination
    }
}
