//! Whether a rack can cut the teeth and whether they clear each other.
//!
//! TE and kinematics need none of this; drawings and cutting do. Every fault names the gear, the angle and the limit.

use std::f64::consts::TAU;

use crate::flank::Gear;
use crate::pitch_curve::{CELLS, refine};
use crate::{GearPair, GeometryError, RollPoint};

/// Narrowest tip that still has metal, in modules: below it a hardened tip breaks off.
const MIN_TIP_MODULES: f64 = 0.2;

impl GearPair {
    /// Passes a pair whose teeth a rack can cut: pitch curves convex, no undercut, no pointed tooth, and a dedendum inside the
    /// gear. A pair without teeth passes.
    ///
    /// - Undercut: rolling on a pitch curve of radius of curvature ρ, the flank's own radius at the rack's offset d is
    ///   ρ sin α ± d cos α; it reaches 0 on the rack's straight flank, of height h_a m, where ρ sin² α < h_a m.
    /// - Pointed: tip thickness at the addendum, from the circle that osculates the pitch curve.
    ///
    /// # Errors
    /// [`GeometryError`] naming gear, θ1 and limit.
    pub fn check_teeth(&self) -> Result<(), GeometryError> {
        if !self.has_teeth() {
            return Ok(());
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
                return Err(GeometryError::Concave { gear: number, theta1_rad: concave_at_rad, radius_mm });
            }
            let radius_mm = 1.0 / sharpest;
            let sin = self.pressure_angle_rad().sin();
            let limit_mm = self.addendum() * self.module_mm() / (sin * sin);
            if radius_mm < limit_mm {
                return Err(GeometryError::Undercut { gear: number, theta1_rad, radius_mm, limit_mm });
            }
            let (pointed_at_rad, thinnest) = highest(&|roll| -self.tip_thickness_mm(gear, roll));
            let limit_mm = MIN_TIP_MODULES * self.module_mm();
            if -thinnest < limit_mm {
                let (theta1_rad, thickness_mm) = (pointed_at_rad, -thinnest);
                return Err(GeometryError::Pointed { gear: number, theta1_rad, thickness_mm, limit_mm });
            }
            let (smallest_at_rad, smallest) =
                highest(&|roll| -(if gear == Gear::Driver { roll.at.r1_mm } else { roll.at.r2_mm }));
            let dedendum_mm = (self.addendum() + self.dedendum_clearance()) * self.module_mm();
            if -smallest <= dedendum_mm {
                return Err(GeometryError::NoRoot {
                    gear: number,
                    theta1_rad: smallest_at_rad,
                    radius_mm: -smallest,
                    dedendum_mm,
                });
            }
        }
        Ok(())
    }

    /// Thickness of a tooth at the addendum, mm, as cut where the pitch curve has its curvature at θ1:
    /// (ρ + h)·[t/ρ + 2 inv α − 2 inv α_a], cos α_a = ρ cos α/(ρ + h), t = π m/2 less half the backlash.
    fn tip_thickness_mm(&self, gear: Gear, roll: &RollPoint) -> f64 {
        let rho = 1.0 / self.pitch_curvature(gear, roll);
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

        let spec = EllipticalSpec { eccentricity: 0.7, teeth: (17, 17), ..Default::default() };
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
}
