//! Errors of single teeth and what depends on the tooth phase: displaced teeth, one profile at all teeth, a damaged tooth, and the
//! stiffness that changes with the number of pairs in contact.
//!
//! With s the pitch arc from θ1 = 0 in pitches, pair j of the ccw flank stands u = s − j pitches from the pitch point, that of the
//! cw flank u = s − j − ½. A pair can touch while |u| ≤ ε/2: the tips reach h_a m from the pitch curve, and the contact point stands
//! u π m cos α sin α from it, so ε = 2 h_a/(π cos α sin α). Teeth are rigid against one another: the most advanced pair carries.

use super::error::{PlantError, in_range};
use super::flank::Flank;
use super::geometry::{GearSpec, PitchCurves};
use std::f64::consts::{PI, TAU};

/// Grid points a pitch.
const POINTS_PER_PITCH: usize = 256;
/// A pair that leaves the zone of contact rolls off its tip: it falls back by this much a pitch, mm.
const ROLL_OFF_MM_PER_PITCH: f64 = 1.0;

/// A tooth with material missing on one flank.
#[derive(Debug, Clone, PartialEq)]
pub struct DamageSpec {
    /// Tooth of the driver, 0 to Z1 − 1.
    pub tooth: u32,
    /// The flank that is damaged.
    pub flank: Flank,
    /// Depth along the normal, mm.
    pub depth_mm: f64,
    /// Full width at half depth, in pitches.
    pub width: f64,
}

/// One order of the profile error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileOrder {
    /// Order of the tooth mesh, 1 to 3.
    pub order: u32,
    /// Amplitude along the normal, mm.
    pub amplitude_mm: f64,
    /// Phase, rad: the driven gear moves ahead by amplitude · sin(order · 2π s − phase).
    pub phase_rad: f64,
}

/// The teeth as they were really cut and worn.
#[derive(Debug, Clone, PartialEq)]
pub struct ToothSpec {
    /// Height of the tips above the pitch curve, in modules.
    pub addendum: f64,
    /// Displacement of each driver tooth's ccw flank along the normal, mm, positive where the driven gear moves ahead; empty for none.
    pub ccw_mm: Vec<f64>,
    /// The same of each cw flank.
    pub cw_mm: Vec<f64>,
    /// Profile error, the same at every tooth and in both senses.
    pub profile: Vec<ProfileOrder>,
    /// A damaged tooth.
    pub damage: Option<DamageSpec>,
    /// Compliance with one pair in contact less that with two, mm²·rad/(N·m); the mean over a pitch stays.
    pub stiffness_variation_mm2_rad_per_nm: f64,
    /// Share of the pitch with two pairs in contact, around half a pitch from the pitch point.
    pub double_contact_share: f64,
    /// Growth of the backlash per driver revolution and N·m, mm along the pitch curve.
    pub wear_mm_per_rev_nm: f64,
}

impl Default for ToothSpec {
    fn default() -> Self {
        Self {
            addendum: 1.0,
            ccw_mm: Vec::new(),
            cw_mm: Vec::new(),
            profile: Vec::new(),
            damage: None,
            stiffness_variation_mm2_rad_per_nm: 0.0,
            double_contact_share: 0.6,
            wear_mm_per_rev_nm: 0.0,
        }
    }
}

