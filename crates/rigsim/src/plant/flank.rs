//! Exact contact of rack-generated flanks under rigid displacements of both gears.
//!
//! A rack that rolls along both pitch curves cuts conjugate flanks. At rolling parameter θ, with pitch point P = (r1,
//! 0), unit tangent T = (−sin μ, cos μ), normal N = (cos μ, sin μ) and the rack flank at the distance d from P along T,
//! the cut point is Q = P ± (d cos α) n on the flank normal n = ± cos α T + sin α N (upper sign: ccw flank). Turned
//! back by θ about the driver's axis Q traces gear 1's flank, by f(θ) about the driven axis gear 2's. Both gears
//! displaced, a driver angle θ1 leaves three unknowns (θ_a, θ_b, ψ2) and three equations: the points coincide, and so
//! do the normals. Newton's method solves them.
//!
//! Rigid displacements move every tooth pair of a flank alike (flanks of neighbouring teeth are equidistant), so it is
//! enough to follow the pair whose rack flank passes the pitch point at θ1 itself; a test holds another pair against
//! it.

use super::error::PlantError;
use super::geometry::{GearSpec, PitchCurves};

/// Newton steps under this size end the iteration, rad.
const CONVERGED_RAD: f64 = 1e-12;

/// The flank that carries: named after the sense of rotation of a driving gear 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flank {
    /// Carries while the driver turns counter-clockwise against the load.
    Ccw,
    /// Carries while the driver turns clockwise against the load.
    Cw,
}

impl Flank {
    /// +1 on the ccw flank, −1 on the cw flank.
    pub(super) fn sign(self) -> f64 {
        match self {
            Self::Ccw => 1.0,
            Self::Cw => -1.0,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Ccw => "ccw",
            Self::Cw => "cw",
        }
    }
}

/// One solved contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    /// Driven angle at which the flanks touch, rad.
    pub psi2_rad: f64,
    /// dψ2/dθ1.
    pub ratio: f64,
    /// Lever arm of the common normal about the driven axis, mm (r2 cos(α ∓ μ) without displacements).
    pub arm2_mm: f64,
}

/// The gears as mounted, ready to be brought into contact.
#[derive(Debug, Clone)]
pub(super) struct MountedPair {
    pub curves: PitchCurves,
    alpha: f64,
    /// Recess of each gear's flank along its normal, mm: a quarter of the backlash each, four flanks make the whole.
    recess_mm: f64,
    e1_mm: f64,
    phi1: f64,
    e2_mm: f64,
    phi2: f64,
    /// True centre distance, mm.
    distance_mm: f64,
}

type Vector = [f64; 2];

fn rotate([x, y]: Vector, (sin, cos): (f64, f64)) -> Vector {
    [cos * x - sin * y, sin * x + cos * y]
}

/// A quarter turn counter-clockwise: the derivative of a rotation.
fn quarter([x, y]: Vector) -> Vector {
    [-y, x]
}

/// The rack's cut point in the fixed frame, at one rolling parameter.
struct Cut {
    point: Vector,
    slope: Vector,
    normal: Vector,
    inclination: f64,
    inclination_slope: f64,
}

impl MountedPair {
    /// The pair of `gears`, its centre distance grown further by `growth_mm`.
    pub fn new(gears: &GearSpec, growth_mm: f64) -> Self {
        let curves = PitchCurves::new(gears);
        let alpha = gears.pressure_angle_deg.to_radians();
        Self {
            alpha,
            recess_mm: 0.25 * gears.backlash_mm * alpha.cos(),
            e1_mm: gears.e1_mm,
            phi1: gears.phi1_rad,
            e2_mm: gears.e2_mm,
            phi2: gears.phi2_rad,
            distance_mm: curves.centre_distance_mm + gears.centre_distance_error_mm + growth_mm,
            curves,
        }
    }

    /// Pressure angle of the rack, rad.
    pub fn pressure_angle_rad(&self) -> f64 {
        self.alpha
    }

    fn cut(&self, flank: Flank, theta: f64, passes_at: f64, offset_mm: f64, recess_mm: f64) -> Cut {
        let side = flank.sign();
        let radius = self.curves.radius(theta);
        let (mu, mu_slope) = (radius.inclination(), radius.inclination_slope());
        // n = ± cos α T + sin α N: (sin(α−μ), cos(α−μ)) on the ccw flank, (sin(α+μ), −cos(α+μ)) on the cw flank.
        let (sin, cos) = (self.alpha - side * mu).sin_cos();
        let normal = [sin, side * cos];
        let (cos_alpha, arc) = (self.alpha.cos(), self.curves.arc_mm(passes_at, theta));
        let reach = side * cos_alpha * (arc - offset_mm) + recess_mm;
        let reach_slope = side * cos_alpha * radius.arc_slope();
        // The normal turns with the tangent, by μ: n' = μ' ẑ × n.
        let turned = quarter(normal);
        Cut {
            point: [radius.r + reach * normal[0], reach * normal[1]],
            slope: [
                radius.dr + reach_slope * normal[0] + reach * mu_slope * turned[0],
                reach_slope * normal[1] + reach * mu_slope * turned[1],
            ],
            normal,
            inclination: mu,
            inclination_slope: mu_slope,
        }
    }

