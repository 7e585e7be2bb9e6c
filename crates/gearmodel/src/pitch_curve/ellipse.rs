//! Identical ellipses, each about a focus.
//!
//! At unit centre distance (2A = 1): r1 = p/(1 − k cos θ1), p = (1 − k²)/2. The driven gear is the same ellipse, half a
//! turn on. The transmission is a Moebius map of the circle, tan(θ2/2) = ((1 + k)/(1 − k)) tan(θ1/2), which unwraps
//! to the closed form used here.

use std::f64::consts::{PI, TAU};

use super::{Motion, PitchCurve, Roll};

/// Largest eccentricity k that the model accepts; the ratio then swings 199 : 1.
pub(crate) const MAX_ECCENTRICITY: f64 = 0.99;

/// An ellipse about a focus that drives its twin.
#[derive(Clone, Debug, PartialEq)]
pub struct Ellipse {
    /// Eccentricity k of the ellipse.
    k: f64,
    /// Parameter of the half map θ1 → E (eccentric anomaly): q = k/(1 + √(1 − k²)).
    q: f64,
    /// √(1 − k²).
    k_complement: f64,
    /// Arc length over a radian of E, mean over a turn, in centre distances.
    arc_mean: f64,
    /// arc(E) = arc_mean·E + Σ arc_sines[n−1] sin 2nE, in centre distances.
    arc_sines: Vec<f64>,
}

/// Derivatives of an elliptic or lobed pair by its eccentricity at fixed θ1, module and teeth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ByEccentricity {
    /// ∂f/∂k, rad.
    pub(crate) theta2: f64,
    /// ∂μ/∂k, rad.
    pub(crate) mu: f64,
    /// ∂i21/∂k.
    pub(crate) ratio: f64,
    /// ∂ ln a/∂k: the perimeter stays π m Z.
    pub(crate) relative_distance: f64,
}

/// θ + 2 atan(c sin θ/(1 − c cos θ)): the unwrapped Moebius map tan(y/2) = ((1 + c)/(1 − c)) tan(θ/2), |c| < 1.
/// The inverse has −c. 1 − c cos θ > 0, so the arctangent never leaves its branch and the map is smooth on all reals.
#[inline]
pub(super) fn moebius(c: f64, theta_rad: f64) -> f64 {
    let (sin, cos) = theta_rad.sin_cos();
    theta_rad + 2.0 * (c * sin / (1.0 - c * cos)).atan()
}

impl Ellipse {
    /// The ellipse of eccentricity k, 0 ≤ k ≤ [`MAX_ECCENTRICITY`] (checked by the caller).
    pub(crate) fn new(k: f64) -> Self {
        let q = k / (1.0 + (1.0 - k * k).sqrt());
        let (arc_mean, arc_sines) = arc_series(k);
        Self { k, q, k_complement: (1.0 - k * k).sqrt(), arc_mean, arc_sines }
    }

    /// Eccentricity k.
    #[must_use]
    pub fn eccentricity(&self) -> f64 {
        self.k
    }

    /// Derivatives by k.
    pub(crate) fn by_eccentricity(&self, theta1_rad: f64) -> ByEccentricity {
        let k = self.k;
        let (sin, cos) = theta1_rad.sin_cos();
        let denominator = 1.0 - 2.0 * k * cos + k * k;
        // perimeter = 2π · arc_mean · a with arc_mean = ½ mean √(1 − k² cos² E); its derivative is −½ k mean cos² E/√(…)
        let nodes = 4 * (self.arc_sines.len() + 8);
        let slope: f64 = (0..nodes)
            .map(|j| {
                let cos = (PI * j as f64 / nodes as f64).cos();
                -0.5 * k * cos * cos / (1.0 - k * k * cos * cos).sqrt()
            })
            .sum::<f64>()
            / nodes as f64;
        ByEccentricity {
            theta2: 2.0 * sin / denominator,
            // f = θ1 − 2μ
            mu: -sin / denominator,
            ratio: (-2.0 * k * denominator + 2.0 * (1.0 - k * k) * (cos - k)) / (denominator * denominator),
            relative_distance: -slope / self.arc_mean,
        }
    }

