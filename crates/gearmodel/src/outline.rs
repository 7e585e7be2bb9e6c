//! Outlines of the gears: flanks, tips, root fillets, and their export.
//!
//! The rack's flank is straight down to the addendum of the mate; its corner of radius ρ_f touches flank and tip line, so
//! that the clearance c m = ρ_f (1 − sin α) as in the standard rack. Rolling, the corner's centre C stands at
//! (d ± q, ∓(h_a m − ρ_f sin α)), q = h_a m tan α + ρ_f cos α, from the pitch point P, and cuts the fillet (a trochoid's
//! parallel) at C + ρ_f (C − P)/|C − P|.

use std::fmt::Write as _;

use crate::gear::Gear;
use crate::tip::{Tip, rising};
use crate::{Direction, GearPair, GeometryError};

/// A closed outline of a gear in its own body: the axis at the origin, at θ = 0 as in the fixed frame, counter-clockwise,
/// the first point not repeated at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Points, mm.
    pub points_mm: Vec<[f64; 2]>,
}

/// Fewest and most points a tooth of an outline.
const POINTS_PER_TOOTH: (usize, usize) = (12, 100_000);

impl GearPair {
    /// A tooth's working flank in its gear's body from where the rack's straight flank ends to the tip, `count` points, mm. The
    /// side names the driver's sense in which the flank carries; tooth and tooth space number as in [`crate::contact`].
    ///
    /// # Errors
    /// [`GeometryError`] for a count outside 2 to 100 000, a tooth that the gear does not have, or teeth that cannot be cut.
    pub fn flank(&self, gear: Gear, tooth: u32, side: Direction, count: usize) -> Result<Vec<[f64; 2]>, GeometryError> {
        let (lower, upper) = (2, POINTS_PER_TOOTH.1);
        if !(lower..=upper).contains(&count) {
            return Err(GeometryError::Length { quantity: "points of a flank", given: count, lower, upper });
        }
        let teeth = self.teeth_of(gear);
        if tooth >= teeth {
            return Err(GeometryError::NoSuchTooth { tooth, teeth });
        }
        self.check_teeth()?;
        let tip = self.tip_of(gear, i64::from(tooth), side);
        Ok(self.flank_points(gear, i64::from(tooth), side, &tip, count))
    }

    /// The closed outline of a gear as its rack cuts it, `points_per_tooth` points a tooth.
    ///
    /// # Errors
    /// [`GeometryError`] when the teeth cannot be cut (see [`GearPair::check_teeth`]) or the number of points is outside 12 to
    /// 100 000.
    pub fn outline(&self, gear: Gear, points_per_tooth: usize) -> Result<Outline, GeometryError> {
        let (lower, upper) = POINTS_PER_TOOTH;
        if !(lower..=upper).contains(&points_per_tooth) {
            return Err(GeometryError::Length { quantity: "points per tooth", given: points_per_tooth, lower, upper });
        }
        let teeth = self.teeth_of(gear);
        if teeth == 0 {
            return Err(GeometryError::NoTeeth);
        }
        self.check_teeth()?;
        // Flanks and fillets curve most.
        let land = (points_per_tooth / 10).max(2);
        let fillet = (points_per_tooth / 6).max(2);
        let flank = (points_per_tooth - 2 * land - 2 * fillet) / 2;
        // As θ1 grows a gear's flanks pass root first on one side, then tip first on the other.
        let (first, second) = match gear {
            Gear::Driver => (Direction::Ccw, Direction::Cw),
            Gear::Driven => (Direction::Cw, Direction::Ccw),
        };
        let second_shift = i64::from(gear == Gear::Driven);
        let mut points_mm = Vec::with_capacity(points_per_tooth * teeth as usize);
        for tooth in 0..i64::from(teeth) {
            let tips = (self.tip_of(gear, tooth, first), self.tip_of(gear, tooth + second_shift, second));
            points_mm.extend(self.fillet_points(gear, tooth, first, fillet));
            points_mm.extend(self.flank_points(gear, tooth, first, &tips.0, flank));
            points_mm.extend(self.offset_points(gear, (tips.0.foot_rad, tips.1.foot_rad), self.addendum(), land));
            let mut falling = self.flank_points(gear, tooth + second_shift, second, &tips.1, flank);
            falling.reverse();
            points_mm.append(&mut falling);
            let mut falling = self.fillet_points(gear, tooth + second_shift, second, fillet);
            falling.reverse();
            points_mm.append(&mut falling);
            let this_root = self.fillet_end_rad(gear, tooth + second_shift, second);
            let next_root = self.fillet_end_rad(gear, tooth + 1, first);
            let depth = -(self.addendum() + self.clearance_cut_mm() / self.module_mm());
            points_mm.extend(self.offset_points(gear, (this_root, next_root), depth, land));
        }
        let mut outline = Outline { points_mm };
        if outline.signed_area_mm2() < 0.0 {
            outline.points_mm.reverse();
        }
        Ok(outline)
    }

