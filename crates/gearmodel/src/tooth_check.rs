//! Whether a rack can cut the teeth and whether they clear each other.
//!
//! TE and kinematics need none of this; drawings and cutting do. Every fault names the gear, the angle and the limit.

use std::f64::consts::TAU;

use crate::gear::Gear;
use crate::pitch_curve::{CELLS, refine};
use crate::tip::rising;
use crate::{Direction, GearPair, GeometryError, RollPoint};

/// Narrowest tip that still has metal, in modules: below it a hardened tip breaks off.
const MIN_TIP_MODULES: f64 = 0.2;

impl GearPair {
    /// Passes a pair whose teeth a rack can cut and which clear each other: see [`GearPair::tooth_faults`].
    ///
    /// # Errors
    /// The first of the faults, naming gear, θ1 and limit.
    pub fn check_teeth(&self) -> Result<(), GeometryError> {
        self.tooth_faults().into_iter().next().map_or(Ok(()), Err)
    }

    /// Everything that is wrong with the teeth, gear by gear, each at its worst θ1 with its limit: pitch curves are to be
    /// convex, without undercut, pointed tooth or interference, and the dedendum inside the gear. A pair without teeth has no
    /// faults.
    ///
    /// - Undercut: rolling on a pitch curve of radius of curvature ρ, the flank's own radius at the rack's offset d is
    ///   ρ sin α ± d cos α; it reaches 0 on the rack's straight flank, of height h_a m, where ρ sin² α < h_a m.
    /// - Pointed: tip thickness at the addendum, from the circle that osculates the pitch curve.
    /// - Interference: the mate's tip touches at a rack offset d towards this gear's root. The flank ends at d = ρ tan α, where
    ///   its radius reaches 0, or where the rack's straight flank ends, d = h_a m/(sin α cos α).
    #[must_use]
    pub fn tooth_faults(&self) -> Vec<GeometryError> {
        let mut faults = Vec::new();
        if !self.has_teeth() {
            return faults;
        }
        // One scan serves all limits of both gears.
        let rolls: Vec<RollPoint> = (0..CELLS).map(|n| self.roll(TAU * f64::from(n) / f64::from(CELLS))).collect();
        let highest = |function: &dyn Fn(&RollPoint) -> f64| {
            let scanned = rolls.iter().map(|roll| (roll.at.theta1_rad, function(roll)));
            let (theta, value) =
                scanned.fold((0.0, f64::NEG_INFINITY), |best, cell| if cell.1 > best.1 { cell } else { best });
            refine(theta, value, |theta| function(&self.roll(theta)))
        };
        for gear in [Gear::Driver, Gear::Driven] {
            let number = gear.number();
            let (theta1_rad, sharpest) = highest(&|roll| self.pitch_curvature(gear, roll));
            let (concave_at_rad, flattest) = highest(&|roll| -self.pitch_curvature(gear, roll));
            if flattest > 1e-12 {
                let radius_mm = -1.0 / flattest;
                faults.push(GeometryError::Concave { gear: number, theta1_rad: concave_at_rad, radius_mm });
            }
            let radius_mm = 1.0 / sharpest;
            let sin = self.pressure_angle_rad().sin();
            let limit_mm = self.addendum() * self.module_mm() / (sin * sin);
            if radius_mm < limit_mm {
                faults.push(GeometryError::Undercut { gear: number, theta1_rad, radius_mm, limit_mm });
            }
            let (pointed_at_rad, thinnest) = highest(&|roll| -self.tip_thickness_mm(gear, roll));
            let limit_mm = MIN_TIP_MODULES * self.module_mm();
            if -thinnest < limit_mm {
                let (theta1_rad, thickness_mm) = (pointed_at_rad, -thinnest);
                faults.push(GeometryError::Pointed { gear: number, theta1_rad, thickness_mm, limit_mm });
            }
            let (smallest_at_rad, smallest) =
                highest(&|roll| -(if gear == Gear::Driver { roll.at.r1_mm } else { roll.at.r2_mm }));
            let dedendum_mm = (self.addendum() + self.dedendum_clearance()) * self.module_mm();
            if -smallest <= dedendum_mm {
                faults.push(GeometryError::NoRoot {
                    gear: number,
                    theta1_rad: smallest_at_rad,
                    radius_mm: -smallest,
                    dedendum_mm,
                });
            }
            faults.extend(self.interference(gear));
        }
        faults
    }

