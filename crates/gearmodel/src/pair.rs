//! A gear pair: teeth, size and the kinematics of its pitch curves.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::{Arc, OnceLock};

use crate::geometry_error::{GeometryError, check_range, check_teeth};
use crate::pitch_curve::{AnyCurve, Circle, Ellipse, PitchCurve};
use crate::spec::{CircularSpec, EllipticalSpec, ToothSpec};
use crate::tip_reach::Tips;

/// How far a drawing may round the centre distance, mm: 145.0 for 144.9997 is rounding, 150 is another pair.
pub const CENTRE_DISTANCE_ROUNDING_MM: f64 = 0.005;
/// Largest |α ± μ| at which a flank is taken to drive, deg.
const MAX_EFFECTIVE_PRESSURE_ANGLE_DEG: f64 = 85.0;

/// A pair of gears that closes, with its teeth.
#[derive(Clone, Debug, PartialEq)]
pub struct GearPair {
    curve: AnyCurve,
    centre_distance_mm: f64,
    module_mm: f64,
    teeth: (u32, u32),
    pressure_angle_rad: f64,
    /// sin α and cos α.
    pressure_angle_sin_cos: (f64, f64),
    face_width_mm: f64,
    addendum: f64,
    dedendum_clearance: f64,
    backlash_mm: f64,
    tips: SharedTips,
}

/// The tips, found when first asked for and shared by clones. They follow from the rest, so all compare equal.
#[derive(Clone, Debug, Default)]
struct SharedTips(Arc<OnceLock<Arc<Tips>>>);

impl PartialEq for SharedTips {
    fn eq(&self, _other: &Self) -> bool {
        true
    }
}

/// Everything the increments need at one driver angle, evaluated once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshPoint {
    /// Driver angle θ1, rad.
    pub theta1_rad: f64,
    /// Driven angle f(θ1), rad.
    pub theta2_rad: f64,
    /// i21 = dθ2/dθ1.
    pub ratio: f64,
    /// r1, mm.
    pub r1_mm: f64,
    /// r2 = a − r1, mm.
    pub r2_mm: f64,
    /// Inclination μ of the pitch curves' tangent, rad.
    pub mu_rad: f64,
}

/// Everything rack generation needs at one rolling position of the pitch curves, evaluated once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RollPoint {
    /// Kinematics at the rolling position.
    pub at: MeshPoint,
    /// tan μ.
    pub tan_mu: f64,
    /// dμ/dθ1. Both pitch curves are convex where −i21 < dμ/dθ1 < 1.
    pub mu_slope: f64,
    /// Arc length s rolled since θ1 = 0, mm.
    pub arc_mm: f64,
}

impl RollPoint {
    /// ds/dθ1 = r1/cos μ, mm/rad.
    #[must_use]
    #[inline]
    pub fn arc_per_rad(&self) -> f64 {
        self.at.r1_mm * (1.0 + self.tan_mu * self.tan_mu).sqrt()
    }
}

impl ToothSpec {
    pub(crate) fn check(&self) -> Result<(), GeometryError> {
        check_range("module_mm", self.module_mm, "mm", (1e-3, 1e3), "give the module of the rack")?;
        check_teeth(1, self.teeth.0)?;
        check_teeth(2, self.teeth.1)?;
        check_range(
            "pressure_angle_deg",
            self.pressure_angle_deg,
            "deg",
            (1.0, 45.0),
            "racks have 14.5, 20 or 25 deg; the angle is in degrees",
        )?;
        check_range("face_width_mm", self.face_width_mm, "mm", (1e-3, 1e5), "give the width of the teeth")?;
        check_range("addendum", self.addendum, "modules", (0.1, 2.0), "1 is the standard rack")?;
        check_range("dedendum_clearance", self.dedendum_clearance, "modules", (0.0, 1.0), "0.25 is the standard rack")?;
        // A thinning of half a pitch leaves no tooth.
        check_range(
            "backlash_mm",
            self.backlash_mm,
            "mm",
            (0.0, FRAC_PI_2 * self.module_mm),
            "more than half a pitch leaves no tooth",
        )?;
        Ok(())
    }

