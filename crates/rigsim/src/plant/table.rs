//! Exact contact, tabulated over the driver's angle for the integrator.

use super::error::PlantError;
use super::flank::{Flank, MountedPair};
use super::geometry::GearSpec;
use std::f64::consts::TAU;

/// Interpolated contact angles stay this close to exact contact, rad.
const INTERPOLATION_LIMIT_RAD: f64 = 1e-10;
/// Refinement of the grid ends here, cells a driver turn.
const FINEST_CELLS_PER_TURN: usize = 16_384;
/// Flanks of a pair without backlash coincide to rounding; what closes the gap by less than this is not a jam, rad.
const JAM_TOLERANCE_RAD: f64 = 1e-10;

/// One grid cell, two cache lines: cubics of ψ2 − θ1·(mean ratio) for both flanks, straight lines for the rest.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Cell {
    /// Hermite cubics in t ∈ [0, 1), ccw and cw.
    psi: [[f64; 4]; 2],
    /// Squared lever arm about the driven axis, mm², value and difference, ccw and cw.
    arm2_squared: [[f64; 2]; 2],
    /// 1/r2, mm⁻¹, value and difference.
    inverse_radius: [f64; 2],
}

/// A place on the grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    cell: usize,
    t: f64,
    /// θ1 times the mean ratio.
    base_rad: f64,
    /// θ1 itself.
    pub theta1_rad: f64,
}

/// Geometry of one flank at one place.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FlankState {
    /// Driven angle at which the flank touches, rad.
    pub psi_rad: f64,
    /// dψ/dθ1.
    pub ratio: f64,
    /// Squared lever arm about the driven axis, mm².
    pub arm_squared_mm2: f64,
    /// Compliance of the teeth that touch, mm²·rad/(N·m); the mesh knows it.
    pub compliance_mm2_rad_per_nm: f64,
}

/// Contact of both flanks over the period of the pair.
#[derive(Debug, Clone)]
pub(super) struct ContactTable {
    cells: Vec<Cell>,
    mean_ratio: f64,
    inverse_period: f64,
    cells_f64: f64,
    cells_per_rad: f64,
}

impl ContactTable {
    /// Tabulates the pair of `gears` with the centre distance grown by `growth_mm`, refining a grid of `at_least` cells
    /// a driver turn until it is exact enough.
    pub fn new(gears: &GearSpec, growth_mm: f64, at_least: usize) -> Result<Self, PlantError> {
        let pair = MountedPair::new(gears, growth_mm);
        // Circular pairs hold nothing but first orders, elliptic ones the harmonics of the pitch curve.
        let mut per_turn = at_least.max(if gears.eccentricity == 0.0 { 256 } else { 2048 });
        loop {
            let table = Self::with_grid(&pair, per_turn)?;
            let (error_rad, theta1_rad) = table.worst_error(&pair)?;
            if error_rad < INTERPOLATION_LIMIT_RAD {
                return Ok(table);
            }
            per_turn *= 2;
            if per_turn > FINEST_CELLS_PER_TURN {
                return Err(PlantError::CoarseTable {
                    error_rad,
                    theta1_rad,
                    limit_rad: INTERPOLATION_LIMIT_RAD,
                    cells: table.cells.len(),
                });
            }
        }
    }

    /// Cells a driver turn.
    pub fn cells_per_turn(&self) -> usize {
        (self.cells_per_rad * TAU).round() as usize
    }

