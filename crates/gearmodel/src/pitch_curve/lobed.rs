//! Ellipses of higher order: n1 lobes driving n2.
//!
//! r1 = p/(1 − k cos n1 θ1). The mate's centre distance follows from closure: with C = n1/n2 the integral
//! (1/2π) ∮ r1/(a − r1) dθ1 = p/√((a − p)² − a²k²) = C gives a quadratic in a/p,
//!
//! a/p = [1 + √(1 − (1 − k²)(1 − 1/C²))]/(1 − k²),
//!
//! and the transmission is again a Moebius map, θ2 = (1/n2)·M(n1 θ1). n1 = n2 = 1 is the ellipse about a focus.

use std::f64::consts::TAU;

use super::ellipse::{ByEccentricity, moebius};
use super::panels::PanelSeries;
use super::{Motion, PitchCurve};

/// An ellipse of order n1 driving its mate of order n2.
#[derive(Clone, Debug, PartialEq)]
pub struct Lobed {
    n1: f64,
    n2: f64,
    /// Parameter of the Moebius map: i21 = C (1 − q²)/(1 − 2q cos n1θ1 + q²).
    q: f64,
    k: f64,
    /// p in centre distances.
    p: f64,
    speed: PanelSeries,
    /// dq/dk.
    q_slope: f64,
    /// ∂ ln a/∂k at fixed perimeter.
    relative_distance: f64,
}

impl Lobed {
    /// Eccentricity k in 0..=0.99 and lobes ≥ 1 (checked by the caller).
    pub(crate) fn new(k: f64, (lobes1, lobes2): (u32, u32)) -> Self {
        let (n1, n2) = (f64::from(lobes1), f64::from(lobes2));
        let inverse_closure = n2 / n1;
        let one_less = 1.0 - k * k;
        let beyond_one = 1.0 - inverse_closure * inverse_closure;
        let root = (1.0 - one_less * beyond_one).sqrt();
        let distance = (1.0 + root) / one_less;
        // i = p/((a − p) − a k cos φ) ∝ 1/(1 − b cos φ), b = a k/(a − p); 1 − 2q cos φ + q² ∝ 1 − b cos φ for
        // b = 2q/(1 + q²)
        let b = distance * k / (distance - 1.0);
        let q = b / (1.0 + (1.0 - b * b).sqrt());
        let p = 1.0 / distance;
        let speed = PanelSeries::fit(&[], |theta| {
            let (sin, cos) = (n1 * theta).sin_cos();
            let rest = 1.0 - k * cos;
            let tan_mu = -n1 * k * sin / rest;
            p / rest * (1.0 + tan_mu * tan_mu).sqrt()
        });
        // By k: root' = k (1 − 1/C²)/root; b' of b = D k/(D − 1); dq/db of b = 2q/(1 + q²). Only a circle driving a circle
        // without end has root = 0.
        let distance_slope = (k * beyond_one / root * one_less + 2.0 * k * (1.0 + root)) / (one_less * one_less);
        let b_slope = (distance_slope * k + distance) / (distance - 1.0)
            - distance * k * distance_slope / (distance - 1.0).powi(2);
        let q_slope = b_slope * (1.0 + q * q).powi(2) / (2.0 * (1.0 - q * q));
        // perimeter = a p ∮ w/(1 − kc)² dθ, w = √((1 − kc)² + n²k²s²), c = cos n1θ, s = sin n1θ, is π m Z1
        let integrand = |phase: f64| {
            let (sin, cos) = phase.sin_cos();
            let rest = 1.0 - k * cos;
            let w = rest.hypot(n1 * k * sin);
            ((n1 * n1 * k * sin * sin - cos * rest) / w + 2.0 * cos * w / rest) / (rest * rest)
        };
        // Periodic: the trapezoidal rule's error falls as exp(−N y), y the distance of the nearest singularity from the real
        // axis: w = 0 at about (1 − k)/(n1 k). exp(−24) = 4e-11.
        let nodes = 64 + (24.0 * n1 * k / (1.0 - k)).ceil() as u32;
        let perimeter_slope =
            (0..nodes).map(|n| integrand(TAU * f64::from(n) / f64::from(nodes))).sum::<f64>() * TAU / f64::from(nodes);
        let relative_distance = distance_slope / distance - p * perimeter_slope / speed.total();
        Self { n1, n2, q, k, p, speed, q_slope, relative_distance }
    }

    /// Derivatives by k.
    pub(crate) fn by_eccentricity(&self, theta1_rad: f64) -> ByEccentricity {
        let (k, q, closure) = (self.k, self.q, self.n1 / self.n2);
        let (sin, cos) = (self.n1 * theta1_rad).sin_cos();
        let denominator = 1.0 - 2.0 * q * cos + q * q;
        let rest = 1.0 - k * cos;
        // tan μ = −n1 k sin φ/(1 − k cos φ)
        let tan_mu = -self.n1 * k * sin / rest;
        ByEccentricity {
            theta2: 2.0 * sin / denominator * self.q_slope / self.n2,
            mu: -self.n1 * sin / (rest * rest) / (1.0 + tan_mu * tan_mu),
            ratio: closure * (2.0 * (1.0 - q * q) * (cos - q) - 2.0 * q * denominator) / (denominator * denominator)
                * self.q_slope,
            relative_distance: self.relative_distance,
        }
    }