    fn teeth_of(&self, gear: Gear) -> u32 {
        match gear {
            Gear::Driver => self.teeth().0,
            Gear::Driven => self.teeth().1,
        }
    }

    /// Radius of the rack's corner, mm: tangent to flank and tip line, or the full round that still fits the rack's tooth.
    fn corner_radius_mm(&self) -> f64 {
        let (sin, cos) = self.pressure_angle_rad().sin_cos();
        let module_mm = self.module_mm();
        let standard = self.dedendum_clearance() * module_mm / (1.0 - sin);
        let half_tip = std::f64::consts::FRAC_PI_4 * module_mm + 0.25 * self.backlash_mm()
            - self.addendum() * module_mm * sin / cos;
        standard.min(half_tip / cos).max(0.0)
    }

    /// Depth cut below the mate's addendum, mm.
    fn clearance_cut_mm(&self) -> f64 {
        self.corner_radius_mm() * (1.0 - self.pressure_angle_rad().sin())
    }

    /// Points of a flank from the end of the rack's straight part, d = −h_a m/(sin α cos α), to the tip.
    pub(crate) fn flank_points(
        &self,
        gear: Gear,
        tooth: i64,
        side: Direction,
        tip: &Tip,
        count: usize,
    ) -> Vec<[f64; 2]> {
        let (sin, cos) = self.pressure_angle_rad().sin_cos();
        let rising = rising(gear, side);
        let origin_mm = self.flank_origin_mm(gear, tooth, side);
        let start_mm = -self.addendum() * self.module_mm() / (sin * cos);
        // Equal steps of the rolling angle need the inverse of the arc length at the ends alone.
        let from_rad = self.theta1_at_arc_length(origin_mm + rising * start_mm);
        let to_rad = self.theta1_at_arc_length(origin_mm + rising * tip.reach_mm);
        (0..count)
            .map(|n| {
                let share = n as f64 / (count - 1) as f64;
                let roll = self.roll(from_rad + share * (to_rad - from_rad));
                self.to_body(gear, &roll, self.rack_contact(&roll, roll.arc_mm - origin_mm, side))
            })
            .collect()
    }

    /// q = h_a m tan α + ρ_f cos α: how far the corner's centre stands inside the rack's tooth.
    fn corner_inset_mm(&self) -> f64 {
        let (sin, cos) = self.pressure_angle_rad().sin_cos();
        self.addendum() * self.module_mm() * sin / cos + self.corner_radius_mm() * cos
    }