    fn with_grid(pair: &MountedPair, per_turn: usize) -> Result<Self, PlantError> {
        let turns = pair.curves.turns_per_period as usize;
        let count = per_turn * turns;
        let mean_ratio = pair.curves.mean_ratio;
        let width = TAU / per_turn as f64;
        let mut nodes = Vec::with_capacity(count + 1);
        let mut worst: Option<Jam> = None;
        for n in 0..count {
            let theta = n as f64 * width;
            let ccw = pair.contact(Flank::Ccw, theta, 0.0)?;
            let cw = pair.contact(Flank::Cw, theta, 0.0)?;
            let overlap_rad = ccw.psi2_rad - cw.psi2_rad;
            if overlap_rad > JAM_TOLERANCE_RAD {
                let jam = Jam::new(pair, theta, overlap_rad);
                if worst.as_ref().is_none_or(|most| jam.backlash_needed_mm > most.backlash_needed_mm) {
                    worst = Some(jam);
                }
            }
            nodes.push([ccw, cw]);
        }
        if let Some(jam) = worst {
            return Err(PlantError::TeethJam {
                theta1_rad: jam.theta1_rad,
                overlap_mm: jam.backlash_needed_mm * pair.pressure_angle_rad().cos(),
                backlash_needed_mm: jam.backlash_needed_mm,
            });
        }

        let cells = (0..count)
            .map(|n| {
                let (here, next) = (&nodes[n], &nodes[(n + 1) % count]);
                let theta = n as f64 * width;
                // The last cell ends at the first node, a whole period later.
                let end = if n + 1 == count { 0.0 } else { theta + width };
                let cubic = |side: usize| {
                    hermite(
                        here[side].psi2_rad - mean_ratio * theta,
                        (here[side].ratio - mean_ratio) * width,
                        next[side].psi2_rad - mean_ratio * end,
                        (next[side].ratio - mean_ratio) * width,
                    )
                };
                let line = |from: f64, to: f64| [from, to - from];
                let arm = |side: usize| line(here[side].arm2_mm.powi(2), next[side].arm2_mm.powi(2));
                Cell {
                    psi: [cubic(0), cubic(1)],
                    arm2_squared: [arm(0), arm(1)],
                    inverse_radius: line(
                        1.0 / pair.curves.driven_radius(theta),
                        1.0 / pair.curves.driven_radius(theta + width),
                    ),
                }
            })
            .collect();
        Ok(Self {
            cells,
            mean_ratio,
            inverse_period: 1.0 / (TAU * turns as f64),
            cells_f64: count as f64,
            cells_per_rad: 1.0 / width,
        })
    }

    /// Largest miss of the cubics at the middle of every fourth cell.
    fn worst_error(&self, pair: &MountedPair) -> Result<(f64, f64), PlantError> {
        let mut worst = (0.0, 0.0);
        for n in (0..self.cells.len()).step_by(4) {
            let theta = (n as f64 + 0.5) / self.cells_per_rad;
            let place = self.locate(theta);
            for flank in [Flank::Ccw, Flank::Cw] {
                let miss = (self.flank(place, flank).psi_rad - pair.contact(flank, theta, 0.0)?.psi2_rad).abs();
                if miss > worst.0 {
                    worst = (miss, theta);
                }
            }
        }
        Ok(worst)
    }

    /// Finds the cell of driver angle `theta1`.
    #[inline]
    pub fn locate(&self, theta1: f64) -> Place {
        let turns = theta1 * self.inverse_period;
        let within = (turns - floor(turns)) * self.cells_f64;
        // Rounding may put an angle just under a whole turn on the turn itself.
        let cell = (within as usize).min(self.cells.len() - 1);
        Place { cell, t: within - cell as f64, base_rad: self.mean_ratio * theta1, theta1_rad: theta1 }
    }

    /// Geometry of `flank` at `place`.
    #[inline]
    pub fn flank(&self, place: Place, flank: Flank) -> FlankState {
        let cell = &self.cells[place.cell];
        let side = flank as usize;
        let [c0, c1, c2, c3] = cell.psi[side];
        let t = place.t;
        FlankState {
            psi_rad: place.base_rad + (c0 + t * (c1 + t * (c2 + t * c3))),
            ratio: self.mean_ratio + (c1 + t * (2.0 * c2 + t * 3.0 * c3)) * self.cells_per_rad,
            arm_squared_mm2: cell.arm2_squared[side][0] + t * cell.arm2_squared[side][1],
            compliance_mm2_rad_per_nm: 0.0,
        }
    }

    /// 1/r2 at `place`, mm⁻¹.
    #[inline]
    pub fn inverse_radius(&self, place: Place) -> f64 {
        let [value, difference] = self.cells[place.cell].inverse_radius;
        value + place.t * difference
    }
}

/// Largest integer not above `x`, as f64; without the library call that `f64::floor` is on the baseline instruction
/// set.
#[inline]
pub(super) fn floor(x: f64) -> f64 {
    let truncated = x as i64 as f64;
    if truncated > x { truncated - 1.0 } else { truncated }
}

fn hermite(p0: f64, m0: f64, p1: f64, m1: f64) -> [f64; 4] {
    [p0, m0, 3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1]
}

/// Flanks that overlap, in terms of what would free them.
struct Jam {
    theta1_rad: f64,
    backlash_needed_mm: f64,
}

