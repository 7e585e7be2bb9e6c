//! Stiffness of a tooth pair along the common normal, after Weber and Banaschek.
//!
//! A tooth is a cantilever of the section that the rack cuts, on an elastic half plane, touched by a Hertzian line contact.
//! Per unit of face width and force, with y_p the lever of the force over the root, 2x(y) the section, s the root's section,
//! α' the angle of the force against the tooth's cross direction:
//!
//! | part | compliance |
//! |---|---|
//! | bending, shear, compression | (1−ν²)/E cos² α' [12 ∫ (y_p − y)²/(2x)³ dy + (2.4/(1−ν) + tan² α') ∫ dy/(2x)] |
//! | foundation | (1−ν²)/E cos² α' [18/π (y_p/s)² + 2(1−2ν)/(1−ν) y_p/s + 4.8/π (1 + (1−ν)/2.4 tan² α')] |
//! | contact (both teeth) | 4/π (1−ν²)/E [ln(2 √(h1 h2)/b_H) − ν/(2(1−ν))] |
//!
//! b_H = √(8 w ρ (1−ν²)/(π E)) at the load w per width, ρ the relative radius of curvature, h1 and h2 the depths from the
//! contact to the teeth's middle lines.
//!
//! The sum is divided by C_M: teeth on real discs were measured softer than the theory has it.
//!
//! Sources: ISO 6336-1 (C_M, c', c_γ); C. Weber, K. Banaschek, Formänderung und Profilrücknahme bei gerad- und schrägverzahnten Rädern (1953).

use crate::gear::Gear;
use crate::tip::rising;
use crate::{Direction, GearPair};

/// Elastic constants of both gears' material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus, N/mm².
    pub youngs_modulus_n_per_mm2: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Measured over calculated stiffness of teeth on solid discs: C_M = 0.8 of ISO 6336-1.
    pub stiffness_correction: f64,
}

impl Default for Material {
    /// Steel: 206 000 N/mm², 0.3, with C_M = 0.8.
    fn default() -> Self {
        Self { youngs_modulus_n_per_mm2: 206_000.0, poisson: 0.3, stiffness_correction: 0.8 }
    }
}

/// Load positions along a flank at which the compliance is tabulated.
const POSITIONS: usize = 9;
/// Stations of the integrals over a tooth's height.
const STATIONS: usize = 60;

/// One flank's share of the compliance over the load position.
#[derive(Clone, Copy, Debug)]
struct FlankTable {
    /// Rack offset |d| of the first and last position, signed along rising height, mm.
    from_mm: f64,
    to_mm: f64,
    /// Compliance times E/(1−ν²) of bending, shear, compression and foundation; dimensionless.
    bending: [f64; POSITIONS],
    /// Depth h from the contact to the tooth's middle line along the normal, mm.
    depth_mm: [f64; POSITIONS],
}

impl FlankTable {
    fn at(&self, along_mm: f64) -> (f64, f64) {
        let share = ((along_mm - self.from_mm) / (self.to_mm - self.from_mm)).clamp(0.0, 1.0);
        let position = share * (POSITIONS - 1) as f64;
        let index = (position as usize).min(POSITIONS - 2);
        let part = position - index as f64;
        let between = |table: &[f64; POSITIONS]| table[index] + part * (table[index + 1] - table[index]);
        (between(&self.bending), between(&self.depth_mm))
    }
}

/// Compliance of every tooth pair of a gear pair.
#[derive(Clone, Debug)]
pub(super) struct ToothStiffness {
    material: Material,
    face_width_mm: f64,
    /// By gear, side (ccw, cw), tooth.
    tables: [[Vec<FlankTable>; 2]; 2],
}

impl ToothStiffness {
    /// Tables of a pair whose teeth can be cut (checked by the caller).
    pub(super) fn of(pair: &GearPair, material: Material) -> Self {
        let (z1, z2) = pair.teeth();
        let tables = [(Gear::Driver, z1), (Gear::Driven, z2)].map(|(gear, teeth)| {
            Direction::BOTH.map(|side| {
                (0..i64::from(teeth)).map(|tooth| flank_table(pair, gear, tooth, side, material.poisson)).collect()
            })
        });
        Self { material, face_width_mm: pair.face_width_mm(), tables }
    }

