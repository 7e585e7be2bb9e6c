//! Pitch curves of the simulated pair: an ellipse about its focus, or circles.
//!
//! Angles in rad, lengths in mm. The driver sits at the origin, the driven gear at (a, 0); the driven angle counts
//! positive in its own sense of motion, so the transmission function increases.

use super::error::{PlantError, in_range};

/// The gear pair as it was really made and mounted.
#[derive(Debug, Clone, PartialEq)]
pub struct GearSpec {
    /// Module m, mm.
    pub module_mm: f64,
    /// Tooth numbers of driver and driven gear.
    pub teeth: [u32; 2],
    /// Numerical eccentricity k of the pitch ellipse; 0 makes a circular pair.
    pub eccentricity: f64,
    /// Pressure angle α of the generating rack, degrees.
    pub pressure_angle_deg: f64,
    /// Tooth thinning of both gears together, along the pitch curve, mm.
    pub backlash_mm: f64,
    /// Eccentricity of gear 1, mm: from the shaft's axis to the true centre of the pitch curve.
    pub e1_mm: f64,
    /// Direction of `e1_mm` at driver angle 0, rad from the centre line, counter-clockwise.
    pub phi1_rad: f64,
    /// Eccentricity of gear 2, mm.
    pub e2_mm: f64,
    /// Direction of `e2_mm` at driven angle 0, rad from the centre line, in the driven sense (clockwise).
    pub phi2_rad: f64,
    /// Growth of the centre distance over the one that closes, mm.
    pub centre_distance_error_mm: f64,
}

impl Default for GearSpec {
    fn default() -> Self {
        Self {
            module_mm: 3.0,
            teeth: [47, 47],
            eccentricity: 0.3287,
            pressure_angle_deg: 20.0,
            // The documented eccentricities alone close the gap by up to 0.04 mm along the pitch curve; 0.15 mm keeps
            // it open.
            backlash_mm: 0.15,
            e1_mm: 0.05,
            phi1_rad: 0.3,
            e2_mm: 0.03,
            phi2_rad: 1.1,
            centre_distance_error_mm: 0.0,
        }
    }
}

impl GearSpec {
    /// A pair without any error and without backlash.
    #[must_use]
    pub fn ideal(self) -> Self {
        Self { backlash_mm: 0.0, e1_mm: 0.0, e2_mm: 0.0, centre_distance_error_mm: 0.0, ..self }
    }

    /// Adds the vector (dx, dy), mm, to the eccentricity of gear 1.
    pub fn displace_gear1(&mut self, dx_mm: f64, dy_mm: f64) {
        (self.e1_mm, self.phi1_rad) = add_polar(self.e1_mm, self.phi1_rad, dx_mm, dy_mm);
    }

    /// Adds the vector (dx, dy), mm, to the eccentricity of gear 2 (dy in the driven sense).
    pub fn displace_gear2(&mut self, dx_mm: f64, dy_mm: f64) {
        (self.e2_mm, self.phi2_rad) = add_polar(self.e2_mm, self.phi2_rad, dx_mm, dy_mm);
    }

    pub(super) fn validate(&self) -> Result<(), PlantError> {
        let m = self.module_mm;
        in_range("gears.module_mm", m, "mm", (0.05, 100.0), "give the module in mm")?;
        for teeth in self.teeth {
            in_range("gears.teeth", f64::from(teeth), "teeth", (8.0, 250.0), "use a real tooth number")?;
        }
        in_range(
            "gears.eccentricity",
            self.eccentricity,
            "",
            (0.0, 0.8),
            "k = 0 is circular; above 0.8 teeth cannot be cut",
        )?;
        in_range("gears.pressure_angle_deg", self.pressure_angle_deg, "deg", (5.0, 45.0), "20 is usual")?;
        in_range(
            "gears.backlash_mm",
            self.backlash_mm,
            "mm",
            (0.0, 0.5 * m),
            "give the thinning in mm, well under a module",
        )?;
        in_range("gears.e1_mm", self.e1_mm, "mm", (0.0, 0.5 * m), "give the eccentricity in mm, well under a module")?;
        in_range("gears.e2_mm", self.e2_mm, "mm", (0.0, 0.5 * m), "give the eccentricity in mm, well under a module")?;
        let limits = (-0.5 * m, 0.5 * m);
        in_range(
            "gears.centre_distance_error_mm",
            self.centre_distance_error_mm,
            "mm",
            limits,
            "stay well under a module",
        )?;
        let finite = (-1e6, 1e6);
        in_range("gears.phi1_rad", self.phi1_rad, "rad", finite, "give a finite angle")?;
        in_range("gears.phi2_rad", self.phi2_rad, "rad", finite, "give a finite angle")?;
        if self.eccentricity > 0.0 && self.teeth[0] != self.teeth[1] {
            return Err(PlantError::UnequalTeeth {
                eccentricity: self.eccentricity,
                z1: self.teeth[0],
                z2: self.teeth[1],
            });
        }
        Ok(())
    }
}