    /// ∂θ2/∂k at a fixed θ1, where the driven gear stands at θ2, the centre distance following k by closure.
    ///
    /// With i = C √(1 − b²)/(1 − b cos n1θ1): tan(n2θ2/2) = √((1 + b)/(1 − b)) tan(n1θ1/2) and b = k (1 + C s), s = √(1 − b²), so
    /// ∂θ2/∂k = sin n2θ2/(n2 s²) · (1 + C s)/(1 + k C b/s). For one lobe each it is the ellipse's 2 sin θ2/(1 − k²).
    #[must_use]
    pub fn theta2_slope_over_k(&self, theta2_rad: f64) -> f64 {
        let b = 2.0 * self.q / (1.0 + self.q * self.q);
        let (closure, s) = (self.n1 / self.n2, (1.0 - b * b).sqrt());
        let b_slope = (1.0 + closure * s) / (1.0 + self.k * closure * b / s);
        (self.n2 * theta2_rad).sin() / (self.n2 * s * s) * b_slope
    }
}

impl PitchCurve for Lobed {
    fn kind(&self) -> &'static str {
        "lobed"
    }

    fn closure(&self) -> f64 {
        self.n1 / self.n2
    }

    #[inline]
    fn theta2(&self, theta1_rad: f64) -> f64 {
        moebius(self.q, self.n1 * theta1_rad) / self.n2
    }

    fn theta2_inverse(&self, theta2_rad: f64) -> f64 {
        moebius(-self.q, self.n2 * theta2_rad) / self.n1
    }

    #[inline]
    fn motion(&self, theta1_rad: f64) -> Motion {
        let q = self.q;
        let phase_rad = self.n1 * theta1_rad;
        let (sin, cos) = phase_rad.sin_cos();
        let denominator = 1.0 - 2.0 * q * cos + q * q;
        let ratio = self.n1 / self.n2 * (1.0 - q * q) / denominator;
        Motion {
            theta2_rad: (phase_rad + 2.0 * (q * sin / (1.0 - q * cos)).atan()) / self.n2,
            ratio,
            ratio_slope: -2.0 * q * self.n1 * sin * ratio / denominator,
        }
    }

    fn ratio_curvature(&self, theta1_rad: f64) -> f64 {
        let q = self.q;
        let (sin, cos) = (self.n1 * theta1_rad).sin_cos();
        let denominator = 1.0 - 2.0 * q * cos + q * q;
        let ratio = self.n1 / self.n2 * (1.0 - q * q) / denominator;
        -2.0 * q * self.n1 * self.n1 * ratio * (cos * denominator - 4.0 * q * sin * sin) / (denominator * denominator)
    }

    fn arc(&self, theta1_rad: f64) -> f64 {
        self.speed.integral(theta1_rad)
    }

    fn radius_range(&self) -> (f64, f64) {
        (self.p / (1.0 + self.k), self.p / (1.0 - self.k))
    }

    fn max_inclination(&self) -> (f64, f64) {
        // tan μ = −n k sin φ/(1 − k cos φ) is largest at cos φ = k, where it is n k/√(1 − k²)
        ((self.n1 * self.k / (1.0 - self.k * self.k).sqrt()).atan(), self.k.acos() / self.n1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pitch_curve::Ellipse;

    #[test]
    fn one_lobe_each_is_the_ellipse() {
        for k in [0.0, 0.3287, 0.8] {
            let (lobed, ellipse) = (Lobed::new(k, (1, 1)), Ellipse::new(k));
            for step in -20..20 {
                let theta = 0.4 * f64::from(step);
                assert!((lobed.theta2(theta) - ellipse.theta2(theta)).abs() < 1e-13);
                assert!((lobed.arc(theta) - ellipse.arc(theta)).abs() < 1e-13);
                assert!((lobed.motion(theta).ratio / ellipse.motion(theta).ratio - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn derivatives_of_one_lobe_are_the_ellipse_s_and_others_are_differences() {
        for k in [0.05, 0.3287, 0.8, 0.97] {
            for step in 0..20 {
                let theta = 0.31 * f64::from(step);
                let (a, b) = (Lobed::new(k, (1, 1)).by_eccentricity(theta), Ellipse::new(k).by_eccentricity(theta));
                for (a, b) in [(a.theta2, b.theta2), (a.mu, b.mu), (a.ratio, b.ratio)] {
                    assert!((a - b).abs() < 1e-11 * (1.0 + b.abs()), "{k} {theta}: {a} {b}");
                }
                assert!((a.relative_distance / b.relative_distance - 1.0).abs() < 1e-9, "{k}");
            }
        }
        for (k, lobes) in [(0.1, (2, 3)), (0.3, (3, 2)), (0.05, (5, 5))] {
            let h = 1e-4;
            let (below, here, above) = (Lobed::new(k - h, lobes), Lobed::new(k, lobes), Lobed::new(k + h, lobes));
            let slope = -(above.speed.total() / below.speed.total()).ln() / (2.0 * h);
            assert!((slope - here.relative_distance).abs() < 1e-6, "{lobes:?}: {slope} {}", here.relative_distance);
        }
    }

    #[test]
    fn radius_and_ratio_agree_for_every_order() {
        for (lobes, k) in [((2, 3), 0.3), ((3, 1), 0.1), ((1, 2), 0.5), ((5, 4), 0.03)] {
            let curve = Lobed::new(k, lobes);
            for step in 0..50 {
                let theta = 0.13 * f64::from(step);
                let i = curve.motion(theta).ratio;
                let r = curve.p / (1.0 - k * (f64::from(lobes.0) * theta).cos());
                assert!((i / (1.0 + i) - r).abs() < 1e-13, "{lobes:?}");
                assert!((curve.theta2_inverse(curve.theta2(theta)) - theta).abs() < 1e-12);
            }
            let turn = curve.theta2(TAU) - curve.theta2(0.0);
            assert!((turn - TAU * f64::from(lobes.0) / f64::from(lobes.1)).abs() < 1e-12);
        }
    }
}
