//! Pitch curves, as the transmission they give at unit centre distance.
//!
//! A pair of rolling curves is fixed by its ratio i21(θ1) = dθ2/dθ1 and its centre distance a:
//! r1 = a i/(1 + i), r2 = a/(1 + i), tan μ = r1'/r1 = i'/(i (1 + i)). A curve therefore states i21 and its integrals; the
//! tooth condition supplies the size. A new curve is one file that implements [`PitchCurve`] and one line in the list
//! below.

mod circle;
mod ellipse;
mod lobed;
mod numeric;
mod panels;
pub(crate) mod shape;

pub use circle::Circle;
pub use ellipse::Ellipse;
pub(crate) use ellipse::{ByEccentricity, MAX_ECCENTRICITY};
pub use lobed::Lobed;
pub use numeric::Numeric;
pub(crate) use numeric::{CELLS, highest, refine};

/// Angle and ratio of the driven gear at one angle of the driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// θ2 = f(θ1), rad, unwrapped.
    pub theta2_rad: f64,
    /// i21 = dθ2/dθ1.
    pub ratio: f64,
    /// di21/dθ1, 1/rad.
    pub ratio_slope: f64,
}

/// A [`Motion`] with what rack generation needs besides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roll {
    /// Angle, ratio and its slope.
    pub motion: Motion,
    /// tan μ = i21'/(i21 (1 + i21)), the tangent's inclination.
    pub tan_mu: f64,
    /// μ, rad.
    pub mu_rad: f64,
    /// d²i21/dθ1², 1/rad².
    pub ratio_curvature: f64,
    /// Arc length of gear 1's curve from θ1 = 0, in centre distances.
    pub arc: f64,
}

impl Roll {
    /// A rolling position from the ratio's derivatives and the arc length.
    #[inline]
    pub(crate) fn new(motion: Motion, ratio_curvature: f64, arc: f64) -> Self {
        // r1 = a i/(1 + i), so tan μ = r1'/r1 = i'/(i (1 + i))
        let tan_mu = motion.ratio_slope / (motion.ratio * (1.0 + motion.ratio));
        Self { motion, tan_mu, mu_rad: tan_mu.atan(), ratio_curvature, arc }
    }
}

/// The transmission of a closed pair of pitch curves at unit centre distance.
pub trait PitchCurve {
    /// Name as in `kind` of `pair.toml`.
    fn kind(&self) -> &'static str;

    /// Turns of the driven gear a turn of the driver, (1/2π) ∮ i21 dθ1.
    fn closure(&self) -> f64;

    /// f(θ1), rad, unwrapped on all reals and increasing.
    fn theta2(&self, theta1_rad: f64) -> f64;

    /// The inverse of f, rad.
    fn theta2_inverse(&self, theta2_rad: f64) -> f64;

    /// θ2, i21 and its slope at once.
    fn motion(&self, theta1_rad: f64) -> Motion;

    /// d²i21/dθ1², 1/rad²: the curvature of the pitch curve needs it.
    fn ratio_curvature(&self, theta1_rad: f64) -> f64;

    /// Arc length of gear 1's curve from θ1 = 0, in centre distances, unwrapped.
    fn arc(&self, theta1_rad: f64) -> f64;

    /// Motion, curvature and arc length at once.
    #[inline]
    fn roll(&self, theta1_rad: f64) -> Roll {
        Roll::new(self.motion(theta1_rad), self.ratio_curvature(theta1_rad), self.arc(theta1_rad))
    }

    /// i21(θ1).
    #[inline]
    fn ratio(&self, theta1_rad: f64) -> f64 {
        self.motion(theta1_rad).ratio
    }

    /// Smallest and largest r1 over a turn, in centre distances.
    fn radius_range(&self) -> (f64, f64);

    /// Largest |μ| over a turn and the θ1 where it occurs, rad.
    fn max_inclination(&self) -> (f64, f64);
}

/// Makes the closed set of curves: one variant and one line of delegation each.
macro_rules! pitch_curves {
    ($($(#[$doc:meta])* $variant:ident),+ $(,)?) => {
        /// Any pitch curve the crate knows. A closed set, so that f(θ1) is inlined where samples pass.
        #[derive(Clone, Debug, PartialEq)]
        pub enum AnyCurve {
            $($(#[$doc])* $variant($variant)),+
        }

        impl PitchCurve for AnyCurve {
            fn kind(&self) -> &'static str {
                match self { $(Self::$variant(curve) => curve.kind()),+ }
            }
            fn closure(&self) -> f64 {
                match self { $(Self::$variant(curve) => curve.closure()),+ }
            }
            #[inline]
            fn theta2(&self, theta1_rad: f64) -> f64 {
                match self { $(Self::$variant(curve) => curve.theta2(theta1_rad)),+ }
            }
            fn theta2_inverse(&self, theta2_rad: f64) -> f64 {
                match self { $(Self::$variant(curve) => curve.theta2_inverse(theta2_rad)),+ }
            }
            #[inline]
            fn motion(&self, theta1_rad: f64) -> Motion {
                match self { $(Self::$variant(curve) => curve.motion(theta1_rad)),+ }
            }
            fn ratio_curvature(&self, theta1_rad: f64) -> f64 {
                match self { $(Self::$variant(curve) => curve.ratio_curvature(theta1_rad)),+ }
            }
            fn arc(&self, theta1_rad: f64) -> f64 {
                match self { $(Self::$variant(curve) => curve.arc(theta1_rad)),+ }
            }
            #[inline]
            fn roll(&self, theta1_rad: f64) -> Roll {
                match self { $(Self::$variant(curve) => curve.roll(theta1_rad)),+ }
            }
            fn radius_range(&self) -> (f64, f64) {
                match self { $(Self::$variant(curve) => curve.radius_range()),+ }
            }
            fn max_inclination(&self) -> (f64, f64) {
                match self { $(Self::$variant(curve) => curve.max_inclination()),+ }
            }
        }

        $(impl From<$variant> for AnyCurve {
            fn from(curve: $variant) -> Self {
                Self::$variant(curve)
            }
        })+
    };
}

impl AnyCurve {
    /// Derivatives by the eccentricity; `None` for curves without.
    pub(crate) fn by_eccentricity(&self, theta1_rad: f64) -> Option<ByEccentricity> {
        match self {
            Self::Ellipse(curve) => Some(curve.by_eccentricity(theta1_rad)),
            Self::Lobed(curve) => Some(curve.by_eccentricity(theta1_rad)),
            Self::Circle(_) | Self::Numeric(_) => None,
        }
    }
}

pitch_curves! {
    /// Constant ratio.
    Circle,
    /// Ellipse about a focus, driving its twin.
    Ellipse,
    /// Ellipse of higher order, driving its mate.
    Lobed,
    /// A free curve: Fourier series, samples, or a given transmission.
    Numeric,
}