    /// Turns of the driven gear a turn of this driver at a centre distance of `d` closing distances:
    /// (1/2π) ∮ p/(d (1 − k cos θ) − p) dθ scaled to d = 1, ½ √(1 − k²)/√((d − (1 + k)/2)(d − (1 − k)/2)). `None`
    /// where the largest radius reaches the driven shaft.
    pub(crate) fn closure_at(&self, d: f64) -> Option<f64> {
        let (near, far) = self.radius_range();
        (d > far).then(|| 0.5 * (1.0 - self.k * self.k).sqrt() / ((d - far) * (d - near)).sqrt())
    }
}

/// Fourier series of the arc length over the eccentric anomaly E, at semi-major axis 1/2.
///
/// ds/dE = A √(1 − k² cos² E) is even with period π, so the trapezoidal rule gives its cosine coefficients with an error
/// that falls as ((1 − k')/(1 + k'))^n, k' = √(1 − k²); the number of nodes is set to put that below rounding.
fn arc_series(k: f64) -> (f64, Vec<f64>) {
    let k_complement = (1.0 - k * k).sqrt();
    let decay = (1.0 - k_complement) / (1.0 + k_complement);
    // exp(−38) = 3e-17; decay = 0 for a circle, where ln is −∞ and the count 0
    let terms = if decay > 0.0 { (-38.0 / decay.ln()).ceil() as usize + 1 } else { 0 };
    let nodes = 2 * (terms + 1);
    let speed: Vec<f64> = (0..nodes)
        .map(|j| {
            let cos = (PI * j as f64 / nodes as f64).cos();
            0.5 * (1.0 - k * k * cos * cos).sqrt()
        })
        .collect();
    let mean = speed.iter().sum::<f64>() / nodes as f64;
    let sines = (1..=terms)
        .map(|n| {
            let sum: f64 =
                speed.iter().enumerate().map(|(j, v)| v * (TAU * ((n * j) % nodes) as f64 / nodes as f64).cos()).sum();
            // cosine coefficient 2/N Σ, integrated: /(2n)
            sum / (nodes as f64 * n as f64)
        })
        .collect();
    (mean, sines)
}

impl PitchCurve for Ellipse {
    fn kind(&self) -> &'static str {
        "elliptical"
    }

    fn closure(&self) -> f64 {
        1.0
    }

    #[inline]
    fn theta2(&self, theta1_rad: f64) -> f64 {
        moebius(self.k, theta1_rad)
    }

    fn theta2_inverse(&self, theta2_rad: f64) -> f64 {
        moebius(-self.k, theta2_rad)
    }

    #[inline]
    fn motion(&self, theta1_rad: f64) -> Motion {
        let k = self.k;
        let (sin, cos) = theta1_rad.sin_cos();
        // i21 = r1/(1 − r1) = (1 − k²)/(1 − 2k cos θ1 + k²)
        let denominator = 1.0 - 2.0 * k * cos + k * k;
        let ratio = (1.0 - k * k) / denominator;
        Motion {
            theta2_rad: theta1_rad + 2.0 * (k * sin / (1.0 - k * cos)).atan(),
            ratio,
            ratio_slope: -2.0 * k * sin * ratio / denominator,
        }
    }

    fn ratio_curvature(&self, theta1_rad: f64) -> f64 {
        let k = self.k;
        let (sin, cos) = theta1_rad.sin_cos();
        let denominator = 1.0 - 2.0 * k * cos + k * k;
        let ratio = (1.0 - k * k) / denominator;
        -2.0 * k * ratio * (cos * denominator - 4.0 * k * sin * sin) / (denominator * denominator)
    }

    #[inline]
    fn roll(&self, theta1_rad: f64) -> Roll {
        // One sine and cosine of θ1 for everything; f = θ1 − 2μ saves an arctangent.
        let (k, q) = (self.k, self.q);
        let (sin, cos) = theta1_rad.sin_cos();
        let inverse = 1.0 / (1.0 - 2.0 * k * cos + k * k);
        let ratio = (1.0 - k * k) * inverse;
        // 1/(1 − k cos θ1) is r1/p
        let radius = 1.0 / (1.0 - k * cos);
        let tan_mu = -k * sin * radius;
        let mu_rad = tan_mu.atan();
        let motion =
            Motion { theta2_rad: theta1_rad - 2.0 * mu_rad, ratio, ratio_slope: -2.0 * k * sin * ratio * inverse };
        let ratio_curvature = -2.0 * k * ratio * (cos - 4.0 * k * sin * sin * inverse) * inverse;
        let anomaly_rad = theta1_rad + 2.0 * (q * sin / (1.0 - q * cos)).atan();
        // cos E = (cos θ1 − k)/(1 − k cos θ1), sin E = √(1 − k²) sin θ1/(1 − k cos θ1)
        let (sin_anomaly, cos_anomaly) = (self.k_complement * sin * radius, (cos - k) * radius);
        let twice = (2.0 * sin_anomaly * cos_anomaly, 1.0 - 2.0 * sin_anomaly * sin_anomaly);
        Roll { motion, tan_mu, mu_rad, ratio_curvature, arc: self.arc_at_anomaly(anomaly_rad, twice) }
    }

    fn arc(&self, theta1_rad: f64) -> f64 {
        let anomaly_rad = moebius(self.q, theta1_rad);
        self.arc_at_anomaly(anomaly_rad, (2.0 * anomaly_rad).sin_cos())
    }

    fn radius_range(&self) -> (f64, f64) {
        (0.5 * (1.0 - self.k), 0.5 * (1.0 + self.k))
    }

    fn max_inclination(&self) -> (f64, f64) {
        // tan μ = −k sin θ/(1 − k cos θ) is largest at cos θ = k, where |μ| = asin k
        (self.k.asin(), self.k.acos())
    }
}