impl Jam {
    fn new(pair: &MountedPair, theta1_rad: f64, overlap_rad: f64) -> Self {
        let alpha = pair.pressure_angle_rad();
        let mu = pair.curves.radius(theta1_rad).inclination();
        // A thinning j along the pitch curve opens (j/2) cos α along each normal, over the arms r2 cos(α ∓ μ).
        let opened_per_mm = 0.5 * alpha.cos() / pair.curves.driven_radius(theta1_rad)
            * (1.0 / (alpha - mu).cos() + 1.0 / (alpha + mu).cos());
        Self { theta1_rad, backlash_needed_mm: overlap_rad / opened_per_mm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact columns of a reference file: θ1, f, TE ccw, TE cw.
    fn reference(file: &str) -> Vec<[f64; 4]> {
        let path = format!("{}/../../fixtures/reference/{file}", env!("CARGO_MANIFEST_DIR"));
        std::fs::read_to_string(&path)
            .unwrap()
            .lines()
            .filter(|line| !line.starts_with('#') && !line.starts_with("theta1"))
            .map(|line| {
                let columns: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
                [columns[0], columns[1], columns[2], columns[3]]
            })
            .collect()
    }

    #[test]
    fn the_table_reproduces_the_reference_contact() {
        for (file, k) in [("te_circular_k0.csv", 1e-12), ("te_elliptic_k0.3287.csv", 0.3287)] {
            // The reference has no backlash and jams; thinning moves both flanks apart, so it is compared flank by
            // flank.
            let gears = GearSpec { eccentricity: k, backlash_mm: 0.0, ..GearSpec::default() };
            let pair = MountedPair::new(&gears, 0.0);
            let rows = reference(file);
            assert_eq!(rows.len(), 90);
            for [theta, f, ccw, cw] in rows {
                assert!((pair.curves.driven_angle(theta) - f).abs() < 1e-10);
                for (flank, te) in [(Flank::Ccw, ccw), (Flank::Cw, cw)] {
                    let got = pair.contact(flank, theta, 0.0).unwrap().psi2_rad - pair.curves.driven_angle(theta);
                    assert!((got - te).abs() < 1e-8, "{file} {} at {theta}: {got} against {te}", flank.name());
                }
            }
        }
    }

    #[test]
    fn interpolation_is_exact_between_the_nodes_and_across_the_turn() {
        for k in [0.0, 0.3287, 0.6] {
            let gears = GearSpec { eccentricity: k, ..GearSpec::default() };
            let table = ContactTable::new(&gears, 0.01, 0).unwrap();
            let pair = MountedPair::new(&gears, 0.01);
            for n in -300..300 {
                let theta = f64::from(n) * 0.0737;
                let place = table.locate(theta);
                for flank in [Flank::Ccw, Flank::Cw] {
                    let exact = pair.contact(flank, theta, 0.0).unwrap();
                    let got = table.flank(place, flank);
                    assert!((got.psi_rad - exact.psi2_rad).abs() < 1e-10, "k = {k}, theta = {theta}");
                    assert!((got.ratio - exact.ratio).abs() < 1e-6);
                    assert!((got.arm_squared_mm2 / exact.arm2_mm.powi(2) - 1.0).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn unequal_tooth_numbers_repeat_after_whole_cycles() {
        let gears = GearSpec { eccentricity: 0.0, teeth: [48, 32], ..GearSpec::default() };
        let table = ContactTable::new(&gears, 0.0, 0).unwrap();
        let at = |theta: f64| table.flank(table.locate(theta), Flank::Ccw).psi_rad;
        assert!((at(0.4 + 2.0 * TAU) - at(0.4) - 3.0 * TAU).abs() < 1e-12);
        assert!((at(0.4 + TAU) - at(0.4) - 1.5 * TAU).abs() > 1e-5);
    }

    #[test]
    fn a_pair_without_room_jams_and_says_how_much_is_missing() {
        let tight = GearSpec { backlash_mm: 0.0, ..GearSpec::default() };
        let Err(PlantError::TeethJam { overlap_mm, backlash_needed_mm, .. }) = ContactTable::new(&tight, 0.0, 0) else {
            panic!("the documented eccentricities need backlash");
        };
        assert!(overlap_mm > 0.02 && overlap_mm < 0.1);
        let eased = GearSpec { backlash_mm: backlash_needed_mm * 1.01, ..tight };
        assert!(ContactTable::new(&eased, 0.0, 0).is_ok());
        assert!(ContactTable::new(&GearSpec::default().ideal(), 0.0, 0).is_ok());
    }

    #[test]
    fn floor_agrees_with_the_library() {
        for x in [-2.5, -2.0, -1e-17, 0.0, 0.5, 1.0, 7.999, 1e12 + 0.5] {
            assert_eq!(floor(x), f64::floor(x));
        }
    }
}
