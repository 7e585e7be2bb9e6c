//! Constant ratio: two circles, or any drive with two encoders.

use std::f64::consts::TAU;

use super::{Motion, PitchCurve};

/// Two circles: i21 = driver / driven, constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Numerator of i21: teeth of the driver.
    driver: f64,
    /// Denominator of i21: teeth of the driven gear.
    driven: f64,
}

impl Circle {
    /// The ratio i21 = `driver` / `driven`, both positive and finite. Kept as two numbers so that a whole turn of a pair
    /// whose ratio is not a binary fraction stays a whole turn.
    pub(crate) fn new(driver: f64, driven: f64) -> Self {
        Self { driver, driven }
    }
}

impl PitchCurve for Circle {
    fn kind(&self) -> &'static str {
        "circular"
    }

    fn closure(&self) -> f64 {
        self.driver / self.driven
    }

    #[inline]
    fn theta2(&self, theta1_rad: f64) -> f64 {
        theta1_rad * self.driver / self.driven
    }

    fn theta2_inverse(&self, theta2_rad: f64) -> f64 {
        theta2_rad * self.driven / self.driver
    }

    #[inline]
    fn motion(&self, theta1_rad: f64) -> Motion {
        Motion { theta2_rad: self.theta2(theta1_rad), ratio: self.driver / self.driven, ratio_slope: 0.0 }
    }

    fn ratio_curvature(&self, _theta1_rad: f64) -> f64 {
        0.0
    }

    fn arc(&self, theta1_rad: f64) -> f64 {
        // r1 = i/(1 + i) = driver/(driver + driven) at unit centre distance
        theta1_rad * self.driver / (self.driver + self.driven)
    }

    fn radius_range(&self) -> (f64, f64) {
        let radius = self.arc(TAU) / TAU;
        (radius, radius)
    }

    fn max_inclination(&self) -> (f64, f64) {
        (0.0, 0.0)
    }
}
