//! Tooth flanks by rack generation, in closed form.
//!
//! At the rolling position θ the pitch curves touch at P = (r1, 0), with the unit tangent T = (−sin μ, cos μ) and the
//! normal N = (cos μ, sin μ). The rack's flank of tooth j stands off P along T by d = s(θ) − j·π m (ccw flank) or
//! s(θ) − (j + ½)·π m (cw flank); its normal is n = ± cos α T + sin α N and touches both gears at
//!
//! Q = P + (± d cos α) n, upper sign ccw.
//!
//! Carried back by −θ about the origin Q is gear 1's flank; by f(θ) about (a, 0) it is gear 2's.
//!
//! Sources: F. L. Litvin and A. Fuentes, Gear Geometry and Applied Theory, ch. 12 (non-circular gears).

use crate::gear::Gear;
use crate::{Direction, GearPair, RollPoint};

impl GearPair {
    /// Where the rack's flank at offset `d_mm` touches both gears, mm in the fixed frame of the rolling pitch curves.
    pub(crate) fn rack_contact(&self, roll: &RollPoint, d_mm: f64, side: Direction) -> [f64; 2] {
        let sign = side.sign();
        let (sin_mu, cos_mu) = roll.at.mu_rad.sin_cos();
        let (sin_alpha, cos_alpha) = self.pressure_angle_rad().sin_cos();
        // n = ± cos α T + sin α N
        let n = [-sign * cos_alpha * sin_mu + sin_alpha * cos_mu, sign * cos_alpha * cos_mu + sin_alpha * sin_mu];
        let along = sign * d_mm * cos_alpha;
        [roll.at.r1_mm + along * n[0], along * n[1]]
    }

    /// A point of the fixed frame at a rolling position in the frame of a gear's own body, whose axis is the origin and
    /// which has turned by nothing. The driven body turns clockwise by θ2.
    pub(crate) fn to_body(&self, gear: Gear, roll: &RollPoint, point_mm: [f64; 2]) -> [f64; 2] {
        match gear {
            Gear::Driver => rotate(point_mm, -roll.at.theta1_rad),
            Gear::Driven => rotate([point_mm[0] - self.centre_distance_mm(), point_mm[1]], roll.at.theta2_rad),
        }
    }

    /// How far a body point near the rolling position `theta1_rad` stands outside the gear's pitch curve, mm: the true
    /// distance to the curve, positive towards the tips, and the rolling position of its foot.
    pub(crate) fn height_over_pitch_curve(&self, gear: Gear, body_mm: [f64; 2], theta1_rad: f64) -> (f64, f64) {
        // Foot: (body − C(θ))·C'(θ) = 0, by Newton in the fixed frame of θ, where C = P and C' ∥ T.
        let mut theta_rad = theta1_rad;
        for _ in 0..30 {
            let roll = self.roll(theta_rad);
            let (along, outside, curvature) = self.over_pitch_point(gear, &roll, body_mm);
            let speed = roll.at.r1_mm / roll.at.mu_rad.cos();
            // The body moves past P along +T: d(along)/ds = 1 + κ·outside.
            let stretch = (1.0 + curvature * outside).max(0.1);
            let step = along / (speed * stretch);
            theta_rad -= step.clamp(-0.2, 0.2);
            if step.abs() < 1e-13 {
                break;
            }
        }
        let roll = self.roll(theta_rad);
        let (_, outside, _) = self.over_pitch_point(gear, &roll, body_mm);
        (outside, theta_rad)
    }

    /// Coordinates of a body point along the pitch curve's tangent and outward normal at a rolling position, mm, and the
    /// curvature of the gear's pitch curve there, 1/mm (positive where convex).
    fn over_pitch_point(&self, gear: Gear, roll: &RollPoint, body_mm: [f64; 2]) -> (f64, f64, f64) {
        let at = &roll.at;
        let (sin_mu, cos_mu) = at.mu_rad.sin_cos();
        let (fixed, outward) = match gear {
            Gear::Driver => (rotate(body_mm, at.theta1_rad), 1.0),
            Gear::Driven => {
                let turned = rotate(body_mm, -at.theta2_rad);
                ([turned[0] + self.centre_distance_mm(), turned[1]], -1.0)
            }
        };
        let (x, y) = (fixed[0] - at.r1_mm, fixed[1]);
        let along = -sin_mu * x + cos_mu * y;
        let across = cos_mu * x + sin_mu * y;
        (along, outward * across, self.pitch_curvature(gear, roll))
    }