    pub(crate) fn pair(&self, curve: AnyCurve, centre_distance_mm: f64) -> Result<GearPair, GeometryError> {
        let (mu_rad, theta1_rad) = curve.max_inclination();
        let effective_deg = mu_rad.to_degrees() + self.pressure_angle_deg;
        if effective_deg > MAX_EFFECTIVE_PRESSURE_ANGLE_DEG {
            let limit_deg = MAX_EFFECTIVE_PRESSURE_ANGLE_DEG;
            return Err(GeometryError::FlankTooSteep { effective_deg, theta1_rad, limit_deg });
        }
        Ok(GearPair {
            curve,
            centre_distance_mm,
            module_mm: self.module_mm,
            teeth: self.teeth,
            pressure_angle_rad: self.pressure_angle_deg.to_radians(),
            pressure_angle_sin_cos: self.pressure_angle_deg.to_radians().sin_cos(),
            face_width_mm: self.face_width_mm,
            addendum: self.addendum,
            dedendum_clearance: self.dedendum_clearance,
            backlash_mm: self.backlash_mm,
            tips: SharedTips::default(),
        })
    }
}

impl GearPair {
    /// Identical elliptic gears, each about a focus: r1 = p/(1 − k cos θ1), largest at θ1 = 0.
    ///
    /// # Errors
    /// [`GeometryError`] for a number outside its range, unequal tooth numbers, or a centre distance that does not close.
    pub fn elliptical(spec: &EllipticalSpec) -> Result<Self, GeometryError> {
        spec.teeth.check()?;
        check_range(
            "eccentricity",
            spec.eccentricity,
            "",
            (0.0, crate::pitch_curve::MAX_ECCENTRICITY),
            "k is the ellipse's linear eccentricity over its semi-major axis",
        )?;
        let (teeth1, teeth2) = spec.teeth.teeth;
        if teeth1 != teeth2 {
            let needed = f64::from(teeth1);
            return Err(GeometryError::TeethRatio { kind: "elliptical", teeth1, teeth2, needed });
        }
        let ellipse = Ellipse::new(spec.eccentricity);
        // Tooth condition: perimeter = π m Z1 fixes the scale, and with it the centre distance that closes.
        let closing_mm = PI * spec.teeth.module_mm * f64::from(teeth1) / ellipse.arc(TAU);
        if let Some(given_mm) = spec.teeth.centre_distance_mm {
            check_centre_distance(given_mm, closing_mm, 1.0, (ellipse.radius_range().1, 0.0), |distance| {
                ellipse.closure_at(distance)
            })?;
        }
        spec.teeth.pair(ellipse.into(), closing_mm)
    }

    /// Circular gears.
    ///
    /// # Errors
    /// [`GeometryError`] for a number outside its range or a centre distance other than m (Z1 + Z2)/2.
    pub fn circular(spec: &CircularSpec) -> Result<Self, GeometryError> {
        spec.check()?;
        let (z1, z2) = (f64::from(spec.teeth.0), f64::from(spec.teeth.1));
        let closing_mm = 0.5 * spec.module_mm * (z1 + z2);
        let circle = Circle::new(z1, z2);
        if let Some(given_mm) = spec.centre_distance_mm {
            let radius = z1 / (z1 + z2);
            check_centre_distance(given_mm, closing_mm, z1 / z2, (radius, 0.0), |distance| {
                (distance > radius).then(|| radius / (distance - radius))
            })?;
        }
        spec.pair(circle.into(), closing_mm)
    }

    /// Any drive of constant ratio with two encoders: θ2 = θ1 / `ratio`, so that [`GearPair::ratio`] is 1/`ratio`.
    ///
    /// No teeth are known: r2 = 1 mm and α = 0 stand in, so that a length along the normal in mm is an angle of the
    /// driven shaft in rad.
    ///
    /// # Errors
    /// [`GeometryError`] when `ratio` is not finite or not positive (a reversing drive has its sign in the encoder's).
    pub fn constant(ratio: f64) -> Result<Self, GeometryError> {
        check_range(
            "ratio",
            ratio,
            "",
            (1e-6, 1e6),
            "theta2 = theta1 / ratio; a drive that reverses has its sign in the output encoder's",
        )?;
        Ok(Self {
            curve: Circle::new(1.0, ratio).into(),
            centre_distance_mm: 1.0 + 1.0 / ratio,
            module_mm: 0.0,
            teeth: (0, 0),
            pressure_angle_rad: 0.0,
            pressure_angle_sin_cos: (0.0, 1.0),
            face_width_mm: 0.0,
            addendum: 0.0,
            dedendum_clearance: 0.0,
            backlash_mm: 0.0,
            tips: SharedTips::default(),
        })
    }

