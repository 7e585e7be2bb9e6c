//! Exact contact of rigid tooth pairs: TE without linearising the errors.
//!
//! Each flank is described by the angle χ of its outward normal and its support function h (distance of its tangent from
//! the gear's axis). From rack generation at the rolling position θ, with β = ±(π/2 − α) + μ the normal's angle in the
//! fixed frame, upper sign ccw:
//!
//! | | gear 1 | gear 2 |
//! |---|---|---|
//! | χ in the body | β − θ | β + f(θ) |
//! | h | r1 cos β ± d cos α | −r2 cos β ± d cos α |
//! | t = dh/dχ | −r1 sin β | r2 sin β |
//!
//! Two bodies touch where their normals, supports and tangential positions agree. With W the vector from gear 2's to gear
//! 1's displaced body origin, n the common normal and n⊥ its left normal, the tooth pair (θ_a on gear 1, θ_b on gear 2)
//! satisfies
//!
//! h1(θ_a) − h2(θ_b) + W·n + ε = 0,  t1(θ_a) − t2(θ_b) + W·n⊥ = 0,  ψ2 = χ2(θ_b) − χ1(θ_a) − ψ1,
//!
//! solved by Newton from the nominal position. The tooth's number cancels in d: without tooth errors ε every pair in
//! contact gives the same ψ2. ψ2 of the running pair is the largest over the pairs in the contact zone when driving ccw,
//! the smallest when driving cw.
//!
//! Where the lead ε changes along the flank, the flanks touch not at the nominal point but where ε reaches furthest over the
//! opening gap: ε is replaced by max over u' of ε(u') − q (u' − u)², q the relative curvature of the two flanks.

mod curve;
mod error;
mod series;
mod solve;
mod tooth_errors;
mod zone;

pub use error::ContactError;
pub use tooth_errors::{Profile, ToothDamage, ToothErrors};

use std::sync::Arc;

use solve::{Displacement, Touch};

use crate::geometry_error::check_range;
use crate::increment::common_normal;
use crate::tip_reach::Tips;
use crate::{Direction, Errors, GearPair, GeometryError};

/// The contact that carries at one driver angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// TE = ψ2 − f(θ1), rad.
    pub te_rad: f64,
    /// Tooth of the driver that carries, counted on over the turns: tooth 0 passes the pitch point at θ1 = 0.
    pub tooth: i64,
    /// Where on the tooth, in pitches of rolling from the pitch point.
    pub phase: f64,
    /// Tooth pairs within their tips, whether they carry or not.
    pub pairs_in_zone: u32,
}

/// A tooth pair within its tips, as if it alone touched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairTouch {
    /// Driven angle, rad.
    pub(crate) psi2_rad: f64,
    /// Tooth of the driver.
    pub(crate) tooth: i64,
    /// Phase in pitches from the pitch point.
    pub(crate) phase: f64,
}

/// A pair of rigid gears with displaced axes, ready for exact contact.
#[derive(Clone, Debug)]
pub struct ContactModel {
    pair: GearPair,
    displacement: Displacement,
    teeth: ToothErrors,
    tips: Arc<Tips>,
}

impl ContactModel {
    /// A pair with the eccentricities of `errors` (compliances play no part: the gears are rigid).
    ///
    /// # Errors
    /// [`GeometryError`] when an error is out of range.
    pub fn new(pair: GearPair, errors: &Errors) -> Result<Self, GeometryError> {
        errors.check()?;
        let tips = pair.tips();
        Ok(Self { displacement: Displacement::new(errors), teeth: ToothErrors::default(), tips, pair })
    }

    /// The same with gear 1's axis displaced by (`dx_mm`, `dy_mm`) against gear 2's, constant in the fixed frame; a centre
    /// distance grown by Δa is (−Δa, 0).
    ///
    /// # Errors
    /// [`GeometryError`] when the displacement is not finite or beyond the module.
    pub fn with_displacement(mut self, dx_mm: f64, dy_mm: f64) -> Result<Self, GeometryError> {
        let limit = self.pair.module_mm().max(1.0);
        for (quantity, value) in [("dx_mm", dx_mm), ("dy_mm", dy_mm)] {
            let advice = "teeth of this module do not reach further";
            check_range(quantity, value, "mm", (-limit, limit), advice)?;
        }
        self.displacement.delta_mm = [dx_mm, dy_mm];
        Ok(self)
    }