    /// Contact at driver angle `theta1` on `flank`, of the tooth pair whose rack flank is `offset_mm` away from the
    /// pitch point.
    pub fn contact(&self, flank: Flank, theta1: f64, offset_mm: f64) -> Result<Contact, PlantError> {
        let nominal = self.curves.driven_angle(theta1);
        let (mut a, mut b, mut psi) = (theta1, theta1, nominal);
        let mut last = f64::INFINITY;
        for _ in 0..30 {
            let system = self.system(flank, theta1, offset_mm, a, b, psi);
            let Some([da, db, dpsi]) = solve3(&system.jacobian, &system.residual.map(|r| -r)) else {
                break;
            };
            (a, b, psi) = (a + da, b + db, psi + dpsi);
            last = da.abs().max(db.abs()).max(dpsi.abs());
            if !last.is_finite() {
                break;
            }
            if last < CONVERGED_RAD {
                let system = self.system(flank, theta1, offset_mm, a, b, psi);
                // Implicit function theorem: J d(a, b, ψ)/dθ1 = −∂F/∂θ1.
                let Some([_, _, ratio]) = solve3(&system.jacobian, &system.over_theta1.map(|r| -r)) else {
                    break;
                };
                return Ok(Contact { psi2_rad: psi, ratio, arm2_mm: system.arm2_mm });
            }
        }
        Err(PlantError::NoContact {
            flank: flank.name(),
            theta1_rad: theta1,
            residual_rad: last,
            limit_rad: CONVERGED_RAD,
        })
    }

    fn system(&self, flank: Flank, theta1: f64, offset_mm: f64, a: f64, b: f64, psi: f64) -> System {
        let nominal_centre = self.curves.centre_distance_mm;
        // Recessing gear 1's flank moves it against the normal that pushes gear 2, gear 2's flank along it.
        let one = self.cut(flank, a, theta1, offset_mm, -self.recess_mm);
        let two = self.cut(flank, b, theta1, offset_mm, self.recess_mm);

        let turn1 = (theta1 - a).sin_cos();
        let (sin_u, cos_u) = (theta1 + self.phi1).sin_cos();
        let arm1 = rotate(one.point, turn1);
        let point1 = [arm1[0] + self.e1_mm * cos_u, arm1[1] + self.e1_mm * sin_u];
        let curl = quarter(one.point);
        let over_a = rotate([one.slope[0] - curl[0], one.slope[1] - curl[1]], turn1);

        // The driven gear turns clockwise.
        let turn2 = (self.curves.driven_angle(b) - psi).sin_cos();
        let (sin_v, cos_v) = (psi + self.phi2).sin_cos();
        let from_axis = [two.point[0] - nominal_centre, two.point[1]];
        let arm2 = rotate(from_axis, turn2);
        let reach2 = [arm2[0] + self.e2_mm * cos_v, arm2[1] - self.e2_mm * sin_v];
        let point2 = [self.distance_mm + reach2[0], reach2[1]];
        let f_slope = self.curves.ratio(b);
        let curl = quarter(from_axis);
        let over_b = rotate([two.slope[0] + f_slope * curl[0], two.slope[1] + f_slope * curl[1]], turn2);
        let spin = quarter(arm2);
        let over_psi = [-spin[0] - self.e2_mm * sin_v, -spin[1] - self.e2_mm * cos_v];

        // Directions of the two normals; constants alike on both sides cancel.
        let direction1 = one.inclination + theta1 - a;
        let direction2 = two.inclination + self.curves.driven_angle(b) - psi;
        let normal = rotate(one.normal, turn1);
        let spin1 = quarter(arm1);
        System {
            residual: [point1[0] - point2[0], point1[1] - point2[1], direction1 - direction2],
            jacobian: [
                [over_a[0], -over_b[0], -over_psi[0]],
                [over_a[1], -over_b[1], -over_psi[1]],
                [one.inclination_slope - 1.0, -(two.inclination_slope + f_slope), 1.0],
            ],
            over_theta1: [spin1[0] - self.e1_mm * sin_u, spin1[1] + self.e1_mm * cos_u, 1.0],
            arm2_mm: (reach2[0] * normal[1] - reach2[1] * normal[0]).abs(),
        }
    }
}

struct System {
    residual: [f64; 3],
    jacobian: [[f64; 3]; 3],
    over_theta1: [f64; 3],
    arm2_mm: f64,
}