    /// Compliance of a tooth pair touching at the phase u, mm/N along the normal, when it carries `force_n`.
    pub(super) fn compliance_mm_per_n(
        &self,
        pair: &GearPair,
        tooth: i64,
        phase: f64,
        direction: Direction,
        force_n: f64,
        relative_radius_mm: f64,
    ) -> f64 {
        let side = usize::from(direction == Direction::Cw);
        let along_mm = phase * std::f64::consts::PI * pair.module_mm();
        let at = |gear: Gear, index: usize| {
            let table = &self.tables[index][side];
            table[tooth.rem_euclid(table.len() as i64) as usize].at(rising(gear, direction) * along_mm)
        };
        let ((q1, h1), (q2, h2)) = (at(Gear::Driver, 0), at(Gear::Driven, 1));
        let Material { youngs_modulus_n_per_mm2, poisson, stiffness_correction } = self.material;
        let plane = (1.0 - poisson * poisson) / youngs_modulus_n_per_mm2;
        let width_load = force_n.max(1e-3 * self.face_width_mm) / self.face_width_mm;
        let half_contact_mm = (8.0 * width_load * relative_radius_mm * plane / std::f64::consts::PI).sqrt();
        let hertz = 4.0 / std::f64::consts::PI
            * ((2.0 * (h1 * h2).sqrt() / half_contact_mm).ln() - poisson / (2.0 * (1.0 - poisson)));
        plane * (q1 + q2 + hertz.max(0.0)) / (stiffness_correction * self.face_width_mm)
    }
}

/// A tooth's section: half widths to both sides of its middle line over the height above the root.
struct Section {
    origin: [f64; 2],
    /// Unit vector from root to tip.
    axis: [f64; 2],
    /// (height, lateral) of the loaded and of the opposite side, root to tip.
    sides: [Vec<(f64, f64)>; 2],
}

impl Section {
    /// Section of the tooth behind a flank.
    fn of(pair: &GearPair, gear: Gear, tooth: i64, side: Direction) -> Self {
        // The opposite flank of the same tooth: gear 1's tooth j has both flanks j; gear 2's tooth lies between gear 1's cw
        // flank j and its ccw flank j + 1.
        let opposite = match (gear, side) {
            (Gear::Driver, _) => tooth,
            (Gear::Driven, Direction::Cw) => tooth + 1,
            (Gear::Driven, Direction::Ccw) => tooth - 1,
        };
        let profile = |tooth: i64, side: Direction| {
            let mut points = pair.fillet_points(gear, tooth, side, 12);
            let tip = pair.tip_of(gear, tooth, side);
            points.extend(pair.flank_points(gear, tooth, side, &tip, 24));
            points
        };
        let (loaded, other) = (profile(tooth, side), profile(opposite, side.reversed()));
        let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let (root, tip) = (middle(loaded[0], other[0]), middle(loaded[loaded.len() - 1], other[other.len() - 1]));
        let length = (tip[0] - root[0]).hypot(tip[1] - root[1]);
        let axis = [(tip[0] - root[0]) / length, (tip[1] - root[1]) / length];
        let frame = |points: Vec<[f64; 2]>| -> Vec<(f64, f64)> {
            points
                .into_iter()
                .map(|[x, y]| {
                    let (dx, dy) = (x - root[0], y - root[1]);
                    (dx * axis[0] + dy * axis[1], (dx * axis[1] - dy * axis[0]).abs())
                })
                .collect()
        };
        Self { origin: root, axis, sides: [frame(loaded), frame(other)] }
    }

    /// Full width at a height, mm.
    fn width_mm(&self, height_mm: f64) -> f64 {
        self.sides.iter().map(|side| interpolate(side, height_mm)).sum()
    }
}