    /// Where the mate's tips reach furthest beyond the end of a gear's flanks, if they do.
    fn interference(&self, gear: Gear) -> Option<GeometryError> {
        let mate = if gear == Gear::Driver { Gear::Driven } else { Gear::Driver };
        let alpha = self.pressure_angle_rad();
        let straight_mm = self.addendum() * self.module_mm() / (alpha.sin() * alpha.cos());
        let tips = self.tips();
        // (reach over limit, θ1, reach, limit); a convex gear's tips reach less far than the rack's straight flank, but for rounding
        let mut worst = (1.0 + 1e-9, 0.0, 0.0, 0.0);
        for side in Direction::BOTH {
            for (tooth, reach_mm) in (0_i64..).zip(tips.reaches_mm(mate, side)) {
                // The mate's tip is at this gear's foot: before the pitch point where its flank is met root first.
                let origin_mm = self.flank_origin_mm(gear, tooth, side);
                let theta1_rad = self.theta1_at_arc_length(origin_mm - rising(gear, side) * reach_mm);
                let curvature = self.pitch_curvature(gear, &self.roll(theta1_rad));
                let limit_mm = if curvature > 0.0 { straight_mm.min(alpha.tan() / curvature) } else { straight_mm };
                if reach_mm / limit_mm > worst.0 {
                    worst = (reach_mm / limit_mm, theta1_rad, *reach_mm, limit_mm);
                }
            }
        }
        let (_, theta1_rad, reach_mm, limit_mm) = worst;
        let (gear, mate) = (gear.number(), mate.number());
        (limit_mm > 0.0).then_some(GeometryError::Interference { gear, mate, theta1_rad, reach_mm, limit_mm })
    }

    /// Thickness of a tooth at the addendum, mm, as cut where the pitch curve has its curvature at θ1:
    /// (ρ + h)·[t/ρ + 2 inv α − 2 inv α_a], cos α_a = ρ cos α/(ρ + h), t = π m/2 less half the backlash.
    fn tip_thickness_mm(&self, gear: Gear, roll: &RollPoint) -> f64 {
        let curvature = self.pitch_curvature(gear, roll);
        if curvature <= 0.0 {
            // Where the pitch curve is concave the flanks do not meet; that it is concave is a fault of its own.
            return f64::INFINITY;
        }
        let rho = 1.0 / curvature;
        let height = self.addendum() * self.module_mm();
        let thickness = 0.25 * TAU * self.module_mm() - 0.5 * self.backlash_mm();
        let alpha = self.pressure_angle_rad();
        let tip = rho + height;
        let alpha_tip = (rho * alpha.cos() / tip).acos();
        let involute = |angle: f64| angle.tan() - angle;
        tip * (thickness / rho + 2.0 * involute(alpha) - 2.0 * involute(alpha_tip))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CircularSpec, CurveSpec, EllipticalSpec, ToothSpec};

    #[test]
    fn the_source_pair_can_be_cut() {
        let pair = GearPair::elliptical(&EllipticalSpec::default()).unwrap();
        pair.check_teeth().unwrap();
        // ρ_min of an ellipse is p, at the ends of the major axis.
        assert!((pair.curvature_radius_mm(Gear::Driver, 0.0) - 64.666_706).abs() < 1e-5);
        assert!((pair.curvature_radius_mm(Gear::Driven, 0.0) - 64.666_706).abs() < 1e-5);
        GearPair::constant(3.0).unwrap().check_teeth().unwrap();
    }