fn add_polar(length: f64, angle: f64, dx: f64, dy: f64) -> (f64, f64) {
    let (x, y) = (length * angle.cos() + dx, length * angle.sin() + dy);
    (x.hypot(y), y.atan2(x))
}

/// Radius of the driver's pitch curve on the centre line and its derivatives over θ1, mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Radius {
    pub r: f64,
    pub dr: f64,
    pub ddr: f64,
}

impl Radius {
    /// Inclination μ of the tangent: tan μ = r1'/r1.
    pub fn inclination(&self) -> f64 {
        self.dr.atan2(self.r)
    }

    /// dμ/dθ = (r r'' − r'²)/(r² + r'²).
    pub fn inclination_slope(&self) -> f64 {
        (self.r * self.ddr - self.dr * self.dr) / (self.r * self.r + self.dr * self.dr)
    }

    /// ds/dθ = √(r² + r'²), mm/rad.
    pub fn arc_slope(&self) -> f64 {
        self.r.hypot(self.dr)
    }
}

/// The pair of pitch curves, rolling on one another.
#[derive(Debug, Clone)]
pub(super) struct PitchCurves {
    /// Eccentricity k of the ellipse.
    k: f64,
    /// Semi-latus rectum p of the ellipse, or the driver's radius, mm.
    p_mm: f64,
    /// Centre distance that closes, mm.
    pub centre_distance_mm: f64,
    /// Mean ratio Z1/Z2.
    pub mean_ratio: f64,
    /// Driver turns after which both gears stand as before.
    pub turns_per_period: u32,
}

impl PitchCurves {
    pub fn new(gears: &GearSpec) -> Self {
        let [z1, z2] = gears.teeth;
        let k = gears.eccentricity;
        if k == 0.0 {
            Self {
                k,
                p_mm: 0.5 * gears.module_mm * f64::from(z1),
                centre_distance_mm: 0.5 * gears.module_mm * f64::from(z1 + z2),
                mean_ratio: f64::from(z1) / f64::from(z2),
                turns_per_period: z2 / greatest_common_divisor(z1, z2),
            }
        } else {
            // Tooth condition: perimeter 4 A E(k) = π m Z fixes the semi-major axis A; each gear turns about a focus, a
            // = 2A.
            let perimeter_mm = std::f64::consts::PI * gears.module_mm * f64::from(z1);
            let semi_major_mm = perimeter_mm / (4.0 * complete_elliptic_e(k));
            Self {
                k,
                p_mm: semi_major_mm * (1.0 - k * k),
                centre_distance_mm: 2.0 * semi_major_mm,
                mean_ratio: 1.0,
                turns_per_period: 1,
            }
        }
    }

    /// r1 = p/(1 − k cos θ1) with its derivatives.
    pub fn radius(&self, theta1: f64) -> Radius {
        let (sin, cos) = theta1.sin_cos();
        let w = 1.0 - self.k * cos;
        let r = self.p_mm / w;
        let dw = self.k * sin;
        let dr = -r * dw / w;
        let ddr = -r * self.k * cos / w + 2.0 * r * dw * dw / (w * w);
        Radius { r, dr, ddr }
    }

    /// Nominal driven angle f(θ1), rad.
    ///
    /// tan(f/2) = (1+k)/(1−k) tan(θ1/2); the difference f − θ1 of that Moebius map is 2 atan(k sin θ1/(1 − k cos θ1)),
    /// which needs no unwrapping.
    pub fn driven_angle(&self, theta1: f64) -> f64 {
        if self.k == 0.0 {
            return self.mean_ratio * theta1;
        }
        let (sin, cos) = theta1.sin_cos();
        theta1 + 2.0 * (self.k * sin).atan2(1.0 - self.k * cos)
    }

    /// i21 = dθ2/dθ1 = r1/(a − r1).
    pub fn ratio(&self, theta1: f64) -> f64 {
        let r1 = self.radius(theta1).r;
        r1 / (self.centre_distance_mm - r1)
    }