/// Lateral distance at a height; heights rise along the list.
fn interpolate(side: &[(f64, f64)], height_mm: f64) -> f64 {
    let above = side.partition_point(|point| point.0 < height_mm).clamp(1, side.len() - 1);
    let ((h0, x0), (h1, x1)) = (side[above - 1], side[above]);
    let share = if h1 > h0 { ((height_mm - h0) / (h1 - h0)).clamp(0.0, 1.0) } else { 0.0 };
    x0 + share * (x1 - x0)
}

fn flank_table(pair: &GearPair, gear: Gear, tooth: i64, side: Direction, poisson: f64) -> FlankTable {
    let section = Section::of(pair, gear, tooth, side);
    let (sin_alpha, cos_alpha) = pair.pressure_angle_rad().sin_cos();
    let tip = pair.tip_of(gear, tooth, side);
    let from_mm = -pair.addendum() * pair.module_mm() / (sin_alpha * cos_alpha);
    let to_mm = tip.reach_mm;
    let rising = rising(gear, side);
    let root_width_mm = section.width_mm(0.0);
    let mut bending = [0.0; POSITIONS];
    let mut depth_mm = [0.0; POSITIONS];
    for (position, (bending, depth_mm)) in bending.iter_mut().zip(&mut depth_mm).enumerate() {
        let along = from_mm + (to_mm - from_mm) * position as f64 / (POSITIONS - 1) as f64;
        let (point, normal) = flank_normal(pair, gear, tooth, side, rising * along);
        let (dx, dy) = (point[0] - section.origin[0], point[1] - section.origin[1]);
        let height = dx * section.axis[0] + dy * section.axis[1];
        let lateral = (dx * section.axis[1] - dy * section.axis[0]).abs();
        // Force against the tooth: minus the outward normal; its part along the axis presses the tooth down.
        let along_axis = normal[0] * section.axis[0] + normal[1] * section.axis[1];
        let across = (1.0 - along_axis * along_axis).sqrt();
        let tan = along_axis / across;
        // Where the force's line meets the middle line.
        let lever = (height - lateral * tan).max(0.0);
        let (mut moment, mut shear) = (0.0, 0.0);
        let step = lever / STATIONS as f64;
        for station in 0..STATIONS {
            let y = (station as f64 + 0.5) * step;
            let width = section.width_mm(y);
            moment += (lever - y).powi(2) / width.powi(3) * step;
            shear += step / width;
        }
        let ratio = lever / root_width_mm;
        let beam = 12.0 * moment + (2.4 / (1.0 - poisson) + tan * tan) * shear;
        let foundation = 18.0 / std::f64::consts::PI * ratio * ratio
            + 2.0 * (1.0 - 2.0 * poisson) / (1.0 - poisson) * ratio
            + 4.8 / std::f64::consts::PI * (1.0 + (1.0 - poisson) / 2.4 * tan * tan);
        *bending = across * across * (beam + foundation);
        *depth_mm = (lateral / across).max(0.05 * pair.module_mm());
    }
    FlankTable { from_mm, to_mm, bending, depth_mm }
}

/// A flank's point and outward unit normal in its gear's body.
fn flank_normal(pair: &GearPair, gear: Gear, tooth: i64, side: Direction, d_mm: f64) -> ([f64; 2], [f64; 2]) {
    let (point, theta_rad) = pair.flank_point(gear, tooth, side, d_mm);
    let roll = pair.roll(theta_rad);
    // Gear 1's outward normal n has the angle ±(π/2 − α) + μ in the fixed frame; gear 2's is −n.
    let angle = side.sign() * (std::f64::consts::FRAC_PI_2 - pair.pressure_angle_rad()) + roll.at.mu_rad;
    let turned = match gear {
        Gear::Driver => angle - roll.at.theta1_rad,
        Gear::Driven => angle + roll.at.theta2_rad + std::f64::consts::PI,
    };
    let (sin, cos) = turned.sin_cos();
    (point, [cos, sin])
}