    #[test]
    fn faults_name_gear_angle_and_limit() {
        // Z ≥ 2/sin² α = 17.1
        GearPair::circular(&CircularSpec { teeth: (18, 40), ..Default::default() }).unwrap().check_teeth().unwrap();
        let pair = GearPair::circular(&CircularSpec { teeth: (40, 17), ..Default::default() }).unwrap();
        assert!(matches!(pair.check_teeth(), Err(GeometryError::Undercut { gear: 2, .. })));

        let spec = EllipticalSpec { eccentricity: 0.7, teeth: ToothSpec { teeth: (17, 17), ..Default::default() } };
        let error = GearPair::elliptical(&spec).unwrap().check_teeth().unwrap_err();
        let GeometryError::Undercut { theta1_rad, radius_mm, limit_mm, .. } = error else { panic!("{error:?}") };
        assert!((theta1_rad.sin()).abs() < 1e-6 && radius_mm < limit_mm);
        assert!((limit_mm - 3.0 / 20.0_f64.to_radians().sin().powi(2)).abs() < 1e-9);

        // Three lobes are convex up to k = 1/(3² − 1).
        for (k, concave) in [(0.1, false), (0.3, true)] {
            let curve = CurveSpec::Lobed { eccentricity: k, lobes: (3, 3) };
            let teeth = ToothSpec { teeth: (72, 72), ..Default::default() };
            let fault = GearPair::free(&teeth, &curve).unwrap().check_teeth();
            assert_eq!(matches!(fault, Err(GeometryError::Concave { .. })), concave, "{fault:?}");
        }

        let tall = CircularSpec { teeth: (20, 60), addendum: 1.0, pressure_angle_deg: 35.0, ..Default::default() };
        let fault = GearPair::circular(&tall).unwrap().check_teeth();
        assert!(matches!(fault, Err(GeometryError::Pointed { gear: 1, .. })), "{fault:?}");
    }
    #[test]
    fn interference_begins_where_the_textbook_has_it() {
        // Largest gear that runs with a pinion of 13 to 16 full-depth teeth of 20 deg without interference (Shigley, Mechanical
        // Engineering Design, spur gears): Z2 <= (Z1² sin² α − 4)/(4 − 2 Z1 sin² α).
        let interferes = |teeth: (u32, u32)| {
            let pair = GearPair::circular(&CircularSpec { teeth, ..Default::default() }).unwrap();
            let faults = pair.tooth_faults();
            let found = faults.iter().find(|fault| matches!(fault, GeometryError::Interference { .. })).cloned();
            // Such a pinion is undercut besides: both are told.
            assert!(faults.iter().any(|fault| matches!(fault, GeometryError::Undercut { .. })));
            found
        };
        for (pinion, largest) in [(13, 16), (14, 26), (15, 45), (16, 101)] {
            assert_eq!(interferes((pinion, largest)), None);
            let Some(fault) = interferes((pinion, largest + 1)) else { panic!("{pinion}") };
            let GeometryError::Interference { gear, mate, reach_mm, limit_mm, .. } = fault else { panic!("{fault:?}") };
            assert!((gear, mate) == (1, 2) && reach_mm > limit_mm);
            // At the limit the line of action ends where it touches the pinion's base circle: ρ tan α.
            assert!((limit_mm - 1.5 * f64::from(pinion) * 20.0_f64.to_radians().tan()).abs() < 1e-9);
            let mirrored = interferes((largest + 1, pinion));
            assert!(matches!(mirrored, Some(GeometryError::Interference { gear: 2, mate: 1, .. })));
        }
    }

    #[test]
    fn all_faults_are_told_and_the_first_is_the_error() {
        let spec = EllipticalSpec {
            eccentricity: 0.7,
            teeth: ToothSpec { teeth: (17, 17), addendum: 1.3, ..Default::default() },
        };
        let pair = GearPair::elliptical(&spec).unwrap();
        let faults = pair.tooth_faults();
        assert_eq!(pair.check_teeth().err().as_ref(), faults.first());
        for gear in [1, 2] {
            assert!(faults.iter().any(|fault| matches!(fault, GeometryError::Undercut { gear: g, .. } if *g == gear)));
            assert!(faults.iter().any(|fault| matches!(fault, GeometryError::Pointed { gear: g, .. } if *g == gear)));
            let interference =
                |fault: &GeometryError| matches!(fault, GeometryError::Interference { gear: g, .. } if *g == gear);
            assert!(faults.iter().any(interference), "{faults:?}");
        }
        assert!(GearPair::elliptical(&EllipticalSpec::default()).unwrap().tooth_faults().is_empty());
    }
}