impl ToothSpec {
    pub(super) fn validate(&self, gears: &GearSpec, mesh_compliance: f64) -> Result<(), PlantError> {
        let z1 = gears.teeth[0];
        let small = 0.2 * gears.module_mm;
        in_range("teeth.addendum", self.addendum, "modules", (0.6, 1.4), "1 is usual; one pair must always touch")?;
        for errors in [&self.ccw_mm, &self.cw_mm] {
            if !errors.is_empty() {
                let (count, z) = (errors.len() as f64, f64::from(z1));
                in_range("number of tooth errors", count, "teeth", (z, z), "give one for each tooth of the driver")?;
            }
            for &error in errors {
                in_range("teeth.ccw_mm and cw_mm", error, "mm", (-small, small), "a tooth's displacement")?;
            }
        }
        for wave in &self.profile {
            in_range("teeth.profile order", f64::from(wave.order), "", (1.0, 3.0), "orders of the tooth mesh")?;
            in_range("teeth.profile amplitude", wave.amplitude_mm, "mm", (-small, small), "along the normal")?;
            in_range("teeth.profile phase", wave.phase_rad, "rad", (-1e6, 1e6), "give a finite angle")?;
        }
        if let Some(damage) = &self.damage {
            let last = f64::from(z1.saturating_sub(1));
            in_range(
                "teeth.damage tooth",
                f64::from(damage.tooth),
                "",
                (0.0, last),
                "number the driver's teeth from 0",
            )?;
            in_range("teeth.damage depth", damage.depth_mm, "mm", (0.0, small), "along the normal")?;
            in_range("teeth.damage width", damage.width, "pitches", (0.05, 3.0), "full width at half depth")?;
        }
        let variation = self.stiffness_variation_mm2_rad_per_nm;
        // With two pairs in contact c (1 − share) is taken off the mean, which must leave something.
        let share = self.double_contact_share;
        in_range("teeth.double_contact_share", share, "", (0.05, 0.95), "of the pitch")?;
        let most = 0.95 * mesh_compliance / (1.0 - share);
        in_range(
            "teeth.stiffness_variation_mm2_rad_per_nm",
            variation,
            "mm²·rad/(N·m)",
            (0.0, most),
            "raise mesh.compliance_mm2_rad_per_nm: two pairs in contact cannot be stiffer than rigid",
        )?;
        in_range("teeth.wear_mm_per_rev_nm", self.wear_mm_per_rev_nm, "mm/(N·m)", (0.0, 1.0), "per revolution")
    }

    /// Pitches over which a pair can touch.
    pub(super) fn contact_ratio(&self, gears: &GearSpec) -> f64 {
        let (sin, cos) = gears.pressure_angle_deg.to_radians().sin_cos();
        2.0 * self.addendum / (PI * cos * sin)
    }

    fn is_perfect(&self) -> bool {
        self.ccw_mm.is_empty()
            && self.cw_mm.is_empty()
            && self.profile.is_empty()
            && self.damage.is_none()
            && self.stiffness_variation_mm2_rad_per_nm == 0.0
    }

    /// Displacement along the normal, mm, of `flank` at `s` pitches, positive where the driven gear moves ahead.
    fn displacement_mm(&self, flank: Flank, s: f64, z1: u32, contact_ratio: f64) -> f64 {
        let z = f64::from(z1);
        let half = if flank == Flank::Ccw { 0.0 } else { 0.5 };
        let errors = if flank == Flank::Ccw { &self.ccw_mm } else { &self.cw_mm };
        let mut total = 0.0;
        if !errors.is_empty() {
            let at = s - half;
            let nearest = at.round();
            // Ahead is forward of the driven gear; on the cw flank the most advanced pair is the furthest back.
            let side = flank.sign();
            let mut most = f64::NEG_INFINITY;
            for step in [-1.0, 0.0, 1.0] {
                let pair = nearest + step;
                let beyond = ((at - pair).abs() - 0.5 * contact_ratio).max(0.0);
                let tooth = (pair.rem_euclid(z) as usize).min(errors.len() - 1);
                most = most.max(side * errors[tooth] - ROLL_OFF_MM_PER_PITCH * beyond);
            }
            total += side * most;
        }
        for wave in &self.profile {
            total += wave.amplitude_mm * (f64::from(wave.order) * TAU * s - wave.phase_rad).sin();
        }
        if let Some(damage) = self.damage.as_ref().filter(|damage| damage.flank == flank) {
            let u = (s - half - f64::from(damage.tooth) + 0.5 * z).rem_euclid(z) - 0.5 * z;
            if u.abs() < damage.width {
                // Depth · cos²(π u/(2 w)): half of it at ± w/2. A lag: backward on the ccw flank, forward on the cw flank.
                total -= flank.sign() * damage.depth_mm * (0.5 * PI * u / damage.width).cos().powi(2);
            }
        }
        total
    }