    /// r2 = a − r1, mm.
    pub fn driven_radius(&self, theta1: f64) -> f64 {
        self.centre_distance_mm - self.radius(theta1).r
    }

    /// Pitch arc from `from` to `to`, mm, by five-point Gauss–Legendre quadrature; meant for arcs up to a few tooth
    /// pitches.
    pub fn arc_mm(&self, from: f64, to: f64) -> f64 {
        const NODES: [(f64, f64); 3] = [
            (0.0, 0.568_888_888_888_888_9),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        ];
        let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
        let speed = |x: f64| self.radius(centre + half * x).arc_slope();
        let mut sum = NODES[0].1 * speed(0.0);
        for (x, weight) in &NODES[1..] {
            sum += weight * (speed(-x) + speed(*x));
        }
        sum * half
    }
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// Complete elliptic integral of the second kind E(k) by the arithmetic–geometric mean:
/// E = K (1 − Σ 2^(n−1) c_n²), K = π/(2 agm(1, √(1−k²))) (Abramowitz and Stegun 17.6).
fn complete_elliptic_e(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    let mut sum = 0.5 * k * k;
    let mut power = 0.5;
    // Convergence is quadratic: eight rounds exhaust f64 for every k the specification allows.
    for _ in 0..8 {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        power *= 2.0;
        sum += power * c * c;
    }
    std::f64::consts::FRAC_PI_2 / a * (1.0 - sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn pair(k: f64) -> PitchCurves {
        PitchCurves::new(&GearSpec { eccentricity: k, ..GearSpec::default() })
    }

    #[test]
    fn the_tooth_condition_fixes_the_documented_centre_distances() {
        for (k, a_mm) in
            [(0.0, 141.0), (0.2, 142.435_217), (0.3287, 144.999_717), (0.4, 147.072_290), (0.6, 156.184_243)]
        {
            assert!((pair(k).centre_distance_mm - a_mm).abs() < 1e-6, "k = {k}");
        }
    }

    #[test]
    fn the_ratio_is_the_derivative_of_the_transmission_function() {
        for k in [0.0, 0.3287, 0.6] {
            let curves = pair(k);
            for n in 0..64 {
                let theta = f64::from(n) * 0.1;
                let slope = (curves.driven_angle(theta + 1e-5) - curves.driven_angle(theta - 1e-5)) / 2e-5;
                assert!((slope - curves.ratio(theta)).abs() < 1e-8, "k = {k}, theta = {theta}");
            }
            assert!((curves.driven_angle(TAU) - TAU).abs() < 1e-14);
        }
    }

    #[test]
    fn derivatives_of_the_radius_agree_with_differences() {
        let curves = pair(0.5);
        for n in 0..20 {
            let theta = f64::from(n) * 0.33;
            let (minus, here, plus) = (curves.radius(theta - 1e-4), curves.radius(theta), curves.radius(theta + 1e-4));
            assert!(((plus.r - minus.r) / 2e-4 - here.dr).abs() < 1e-4);
            assert!(((plus.dr - minus.dr) / 2e-4 - here.ddr).abs() < 1e-4);
            let slope = (plus.inclination() - minus.inclination()) / 2e-4;
            assert!((slope - here.inclination_slope()).abs() < 1e-6);
        }
    }

    #[test]
    fn the_arc_of_a_whole_turn_is_the_perimeter() {
        let curves = pair(0.3287);
        let arcs: f64 = (0..64).map(|n| curves.arc_mm(f64::from(n) * TAU / 64.0, f64::from(n + 1) * TAU / 64.0)).sum();
        assert!((arcs - std::f64::consts::PI * 3.0 * 47.0).abs() < 1e-10);
    }

    #[test]
    fn unequal_teeth_are_for_circular_pairs_only() {
        let gears = GearSpec { teeth: [47, 31], ..GearSpec::default() };
        assert!(matches!(gears.validate(), Err(PlantError::UnequalTeeth { .. })));
        let circular = GearSpec { eccentricity: 0.0, ..gears };
        assert!(circular.validate().is_ok());
        assert_eq!(PitchCurves::new(&circular).turns_per_period, 31);
    }

    #[test]
    fn displacements_add_as_vectors() {
        let mut gears = GearSpec::default();
        gears.displace_gear1(-0.05 * 0.3f64.cos(), -0.05 * 0.3f64.sin());
        assert!(gears.e1_mm < 1e-15);
    }
}