    /// The same with errors of single teeth.
    ///
    /// # Errors
    /// [`GeometryError`] when a table does not have a value a tooth, or a value is out of range.
    pub fn with_tooth_errors(mut self, teeth: ToothErrors) -> Result<Self, GeometryError> {
        teeth.check(&self.pair)?;
        self.teeth = teeth;
        Ok(self)
    }

    /// The pair.
    #[must_use]
    pub fn pair(&self) -> &GearPair {
        &self.pair
    }

    /// TE at θ1, rad, designed backlash included.
    ///
    /// # Errors
    /// [`ContactError`] when no teeth touch there.
    pub fn te_rad(&self, theta1_rad: f64, direction: Direction) -> Result<f64, ContactError> {
        self.contact(theta1_rad, direction).map(|contact| contact.te_rad)
    }

    /// Backlash at θ1, rad at the driven shaft: TE_cw − TE_ccw.
    ///
    /// # Errors
    /// [`ContactError`] when no teeth touch there in one of the senses.
    pub fn backlash_rad(&self, theta1_rad: f64) -> Result<f64, ContactError> {
        Ok(self.te_rad(theta1_rad, Direction::Cw)? - self.te_rad(theta1_rad, Direction::Ccw)?)
    }

    /// The contact that carries at θ1.
    ///
    /// # Errors
    /// [`ContactError`] when no teeth touch there.
    pub fn contact(&self, theta1_rad: f64, direction: Direction) -> Result<Contact, ContactError> {
        let mut carrying: Option<PairTouch> = None;
        let mut pairs_in_zone = 0;
        self.for_each_pair(theta1_rad, direction, |pair| {
            pairs_in_zone += 1;
            // The most advanced in the sense of motion carries; of equals the one nearest to the pitch point.
            let ahead = |other: PairTouch| {
                let lead_rad = direction.sign() * (pair.psi2_rad - other.psi2_rad);
                lead_rad > 0.0 || (lead_rad == 0.0 && pair.phase.abs() < other.phase.abs())
            };
            if carrying.is_none_or(ahead) {
                carrying = Some(pair);
            }
        })?;
        let PairTouch { psi2_rad, tooth, phase } =
            carrying.ok_or(ContactError::NoPairInZone { theta1_rad, direction })?;
        Ok(Contact { te_rad: psi2_rad - self.pair.theta2(theta1_rad), tooth, phase, pairs_in_zone })
    }

    /// Visits every tooth pair within its tips, with the driven angle at which it alone would touch.
    pub(crate) fn for_each_pair(
        &self,
        theta1_rad: f64,
        direction: Direction,
        mut visit: impl FnMut(PairTouch),
    ) -> Result<(), ContactError> {
        if !self.pair.has_teeth() {
            return Err(ContactError::NoTeeth);
        }
        if !theta1_rad.is_finite() {
            return Err(ContactError::NotFinite { theta1_rad });
        }
        let shared = solve::touch(&self.pair, &self.displacement, theta1_rad, direction, 0.0, None)?;
        for tooth in self.tips.candidates(&shared) {
            let Some(phase) = self.tips.phase_in_zone(&shared, tooth) else { continue };
            let lead_mm = self.lead_mm(&shared, tooth, phase);
            let psi2_rad = if lead_mm == 0.0 {
                shared.psi2_rad
            } else {
                let start = Some(shared.theta_with_lead_rad(lead_mm));
                solve::touch(&self.pair, &self.displacement, theta1_rad, direction, lead_mm, start)?.psi2_rad
            };
            visit(PairTouch { psi2_rad, tooth, phase });
        }
        Ok(())
    }

