//! The contact equations and their Newton iteration.

use std::f64::consts::FRAC_PI_2;

use super::error::ContactError;
use crate::{Direction, Errors, GearPair, RollPoint};

/// Displacements of the gears' bodies from their shafts' ideal axes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Displacement {
    e1_mm: f64,
    phi1_rad: f64,
    e2_mm: f64,
    phi2_rad: f64,
    /// Displacement of gear 1's axis relative to gear 2's.
    pub(super) delta_mm: [f64; 2],
}

impl Displacement {
    pub(super) fn new(errors: &Errors) -> Self {
        Self {
            e1_mm: errors.e1_mm,
            phi1_rad: errors.phi1_rad,
            e2_mm: errors.e2_mm,
            phi2_rad: errors.phi2_rad,
            delta_mm: [0.0, 0.0],
        }
    }

    /// The eccentricities as documented errors of rigid gears.
    pub(super) fn errors(&self) -> Errors {
        Errors {
            e1_mm: self.e1_mm,
            phi1_rad: self.phi1_rad,
            e2_mm: self.e2_mm,
            phi2_rad: self.phi2_rad,
            ..Errors::default()
        }
    }
}

/// A solved contact of the two flanks' families, whichever tooth pair carries it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Driven angle ψ2, rad.
    pub(super) psi2_rad: f64,
    /// Arc length at the rolling position of gear 1's contact point, mm.
    pub(super) arc_a_mm: f64,
    /// Arc length at the rolling position of gear 2's contact point, mm.
    pub(super) arc_b_mm: f64,
    /// Flank.
    pub(super) direction: Direction,
    /// Rolling positions of the contact point on both gears, rad.
    theta_rad: (f64, f64),
    /// How the rolling positions move with the lead of gear 1's flank, rad/mm.
    theta_per_lead: (f64, f64),
    /// How ψ2 moves with the lead, rad/mm.
    pub(super) psi2_per_lead: f64,
    /// What the curvature of both flanks needs beside the tooth's own offset.
    bend: Bend,
}

/// Supports of the two flanks of tooth 0 at a contact, (gear 1, gear 2), as their curvature needs them.
#[derive(Clone, Copy, Debug)]
struct Bend {
    h_mm: (f64, f64),
    chi_slope: (f64, f64),
    t_slope_mm: (f64, f64),
    /// ds/dθ at gear 1's contact point, mm/rad.
    arc_per_rad: f64,
}

impl Touch {
    /// Rolling positions of the contact point on gear 1 and gear 2, rad.
    pub(super) fn theta_rad(&self) -> (f64, f64) {
        self.theta_rad
    }

    /// Arc length on the gear whose tip ends the contact on the side of smaller θ1, mm.
    pub(super) fn begins_mm(&self) -> f64 {
        if self.direction == Direction::Ccw { self.arc_b_mm } else { self.arc_a_mm }
    }

    /// Arc length on the gear whose tip ends the contact on the side of larger θ1, mm.
    pub(super) fn ends_mm(&self) -> f64 {
        if self.direction == Direction::Ccw { self.arc_a_mm } else { self.arc_b_mm }
    }

    /// Rolling positions of the contact when gear 1's flank leads by `lead_mm`, rad, to first order.
    pub(super) fn theta_with_lead_rad(&self, lead_mm: f64) -> (f64, f64) {
        (self.theta_rad.0 + self.theta_per_lead.0 * lead_mm, self.theta_rad.1 + self.theta_per_lead.1 * lead_mm)
    }

    /// Coefficient q of the gap q·Δs² that opens between two touching flanks of a tooth, Δs mm of rolling from their contact
    /// on gear 1's flank, 1/mm; `shift_mm` is the tooth's own offset along the rack, j·π m.
    pub(super) fn opening_per_mm(&self, shift_mm: f64, cos_alpha: f64) -> f64 {
        let shift = self.direction.sign() * shift_mm * cos_alpha;
        let bend = &self.bend;
        // Flank length is (h + h'') dχ = (h χ' + t') dθ; the gap is (1/ρ1 + 1/ρ2)/2 times its square. Gear 2's flank has the
        // opposite outward normal. Written without ρ, which is infinite where a pitch curve has an inflection.
        let length_a = (bend.h_mm.0 - shift) * bend.chi_slope.0 + bend.t_slope_mm.0;
        let length_b = (bend.h_mm.1 - shift) * bend.chi_slope.1 + bend.t_slope_mm.1;
        let curvature = bend.chi_slope.0 / length_a - bend.chi_slope.1 / length_b;
        let length = length_a / bend.arc_per_rad;
        0.5 * length * length * curvature
    }
}