    /// Kind of pair as in `pair.toml`.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        if self.has_teeth() { self.curve.kind() } else { "constant" }
    }

    /// False for [`GearPair::constant`], of which no teeth are known.
    #[must_use]
    pub fn has_teeth(&self) -> bool {
        self.teeth.0 > 0
    }

    /// Module m, mm; 0 without teeth.
    #[must_use]
    pub fn module_mm(&self) -> f64 {
        self.module_mm
    }

    /// Teeth of driver and driven gear; (0, 0) without teeth.
    #[must_use]
    pub fn teeth(&self) -> (u32, u32) {
        self.teeth
    }

    /// Pressure angle α of the rack, rad.
    #[must_use]
    pub fn pressure_angle_rad(&self) -> f64 {
        self.pressure_angle_rad
    }

    /// sin α and cos α, evaluated once.
    #[inline]
    pub(crate) fn pressure_angle_sin_cos(&self) -> (f64, f64) {
        self.pressure_angle_sin_cos
    }

    /// Face width, mm.
    #[must_use]
    pub fn face_width_mm(&self) -> f64 {
        self.face_width_mm
    }

    /// Addendum in modules.
    #[must_use]
    pub fn addendum(&self) -> f64 {
        self.addendum
    }

    /// Clearance of the dedendum, in modules.
    #[must_use]
    pub fn dedendum_clearance(&self) -> f64 {
        self.dedendum_clearance
    }

    /// Designed backlash j of both gears together along the pitch curve, mm.
    #[must_use]
    pub fn backlash_mm(&self) -> f64 {
        self.backlash_mm
    }

    /// The pitch curve, at unit centre distance.
    #[must_use]
    pub fn pitch_curve(&self) -> &AnyCurve {
        &self.curve
    }

    /// Centre distance a that closes, mm.
    #[must_use]
    pub fn centre_distance_mm(&self) -> f64 {
        self.centre_distance_mm
    }

    /// Half the sum of the driver's largest and smallest radius, mm: A of an ellipse, the radius of a circle.
    #[must_use]
    pub fn semi_major_mm(&self) -> f64 {
        let (low, high) = self.curve.radius_range();
        0.5 * (low + high) * self.centre_distance_mm
    }

    /// Perimeter of the driver's pitch curve, mm: π m Z1.
    #[must_use]
    pub fn perimeter_mm(&self) -> f64 {
        self.arc_length_mm(TAU)
    }

    /// Pitch along the pitch curve, π m, mm; `None` without teeth.
    #[must_use]
    pub fn pitch_mm(&self) -> Option<f64> {
        self.has_teeth().then_some(PI * self.module_mm)
    }

    /// Turns of the driven gear a turn of the driver.
    #[must_use]
    pub fn closure(&self) -> f64 {
        self.curve.closure()
    }

    /// f(θ1), rad: unwrapped on all reals, increasing, closed form where the curve has one.
    #[must_use]
    #[inline]
    pub fn theta2(&self, theta1_rad: f64) -> f64 {
        self.curve.theta2(theta1_rad)
    }

    /// θ1 at which f(θ1) = `theta2_rad`, rad.
    #[must_use]
    pub fn theta2_inverse(&self, theta2_rad: f64) -> f64 {
        self.curve.theta2_inverse(theta2_rad)
    }

    /// i21(θ1) = dθ2/dθ1.
    #[must_use]
    #[inline]
    pub fn ratio(&self, theta1_rad: f64) -> f64 {
        self.curve.ratio(theta1_rad)
    }

    /// Driver's radius r1(θ1), mm.
    #[must_use]
    pub fn radius(&self, theta1_rad: f64) -> f64 {
        let ratio = self.curve.ratio(theta1_rad);
        self.centre_distance_mm * ratio / (1.0 + ratio)
    }

    /// Driven gear's radius r2 = a − r1 at the same instant, mm.
    #[must_use]
    pub fn driven_radius(&self, theta1_rad: f64) -> f64 {
        self.centre_distance_mm / (1.0 + self.curve.ratio(theta1_rad))
    }

    /// Inclination μ(θ1) of the common tangent from the perpendicular of the centre line, rad: tan μ = r1'/r1.
    #[must_use]
    pub fn inclination(&self, theta1_rad: f64) -> f64 {
        self.at(theta1_rad).mu_rad
    }

    /// Where the reach of its flanks is kept once it was asked for.
    pub(crate) fn kept_tips(&self) -> &OnceLock<Arc<Tips>> {
        &self.tips.0
    }

    /// Angles, radii and inclination at θ1, evaluated once.
    #[must_use]
    #[inline]
    pub fn at(&self, theta1_rad: f64) -> MeshPoint {
        let motion = self.curve.motion(theta1_rad);
        let ratio = motion.ratio;
        let r2_mm = self.centre_distance_mm / (1.0 + ratio);
        MeshPoint {
            theta1_rad,
            theta2_rad: motion.theta2_rad,
            ratio,
            r1_mm: r2_mm * ratio,
            r2_mm,
            // r1 = a i/(1 + i), so tan μ = r1'/r1 = i'/(i (1 + i))
            mu_rad: (motion.ratio_slope / (ratio * (1.0 + ratio))).atan(),
        }
    }

    /// Kinematics, slope of the inclination and arc length at a rolling position.
    #[must_use]
    #[inline]
    pub fn roll(&self, theta1_rad: f64) -> RollPoint {
        let roll = self.curve.roll(theta1_rad);
        let ratio = roll.motion.ratio;
        let r2_mm = self.centre_distance_mm / (1.0 + ratio);
        // g = tan μ = i'/(i (1 + i)); μ' = g'/(1 + g²)
        let tan_mu = roll.tan_mu;
        let tan_mu_slope = roll.ratio_curvature / (ratio * (1.0 + ratio)) - tan_mu * tan_mu * (1.0 + 2.0 * ratio);
        RollPoint {
            at: MeshPoint {
                theta1_rad,
                theta2_rad: roll.motion.theta2_rad,
                ratio,
                r1_mm: r2_mm * ratio,
                r2_mm,
                mu_rad: roll.mu_rad,
            },
            tan_mu,
            mu_slope: tan_mu_slope / (1.0 + tan_mu * tan_mu),
            arc_mm: self.centre_distance_mm * roll.arc,
        }
    }

    /// Arc length s(θ1) of the driver's pitch curve from θ1 = 0, mm, unwrapped.
    #[must_use]
    pub fn arc_length_mm(&self, theta1_rad: f64) -> f64 {
        self.centre_distance_mm * self.curve.arc(theta1_rad)
    }

    /// Pitches rolled since θ1 = 0: s/(π m). Tooth j's ccw flank passes the pitch point at j, its cw flank at j + ½.
    /// `None` without teeth.
    #[must_use]
    pub fn tooth_phase(&self, theta1_rad: f64) -> Option<f64> {
        Some(self.arc_length_mm(theta1_rad) / self.pitch_mm()?)
    }
}

/// Passes a centre distance that a drawing may have rounded; `limit` is the largest radius (in closing distances) and
/// where it is, `closure_at` the closure sum at a distance in closing distances.
pub(crate) fn check_centre_distance(
    given_mm: f64,
    closing_mm: f64,
    closure_needed: f64,
    limit: (f64, f64),
    closure_at: impl Fn(f64) -> Option<f64>,
) -> Result<(), GeometryError> {
    check_range(
        "centre_distance_mm",
        given_mm,
        "mm",
        (f64::MIN_POSITIVE, 1e9),
        "leave it out to get the one that closes",
    )?;
    if (given_mm - closing_mm).abs() <= CENTRE_DISTANCE_ROUNDING_MM {
        return Ok(());
    }
    Err(match closure_at(given_mm / closing_mm) {
        Some(closure_sum) => {
            GeometryError::NotClosing { centre_distance_mm: given_mm, closure_sum, closure_needed, closing_mm }
        }
        None => GeometryError::NoDrivenCurve {
            centre_distance_mm: given_mm,
            radius_mm: limit.0 * closing_mm,
            theta1_rad: limit.1,
            closing_mm,
        },
    })
}