    /// TE at θ1 to first order, rad: the increment of eccentricities, displacement and designed backlash along the common
    /// normal plus the lead of the most advanced tooth pair in the nominal contact zone over the driven base arm; tips
    /// are taken at their nominal position. [`GearPair::first_order_limit_mm`] says how far this holds.
    ///
    /// # Errors
    /// [`ContactError::NoTeeth`] or [`ContactError::NoPairInZone`].
    pub fn first_order_te_rad(&self, theta1_rad: f64, direction: Direction) -> Result<f64, ContactError> {
        if !self.pair.has_teeth() {
            return Err(ContactError::NoTeeth);
        }
        if !theta1_rad.is_finite() {
            return Err(ContactError::NotFinite { theta1_rad });
        }
        let perfect = Displacement::default();
        let nominal = solve::touch(&self.pair, &perfect, theta1_rad, direction, 0.0, None)?;
        let sign = direction.sign();
        let lead_mm = self
            .tips
            .candidates(&nominal)
            .filter_map(|tooth| {
                let phase = self.tips.phase_in_zone(&nominal, tooth)?;
                Some(sign * self.lead_mm(&nominal, tooth, phase))
            })
            .max_by(f64::total_cmp)
            .ok_or(ContactError::NoPairInZone { theta1_rad, direction })?;
        let at = self.pair.at(theta1_rad);
        let [dx_mm, dy_mm] = self.displacement.delta_mm;
        Ok(common_normal::te_rad(&self.pair, &self.displacement.errors(), theta1_rad, direction)
            + common_normal::displacement_te_rad(&self.pair, &at, (dx_mm, dy_mm), direction)
            + sign * lead_mm / common_normal::driven_base_arm_mm(&self.pair, &at, direction))
    }

    /// Contact ratio of a driver tooth's flank: the pitches of rolling between the tips of both gears.
    #[must_use]
    pub fn contact_ratio(&self, tooth: u32, direction: Direction) -> f64 {
        self.tips.contact_ratio(i64::from(tooth), direction)
    }

    /// Lead of a tooth pair at its contact, mm along the normal.
    fn lead_mm(&self, touch: &Touch, tooth: i64, phase: f64) -> f64 {
        let direction = touch.direction;
        let constant_mm = self.teeth.pitch_lead_mm(tooth, direction);
        let (z1, _) = self.pair.teeth();
        if !self.teeth.has_shape(tooth, z1, direction) {
            return constant_mm;
        }
        let pitch_mm = self.tips.pitch_mm;
        let half = if direction == Direction::Ccw { 0.0 } else { 0.5 };
        let shift_mm = (tooth as f64 + half) * pitch_mm;
        let opening_mm = touch.opening_per_mm(shift_mm, self.pair.pressure_angle_rad().cos()) * pitch_mm * pitch_mm;
        let sign = direction.sign();
        let shape = |at: f64| sign * self.teeth.shape_lead_mm(tooth, z1, at, direction);
        constant_mm + sign * furthest(shape, phase, opening_mm)
    }
}

/// max over u' of `lead`(u') − `opening` (u' − u)²: where the flanks really touch, mm.
fn furthest(lead: impl Fn(f64) -> f64, phase: f64, opening: f64) -> f64 {
    let here = lead(phase);
    if opening.is_nan() || opening <= 0.0 {
        // Flanks that do not open from their contact (a concave flank on one of equal curvature) have no unique point.
        return here;
    }
    let reach_over = |at: f64| lead(at) - opening * (at - phase) * (at - phase);
    // Coarse search over the teeth's own extent, then a parabola through the best point and its neighbours.
    const HALF_STEPS: i32 = 48;
    let step = 1.0 / f64::from(HALF_STEPS);
    let (mut best, mut value) = (phase, here);
    for n in -HALF_STEPS..=HALF_STEPS {
        let at = phase + f64::from(n) * step;
        let there = reach_over(at);
        if there > value {
            (best, value) = (at, there);
        }
    }
    let mut width = step;
    for _ in 0..40 {
        let (below, above) = (reach_over(best - width), reach_over(best + width));
        let bend = below - 2.0 * value + above;
        let shift = if bend < 0.0 { (0.5 * width * (below - above) / bend).clamp(-width, width) } else { 0.0 };
        let there = reach_over(best + shift);
        if there > value {
            (best, value) = (best + shift, there);
        }
        width *= 0.5;
        if width < 1e-7 {
            break;
        }
    }
    value
}