impl Ellipse {
    /// Arc length from the eccentric anomaly E and sin 2E, cos 2E, in centre distances.
    #[inline]
    fn arc_at_anomaly(&self, anomaly_rad: f64, (sin, cos): (f64, f64)) -> f64 {
        // Clenshaw for Σ b_n sin(n x), x = 2E
        let (mut b1, mut b2) = (0.0, 0.0);
        for &coefficient in self.arc_sines.iter().rev() {
            (b1, b2) = ((coefficient - b2) + 2.0 * cos * b1, b1);
        }
        self.arc_mean * anomaly_rad + b1 * sin
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arc_length_agrees_with_quadrature_in_theta() {
        for k in [0.0, 0.1, 0.3287, 0.6, 0.9, 0.99] {
            let ellipse = Ellipse::new(k);
            // Simpson on ds = √(r² + r'²) dθ, an independent parametrisation
            let end = 2.3;
            let steps = 200_000;
            let speed = |theta: f64| {
                let motion = ellipse.motion(theta);
                let r = motion.ratio / (1.0 + motion.ratio);
                r * (1.0 + (motion.ratio_slope / (motion.ratio * (1.0 + motion.ratio))).powi(2)).sqrt()
            };
            let h = end / f64::from(steps);
            let sum: f64 = (0..=steps)
                .map(|j| {
                    let weight = if j == 0 || j == steps { 1.0 } else { 2.0 + 2.0 * f64::from(j % 2) };
                    weight * speed(f64::from(j) * h)
                })
                .sum();
            let expected = sum * h / 3.0;
            assert!((ellipse.arc(end) / expected - 1.0).abs() < 1e-11, "k = {k}: {} {expected}", ellipse.arc(end));
        }
    }

    #[test]
    fn slopes_are_the_derivatives() {
        let ellipse = Ellipse::new(0.6);
        let h = 1e-5;
        for j in 0..40 {
            let theta = 0.2 * f64::from(j);
            let (below, here, above) = (ellipse.motion(theta - h), ellipse.motion(theta), ellipse.motion(theta + h));
            assert!(((above.theta2_rad - below.theta2_rad) / (2.0 * h) - here.ratio).abs() < 1e-7);
            assert!(((above.ratio - below.ratio) / (2.0 * h) - here.ratio_slope).abs() < 1e-6);
            let curvature = (above.ratio_slope - below.ratio_slope) / (2.0 * h);
            assert!((curvature - ellipse.ratio_curvature(theta)).abs() < 1e-5);
        }
    }

    #[test]
    fn closure_sum_is_one_at_the_closing_distance() {
        for k in [0.0, 0.2, 0.6, 0.95] {
            let sum = Ellipse::new(k).closure_at(1.0).unwrap();
            assert!((sum - 1.0).abs() < 1e-12);
            assert_eq!(Ellipse::new(k).closure_at(0.5 * (1.0 + k)), None);
        }
    }
}