/// One flank's support function at a rolling position.
struct Support {
    /// Angle χ of the normal in the body, rad.
    chi_rad: f64,
    /// dχ/dθ.
    chi_slope: f64,
    /// h without the tooth's own offset ∓ j π m cos α, mm.
    h_mm: f64,
    /// t = dh/dχ, mm.
    t_mm: f64,
    /// dt/dθ, mm/rad.
    t_slope_mm: f64,
}

/// sin and cos of β = ±(π/2 − α) + μ from those of α and μ.
#[inline]
fn normal_angle(roll: &RollPoint, (sin_alpha, cos_alpha): (f64, f64), sign: f64) -> (f64, f64) {
    // cos μ > 0
    let cos_mu = 1.0 / (1.0 + roll.tan_mu * roll.tan_mu).sqrt();
    let sin_mu = roll.tan_mu * cos_mu;
    // sin(±(π/2 − α)) = ± cos α, cos(±(π/2 − α)) = sin α
    (sign * cos_alpha * cos_mu + sin_alpha * sin_mu, sin_alpha * cos_mu - sign * cos_alpha * sin_mu)
}

#[inline]
fn driver_support(roll: &RollPoint, alpha: (f64, f64), offset_rad: f64, sign: f64) -> Support {
    let (sin, cos) = normal_angle(roll, alpha, sign);
    let r1_mm = roll.at.r1_mm;
    Support {
        chi_rad: offset_rad + roll.at.mu_rad - roll.at.theta1_rad,
        chi_slope: roll.mu_slope - 1.0,
        h_mm: r1_mm * cos + sign * alpha.1 * roll.arc_mm,
        t_mm: -r1_mm * sin,
        t_slope_mm: -r1_mm * (roll.tan_mu * sin + cos * roll.mu_slope),
    }
}

#[inline]
fn driven_support(roll: &RollPoint, alpha: (f64, f64), offset_rad: f64, sign: f64) -> Support {
    let (sin, cos) = normal_angle(roll, alpha, sign);
    let (r1_mm, r2_mm) = (roll.at.r1_mm, roll.at.r2_mm);
    Support {
        chi_rad: offset_rad + roll.at.mu_rad + roll.at.theta2_rad,
        chi_slope: roll.mu_slope + roll.at.ratio,
        h_mm: -r2_mm * cos + sign * alpha.1 * roll.arc_mm,
        t_mm: r2_mm * sin,
        t_slope_mm: -r1_mm * roll.tan_mu * sin + r2_mm * cos * roll.mu_slope,
    }
}

/// Newton steps allowed; three reach rounding for displacements of a tenth of a millimetre.
const MAX_STEPS: u32 = 40;
/// A step this short is the last, and is taken along the tangents: what they miss is of its square, below 1e-12 rad.
const LAST_STEP_RAD: f64 = 5e-8;