/// Cramer's rule; `None` for a singular matrix.
fn solve3(m: &[[f64; 3]; 3], r: &[f64; 3]) -> Option<[f64; 3]> {
    let minor = |i: usize, j: usize| {
        let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1]
    };
    let determinant = (0..3).map(|j| m[0][j] * minor(0, j)).sum::<f64>();
    if determinant == 0.0 || !determinant.is_finite() {
        return None;
    }
    Some(std::array::from_fn(|j| (0..3).map(|i| minor(i, j) * r[i]).sum::<f64>() / determinant))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn mounted(k: f64, e1: f64, e2: f64, backlash: f64) -> MountedPair {
        let gears = GearSpec { eccentricity: k, e1_mm: e1, e2_mm: e2, backlash_mm: backlash, ..GearSpec::default() };
        MountedPair::new(&gears, 0.0)
    }

    fn grid() -> impl Iterator<Item = f64> {
        (0..90).map(|n| f64::from(n) * TAU / 90.0)
    }

    #[test]
    fn undisplaced_flanks_are_conjugate() {
        for k in [0.0, 0.3287, 0.6] {
            let pair = mounted(k, 0.0, 0.0, 0.0);
            for theta in grid() {
                for flank in [Flank::Ccw, Flank::Cw] {
                    for offset in [-4.0, 0.0, 4.0] {
                        let contact = pair.contact(flank, theta, offset).unwrap();
                        assert!((contact.psi2_rad - pair.curves.driven_angle(theta)).abs() < 1e-13);
                        assert!((contact.ratio - pair.curves.ratio(theta)).abs() < 1e-12);
                        let mu = pair.curves.radius(theta).inclination();
                        let arm = pair.curves.driven_radius(theta) * (pair.alpha - flank.sign() * mu).cos();
                        assert!((contact.arm2_mm - arm).abs() < 1e-10);
                    }
                }
            }
        }
    }

    #[test]
    fn every_tooth_pair_of_a_flank_agrees() {
        let pair = mounted(0.3287, 0.05, 0.03, 0.15);
        for theta in grid() {
            for flank in [Flank::Ccw, Flank::Cw] {
                let here = pair.contact(flank, theta, 0.0).unwrap();
                let other = pair.contact(flank, theta, PI * 3.0 / 2.0).unwrap();
                assert!((here.psi2_rad - other.psi2_rad).abs() < 1e-12, "{} at {theta}", flank.name());
                assert!((here.arm2_mm - other.arm2_mm).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn the_ratio_is_the_slope_of_the_contact_angle() {
        let pair = mounted(0.6, 0.05, 0.03, 0.3);
        for theta in grid() {
            for flank in [Flank::Ccw, Flank::Cw] {
                let psi = |t: f64| pair.contact(flank, t, 0.0).unwrap().psi2_rad;
                let slope = (psi(theta + 1e-5) - psi(theta - 1e-5)) / 2e-5;
                assert!((slope - pair.contact(flank, theta, 0.0).unwrap().ratio).abs() < 1e-7);
            }
        }
    }

    /// Eccentric involute gears in closed form: with γ the direction of the line between the displaced base-circle
    /// centres and cos α' = (rb1 + rb2)/distance, rb1 θ1 − rb2 ψ2 = (rb1 + rb2)(γ ± inv α') + const (upper sign: ccw
    /// flank).
    #[test]
    fn circular_gears_follow_the_closed_form_of_eccentric_involutes() {
        let pair = mounted(0.0, 0.05, 0.03, 0.15);
        let rb = 70.5 * 20f64.to_radians().cos();
        let inv = |angle: f64| angle.tan() - angle;
        for flank in [Flank::Ccw, Flank::Cw] {
            let constants: Vec<f64> = grid()
                .map(|theta| {
                    let psi = pair.contact(flank, theta, 0.0).unwrap().psi2_rad;
                    let (u, v) = (theta + 0.3, psi + 1.1);
                    let dx = 141.0 + 0.03 * v.cos() - 0.05 * u.cos();
                    let dy = -0.03 * v.sin() - 0.05 * u.sin();
                    let working = (2.0 * rb / dx.hypot(dy)).acos();
                    rb * (theta - psi) - 2.0 * rb * (dy.atan2(dx) + flank.sign() * inv(working))
                })
                .collect();
            for value in &constants {
                assert!((value - constants[0]).abs() < 1e-11, "{} {}", flank.name(), value - constants[0]);
            }
        }
    }

    #[test]
    fn absurd_displacements_are_an_error_not_a_wrong_angle() {
        let pair = mounted(0.3287, 400.0, 0.0, 0.0);
        let failed = grid().any(|theta| pair.contact(Flank::Ccw, theta, 0.0).is_err());
        assert!(failed);
    }
}