    /// Compliance above the mean over a pitch, mm²·rad/(N·m).
    fn extra_compliance(&self, flank: Flank, s: f64) -> f64 {
        let half = if flank == Flank::Ccw { 0.0 } else { 0.5 };
        let u = s - half - (s - half).round();
        let share = self.double_contact_share;
        let double = 0.5 - u.abs() < 0.5 * share;
        self.stiffness_variation_mm2_rad_per_nm * if double { share - 1.0 } else { share }
    }
}

/// What the teeth add at one driver angle.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ToothState {
    /// Driven angle, rad, and its slope over θ1.
    pub psi_rad: f64,
    pub ratio: f64,
    /// Compliance, mm²·rad/(N·m).
    pub compliance: f64,
}

/// The teeth's part over one driver turn.
#[derive(Debug, Clone)]
pub(super) struct ToothTable {
    /// (driven angle, compliance) a grid point, ccw and cw; the last point repeats the first.
    points: [Vec<(f64, f64)>; 2],
    per_rad: f64,
}

impl ToothTable {
    /// `None` for perfect teeth.
    pub fn new(teeth: &ToothSpec, gears: &GearSpec) -> Option<Self> {
        if teeth.is_perfect() {
            return None;
        }
        let curves = PitchCurves::new(gears);
        let alpha = gears.pressure_angle_deg.to_radians();
        let z1 = gears.teeth[0];
        let count = POINTS_PER_PITCH * z1 as usize;
        let ratio = teeth.contact_ratio(gears);
        let pitch_mm = PI * gears.module_mm;
        let mut arc_mm = 0.0;
        let mut points = [Vec::with_capacity(count + 1), Vec::with_capacity(count + 1)];
        for n in 0..=count {
            let theta = TAU * n as f64 / count as f64;
            if n > 0 {
                arc_mm += curves.arc_mm(TAU * (n - 1) as f64 / count as f64, theta);
            }
            // The tooth condition makes the whole turn Z1 pitches.
            let s = if n == count { 0.0 } else { arc_mm / pitch_mm };
            let mu = curves.radius(theta).inclination();
            for flank in [Flank::Ccw, Flank::Cw] {
                // A displacement along the normal turns the driven gear by it over the lever arm r2 cos(α ∓ μ).
                let arm_mm = curves.driven_radius(theta) * (alpha - flank.sign() * mu).cos();
                let psi = teeth.displacement_mm(flank, s, z1, ratio) / arm_mm;
                points[flank as usize].push((psi, teeth.extra_compliance(flank, s)));
            }
        }
        Some(Self { points, per_rad: count as f64 / TAU })
    }