/// Finds the contact of the flanks of one side at the driver angle `psi1_rad`, gear 1's flank carrying `lead_mm` along the
/// normal (positive: driven gear ahead), from the rolling positions `start_rad` where they are known already.
pub(super) fn touch(
    pair: &GearPair,
    displacement: &Displacement,
    psi1_rad: f64,
    direction: Direction,
    lead_mm: f64,
    start_rad: Option<(f64, f64)>,
) -> Result<Touch, ContactError> {
    let sign = direction.sign();
    let alpha = pair.pressure_angle_sin_cos();
    let offset_rad = sign * (FRAC_PI_2 - pair.pressure_angle_rad());
    // Material along gear 1's normal. Both gears together are thinned by j along the pitch curve: each flank gives way by
    // j/2 · cos α. A lead in the sense of +θ2 is material on the ccw flank and missing material on the cw flank.
    let material_mm = sign * lead_mm - 0.5 * pair.backlash_mm() * alpha.1;

    let (mut theta_a, mut theta_b) = start_rad.unwrap_or((psi1_rad, psi1_rad));
    let mut roll_a = pair.roll(theta_a);
    // From the nominal position both gears roll at one angle, and the first evaluation serves both.
    let mut roll_b = if start_rad.is_some() { pair.roll(theta_b) } else { roll_a };
    let (sin_u, cos_u) = (psi1_rad + displacement.phi1_rad).sin_cos();
    let mut residual_mm = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let a = driver_support(&roll_a, alpha, offset_rad, sign);
        let b = driven_support(&roll_b, alpha, offset_rad, sign);
        let chi_rad = a.chi_rad + psi1_rad;
        let psi2_rad = b.chi_rad - chi_rad;
        let (sin_chi, cos_chi) = chi_rad.sin_cos();
        let (sin_v, cos_v) = (psi2_rad + displacement.phi2_rad).sin_cos();
        // W = E1 + δ − O2 − E2, E2 = e2 (cos v, −sin v); W' = dW/dψ2
        let w = [
            displacement.e1_mm * cos_u + displacement.delta_mm[0]
                - pair.centre_distance_mm()
                - displacement.e2_mm * cos_v,
            displacement.e1_mm * sin_u + displacement.delta_mm[1] + displacement.e2_mm * sin_v,
        ];
        let w_slope = [displacement.e2_mm * sin_v, displacement.e2_mm * cos_v];
        let w_normal = w[0] * cos_chi + w[1] * sin_chi;
        let w_across = -w[0] * sin_chi + w[1] * cos_chi;
        let slope_normal = w_slope[0] * cos_chi + w_slope[1] * sin_chi;
        let slope_across = -w_slope[0] * sin_chi + w_slope[1] * cos_chi;

        let gap_mm = a.h_mm - b.h_mm + w_normal + material_mm;
        let slip_mm = a.t_mm - b.t_mm + w_across;
        // χ = χ1(θ_a) + ψ1, ψ2 = χ2(θ_b) − χ
        let gap_a = a.chi_slope * (a.t_mm + w_across - slope_normal);
        let gap_b = b.chi_slope * (slope_normal - b.t_mm);
        let slip_a = a.t_slope_mm - a.chi_slope * (w_normal + slope_across);
        let slip_b = b.chi_slope * slope_across - b.t_slope_mm;
        let determinant = gap_a * slip_b - gap_b * slip_a;

        residual_mm = gap_mm.abs().max(slip_mm.abs());
        let step_a = (gap_b * slip_mm - slip_b * gap_mm) / determinant;
        let step_b = (slip_a * gap_mm - gap_a * slip_mm) / determinant;
        if !(step_a.is_finite() && step_b.is_finite()) {
            break;
        }
        if step_a.abs().max(step_b.abs()) <= LAST_STEP_RAD {
            let (theta_a, theta_b) = (theta_a + step_a, theta_b + step_b);
            let (arc_per_rad, arc_b_per_rad) = (roll_a.arc_per_rad(), roll_b.arc_per_rad());
            let theta_per_lead = (-sign * slip_b / determinant, sign * slip_a / determinant);
            return Ok(Touch {
                psi2_rad: psi2_rad + b.chi_slope * step_b - a.chi_slope * step_a,
                arc_a_mm: roll_a.arc_mm + arc_per_rad * step_a,
                arc_b_mm: roll_b.arc_mm + arc_b_per_rad * step_b,
                direction,
                theta_rad: (theta_a, theta_b),
                theta_per_lead,
                psi2_per_lead: b.chi_slope * theta_per_lead.1 - a.chi_slope * theta_per_lead.0,
                bend: Bend {
                    h_mm: (a.h_mm, b.h_mm),
                    chi_slope: (a.chi_slope, b.chi_slope),
                    t_slope_mm: (a.t_slope_mm, b.t_slope_mm),
                    arc_per_rad,
                },
            });
        }
        // Half a radian of rolling is beyond any tooth: a longer step has left the region of convergence.
        theta_a += step_a.clamp(-0.5, 0.5);
        theta_b += step_b.clamp(-0.5, 0.5);
        roll_a = pair.roll(theta_a);
        roll_b = pair.roll(theta_b);
    }
    Err(ContactError::NotConverged { theta1_rad: psi1_rad, direction, residual_mm })
}