    /// Curvature of a gear's pitch curve, 1/mm, positive where convex. The tangent of gear 1's curve turns in its body by
    /// dθ1 − dμ, that of gear 2's by dθ2 + dμ, over ds = r1/cos μ dθ1.
    pub(crate) fn pitch_curvature(&self, gear: Gear, roll: &RollPoint) -> f64 {
        let turn = match gear {
            Gear::Driver => 1.0 - roll.mu_slope,
            Gear::Driven => roll.at.ratio + roll.mu_slope,
        };
        turn * roll.at.mu_rad.cos() / roll.at.r1_mm
    }

    /// θ1 at which the arc length is `arc_mm`, rad.
    #[must_use]
    pub fn theta1_at_arc_length(&self, arc_mm: f64) -> f64 {
        let perimeter_mm = self.perimeter_mm();
        let mut theta_rad = std::f64::consts::TAU * arc_mm / perimeter_mm;
        // s is increasing: Newton, kept within half a turn of the bracket that periodicity gives.
        let (mut low, mut high) = (theta_rad - std::f64::consts::PI, theta_rad + std::f64::consts::PI);
        for _ in 0..60 {
            let roll = self.roll(theta_rad);
            let error_mm = roll.arc_mm - arc_mm;
            if error_mm > 0.0 {
                high = theta_rad;
            } else {
                low = theta_rad;
            }
            let next = theta_rad - error_mm * roll.at.mu_rad.cos() / roll.at.r1_mm;
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - theta_rad).abs() <= 4.0 * f64::EPSILON * theta_rad.abs().max(1.0) {
                return next;
            }
            theta_rad = next;
        }
        theta_rad
    }
}

/// A vector turned counter-clockwise.
#[inline]
pub(crate) fn rotate([x, y]: [f64; 2], angle_rad: f64) -> [f64; 2] {
    let (sin, cos) = angle_rad.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CircularSpec, EllipticalSpec};

    #[test]
    fn the_flanks_of_a_circular_gear_are_involutes() {
        let pair = GearPair::circular(&CircularSpec { teeth: (31, 47), ..Default::default() }).unwrap();
        let (z1, z2) = (31.0, 47.0);
        for (gear, teeth) in [(Gear::Driver, z1), (Gear::Driven, z2)] {
            let base_mm = 1.5 * teeth * pair.pressure_angle_rad().cos();
            for side in Direction::BOTH {
                let mut polar = Vec::new();
                for step in -5..=5 {
                    let theta = 0.02 * f64::from(step);
                    let roll = pair.roll(theta);
                    let half = if side == Direction::Ccw { 0.0 } else { 0.5 };
                    let d = roll.arc_mm - half * pair.pitch_mm().unwrap();
                    let [x, y] = pair.to_body(gear, &roll, pair.rack_contact(&roll, d, side));
                    let radius = x.hypot(y);
                    let tan = ((radius / base_mm).powi(2) - 1.0).sqrt();
                    // polar angle of an involute = start ± inv α(r)
                    let start = if gear == Gear::Driver { 0.0 } else { std::f64::consts::PI };
                    let [x, y] = rotate([x, y], -start);
                    polar.push((y.atan2(x), tan - tan.atan()));
                }
                let slopes: Vec<f64> = polar.windows(2).map(|w| (w[1].0 - w[0].0) / (w[1].1 - w[0].1)).collect();
                for slope in slopes {
                    assert!((slope.abs() - 1.0).abs() < 1e-9, "{gear:?} {side}: {slope}");
                }
            }
        }
    }

    #[test]
    fn heights_over_the_pitch_curve() {
        let pair = GearPair::elliptical(&EllipticalSpec { eccentricity: 0.5, ..Default::default() }).unwrap();
        for gear in [Gear::Driver, Gear::Driven] {
            for step in 0..20 {
                let roll = pair.roll(0.3 * f64::from(step));
                let outward = if gear == Gear::Driver { 1.0 } else { -1.0 };
                let (sin_mu, cos_mu) = roll.at.mu_rad.sin_cos();
                for height in [-2.0, 0.0, 3.0] {
                    let point = [roll.at.r1_mm + outward * height * cos_mu, outward * height * sin_mu];
                    let body = pair.to_body(gear, &roll, point);
                    let (found, foot) = pair.height_over_pitch_curve(gear, body, roll.at.theta1_rad + 0.05);
                    assert!((found - height).abs() < 1e-10, "{gear:?} {height} {found}");
                    assert!((foot - roll.at.theta1_rad).abs() < 1e-10);
                }
            }
        }
    }

    #[test]
    fn arc_length_inverts() {
        let pair = GearPair::elliptical(&EllipticalSpec { eccentricity: 0.8, ..Default::default() }).unwrap();
        for step in -40..40 {
            let theta = 0.37 * f64::from(step);
            assert!((pair.theta1_at_arc_length(pair.arc_length_mm(theta)) - theta).abs() < 1e-12);
        }
    }
}