    /// Points of a fillet from the root to the flank, the ends left to their neighbours.
    pub(crate) fn fillet_points(&self, gear: Gear, tooth: i64, side: Direction, count: usize) -> Vec<[f64; 2]> {
        let sin = self.pressure_angle_rad().sin();
        let rising = rising(gear, side);
        let outward = if gear == Gear::Driver { 1.0 } else { -1.0 };
        let radius_mm = self.corner_radius_mm();
        let depth_mm = self.addendum() * self.module_mm() - radius_mm * sin;
        let inset_mm = self.corner_inset_mm();
        (0..count)
            .map(|n| {
                // The corner touches with its tip line where its centre is below P, with its flank where the line from P
                // to the centre has the flank's normal; equal steps of that angle.
                let share = n as f64 / count as f64;
                let lean = share * (std::f64::consts::FRAC_PI_2 - self.pressure_angle_rad());
                let along_mm = -rising * depth_mm * lean.tan();
                let d_mm = along_mm - rising * inset_mm;
                let origin_mm = self.flank_origin_mm(gear, tooth, side);
                let roll = self.roll(self.theta1_at_arc_length(origin_mm + d_mm));
                // centre − P in the (T, N) frame, lengthened by the radius
                let stretch = 1.0 + radius_mm / along_mm.hypot(depth_mm);
                let (t, n) = (stretch * along_mm, -outward * stretch * depth_mm);
                let (sin_mu, cos_mu) = roll.at.mu_rad.sin_cos();
                let point = [roll.at.r1_mm - t * sin_mu + n * cos_mu, t * cos_mu + n * sin_mu];
                self.to_body(gear, &roll, point)
            })
            .collect()
    }

    /// Rolling position at which a fillet ends on the root curve, rad.
    fn fillet_end_rad(&self, gear: Gear, tooth: i64, side: Direction) -> f64 {
        let origin_mm = self.flank_origin_mm(gear, tooth, side);
        self.theta1_at_arc_length(origin_mm - rising(gear, side) * self.corner_inset_mm())
    }

    /// Points of the curve that stands off the pitch curve by `modules`, between two rolling positions, the ends left out.
    fn offset_points(&self, gear: Gear, (from, to): (f64, f64), modules: f64, count: usize) -> Vec<[f64; 2]> {
        let outward = if gear == Gear::Driver { 1.0 } else { -1.0 };
        let height = outward * modules * self.module_mm();
        (1..=count)
            .map(|n| {
                let roll = self.roll(from + (to - from) * n as f64 / (count + 1) as f64);
                let (sin_mu, cos_mu) = roll.at.mu_rad.sin_cos();
                self.to_body(gear, &roll, [roll.at.r1_mm + height * cos_mu, height * sin_mu])
            })
            .collect()
    }
}