    /// The teeth's part at driver angle `theta1`.
    #[inline]
    pub fn at(&self, theta1: f64, flank: Flank) -> ToothState {
        let points = &self.points[flank as usize];
        let count = points.len() - 1;
        let turns = theta1 / TAU;
        let place = (turns - super::table::floor(turns)) * count as f64;
        let cell = (place as usize).min(count - 1);
        let t = place - cell as f64;
        let ((psi0, c0), (psi1, c1)) = (points[cell], points[cell + 1]);
        ToothState {
            psi_rad: psi0 + t * (psi1 - psi0),
            ratio: (psi1 - psi0) * self.per_rad,
            compliance: c0 + t * (c1 - c0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn teeth() -> ToothSpec {
        ToothSpec::default()
    }

    #[test]
    fn all_teeth_displaced_alike_are_one_displacement() {
        let spec = ToothSpec { ccw_mm: vec![0.01; 47], cw_mm: vec![0.01; 47], ..teeth() };
        for s in [0.0, 0.3, 12.49, 46.9] {
            for flank in [Flank::Ccw, Flank::Cw] {
                assert!((spec.displacement_mm(flank, s, 47, 1.98) - 0.01).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn one_proud_tooth_carries_while_it_can_touch() {
        let mut errors = vec![0.0; 47];
        errors[5] = 0.01;
        let spec = ToothSpec { ccw_mm: errors.clone(), cw_mm: errors, ..teeth() };
        for (s, ccw) in [(5.0, 0.01), (5.9, 0.01), (4.1, 0.01), (6.1, 0.0), (3.9, 0.0)] {
            assert!((spec.displacement_mm(Flank::Ccw, s, 47, 1.98) - ccw).abs() < 1e-12, "{s}");
        }
        // Forward is backward for the cw flank: its neighbours carry while one of them can touch.
        assert_eq!(spec.displacement_mm(Flank::Cw, 5.3, 47, 1.98), 0.0);
        // At the very centre with a short zone it is alone.
        assert!((spec.displacement_mm(Flank::Cw, 5.5, 47, 1.4) - 0.01).abs() < 1e-12);
        // A tooth that stands back on the ccw flank is bridged by its neighbours.
        let mut errors = vec![0.0; 47];
        errors[5] = -0.01;
        let spec = ToothSpec { ccw_mm: errors, ..teeth() };
        assert_eq!(spec.displacement_mm(Flank::Ccw, 5.3, 47, 1.98), 0.0);
    }

    #[test]
    fn damage_lags_in_its_own_sense_only_and_has_its_width() {
        for (flank, centre) in [(Flank::Ccw, 46.0), (Flank::Cw, 46.5)] {
            let damage = DamageSpec { tooth: 46, flank, depth_mm: 0.02, width: 0.8 };
            let spec = ToothSpec { damage: Some(damage), ..teeth() };
            let lag = |s: f64| -flank.sign() * spec.displacement_mm(flank, s, 47, 1.98);
            assert!((lag(centre) - 0.02).abs() < 1e-12);
            assert!((lag(centre + 0.4) - 0.01).abs() < 1e-12 && (lag(centre - 0.4) - 0.01).abs() < 1e-12);
            assert_eq!(lag(centre + 0.81 - 47.0), 0.0);
            // It reaches across the turn.
            assert!(lag(centre + 0.7 - 47.0) > 0.0);
            let other = if flank == Flank::Ccw { Flank::Cw } else { Flank::Ccw };
            assert_eq!(spec.displacement_mm(other, centre, 47, 1.98), 0.0);
        }
    }

    #[test]
    fn the_stiffness_varies_about_its_mean() {
        let spec = ToothSpec { stiffness_variation_mm2_rad_per_nm: 2e-3, double_contact_share: 0.7, ..teeth() };
        for flank in [Flank::Ccw, Flank::Cw] {
            let values: Vec<f64> = (0..10_000).map(|n| spec.extra_compliance(flank, f64::from(n) * 1e-4)).collect();
            assert!((values.iter().sum::<f64>() / 1e4).abs() < 2e-6);
            let spread =
                values.iter().fold(f64::MIN, |a, b| a.max(*b)) - values.iter().fold(f64::MAX, |a, b| a.min(*b));
            assert!((spread - 2e-3).abs() < 1e-12);
        }
        // One pair alone at the pitch point is softer.
        assert!(spec.extra_compliance(Flank::Ccw, 3.0) > 0.0 && spec.extra_compliance(Flank::Cw, 3.5) > 0.0);
        assert!(spec.extra_compliance(Flank::Ccw, 3.5) < 0.0);
    }

    #[test]
    fn the_table_follows_the_teeth_over_the_arms() {
        let gears = GearSpec { eccentricity: 0.0, ..GearSpec::default() };
        let profile = vec![ProfileOrder { order: 1, amplitude_mm: 0.01, phase_rad: 0.4 }];
        let table = ToothTable::new(&ToothSpec { profile, ..teeth() }, &gears).unwrap();
        for n in 0..50 {
            let theta = f64::from(n) * 0.37 - 5.0;
            let expected = 0.01 * (47.0 * theta - 0.4).sin() / (70.5 * 20f64.to_radians().cos());
            for flank in [Flank::Ccw, Flank::Cw] {
                assert!((table.at(theta, flank).psi_rad - expected).abs() < 2e-8);
            }
        }
        assert!(ToothTable::new(&teeth(), &gears).is_none());
    }

    #[test]
    fn the_contact_ratio_is_that_of_the_rack() {
        assert!((teeth().contact_ratio(&GearSpec::default()) - 1.981).abs() < 1e-3);
    }
}