impl Outline {
    /// Area, mm².
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        self.signed_area_mm2().abs()
    }

    /// Shoelace formula; positive counter-clockwise.
    fn signed_area_mm2(&self) -> f64 {
        let points = &self.points_mm;
        let next = points.iter().cycle().skip(1);
        0.5 * points.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
    }

    /// The outline as a DXF drawing (R12, one closed polyline on layer `layer`, mm).
    #[must_use]
    pub fn to_dxf(&self, layer: &str) -> String {
        let layer: String = layer.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
        let layer = if layer.is_empty() { "0".to_owned() } else { layer };
        let mut text = format!(
            "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nPOLYLINE\n8\n{layer}\n66\n1\n\
             10\n0.0\n20\n0.0\n30\n0.0\n70\n1\n"
        );
        for [x, y] in &self.points_mm {
            // Writing to a String cannot fail.
            let _ = write!(text, "0\nVERTEX\n8\n{layer}\n10\n{x:.9}\n20\n{y:.9}\n30\n0.0\n");
        }
        let _ = write!(text, "0\nSEQEND\n8\n{layer}\n0\nENDSEC\n0\nEOF\n");
        text
    }

    /// The outline as an SVG drawing in mm, y upwards, with the axis marked.
    #[must_use]
    pub fn to_svg(&self) -> String {
        let reach = self.points_mm.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max) * 1.02;
        let size = 2.0 * reach;
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{size:.3}mm\" height=\"{size:.3}mm\" \
             viewBox=\"{0:.3} {0:.3} {size:.3} {size:.3}\">\n<path fill=\"none\" stroke=\"black\" stroke-width=\"0.1\" d=\"",
            -reach
        );
        for (n, [x, y]) in self.points_mm.iter().enumerate() {
            let _ = write!(text, "{}{x:.6} {:.6}", if n == 0 { "M" } else { " L" }, -y);
        }
        text.push_str(" Z\"/>\n<path stroke=\"black\" stroke-width=\"0.1\" d=\"M-2 0H2M0-2V2\"/>\n</svg>\n");
        text
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;
    use crate::flank::rotate;
    use crate::{CircularSpec, EllipticalSpec, ToothSpec};

    #[test]
    fn a_circular_outline_has_its_radii_and_thickness() {
        let pair = GearPair::circular(&CircularSpec { teeth: (40, 25), ..Default::default() }).unwrap();
        for (gear, z) in [(Gear::Driver, 40.0), (Gear::Driven, 25.0)] {
            let outline = pair.outline(gear, 200).unwrap();
            assert_eq!(outline.points_mm.len(), 200 * z as usize);
            let radii: Vec<f64> = outline.points_mm.iter().map(|[x, y]| x.hypot(*y)).collect();
            let (low, high) =
                (radii.iter().copied().fold(f64::MAX, f64::min), radii.iter().copied().fold(0.0, f64::max));
            assert!((high - (1.5 * z + 3.0)).abs() < 1e-9 && (low - (1.5 * z - 3.75)).abs() < 1e-9, "{low} {high}");
            // The polyline runs once round, and half of it is tooth at the pitch circle.
            let crossings =
                radii.iter().zip(radii.iter().cycle().skip(1)).filter(|(a, b)| (**a < 1.5 * z) != (**b < 1.5 * z));
            assert_eq!(crossings.count(), 2 * z as usize);
            let between = PI * (1.5 * z - 3.75_f64).powi(2)..PI * (1.5 * z + 3.0_f64).powi(2);
            assert!(between.contains(&outline.area_mm2()));
        }
    }

    /// Depth to which a point stands inside a closed polyline, mm; 0 outside.
    fn depth_inside(outline: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
        let (mut inside, mut nearest) = (false, f64::MAX);
        for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            if (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) {
                inside = !inside;
            }
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let length2 = dx * dx + dy * dy;
            let share =
                if length2 > 0.0 { (((x - a[0]) * dx + (y - a[1]) * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
            nearest = nearest.min((a[0] + share * dx - x).hypot(a[1] + share * dy - y));
        }
        if inside { nearest } else { 0.0 }
    }

    #[test]
    fn the_gears_run_without_cutting_into_each_other() {
        let pair = GearPair::elliptical(&EllipticalSpec {
            eccentricity: 0.4,
            teeth: ToothSpec { teeth: (36, 36), ..Default::default() },
        })
        .unwrap();
        let driver = pair.outline(Gear::Driver, 120).unwrap();
        let driven = pair.outline(Gear::Driven, 120).unwrap();
        let a = pair.centre_distance_mm();
        for step in 0..12 {
            let theta1 = TAU * f64::from(step) / 12.0 + 0.01;
            let theta2 = pair.theta2(theta1);
            let placed: Vec<[f64; 2]> =
                driven.points_mm.iter().map(|point| rotate(*point, -theta2)).map(|[x, y]| [x + a, y]).collect();
            let mut deepest = 0.0_f64;
            for point in &driver.points_mm {
                let [x, y] = rotate(*point, theta1);
                if y.abs() < 20.0 && x > 0.0 {
                    deepest = deepest.max(depth_inside(&placed, [x, y]));
                }
            }
            // The chords of a convex flank stand 0.5 µm inside it at this density.
            assert!(deepest < 1e-3, "{theta1}: {deepest}");
        }
    }

    #[test]
    fn exports_hold_every_point() {
        let pair = GearPair::elliptical(&EllipticalSpec {
            teeth: ToothSpec { backlash_mm: 0.1, ..Default::default() },
            ..Default::default()
        })
        .unwrap();
        let outline = pair.outline(Gear::Driven, 40).unwrap();
        assert_eq!(outline.to_dxf("gear 2").matches("VERTEX").count(), outline.points_mm.len());
        assert_eq!(outline.to_svg().matches(" L").count(), outline.points_mm.len() - 1);
        assert!(pair.outline(Gear::Driver, 3).is_err());
        assert!(pair.flank(Gear::Driver, 47, Direction::Ccw, 10).is_err());
        assert_eq!(pair.flank(Gear::Driver, 46, Direction::Cw, 64).unwrap().len(), 64);
        assert!(GearPair::constant(2.0).unwrap().outline(Gear::Driver, 40).is_err());
    }
}
