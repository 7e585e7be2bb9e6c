//! Mounting phases: which φ1, φ2 make the error small.
//!
//! TE and b_v of the increment are linear in (e1 cos φ1, e1 sin φ1, e2 cos φ2, e2 sin φ2), so a study evaluates four basis
//! curves once and combines them. The peak-to-peak has kinks and several minima: the search covers the whole torus of phases
//! before it refines.

use std::f64::consts::{PI, TAU};

use crate::increment::common_normal;
use crate::{Direction, Errors, GearPair, GeometryError};

/// What is to be small.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PhaseObjective {
    /// Peak-to-peak of the periodic backlash b_v.
    Backlash,
    /// Peak-to-peak of TE in one sense.
    TransmissionError(Direction),
    /// The larger peak-to-peak of TE of both senses.
    TransmissionErrorBoth,
}

/// How a gear's eccentricity can be turned in assembly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PhaseFreedom {
    /// As it is.
    Fixed,
    /// Turned on its hub, by any angle.
    Hub,
    /// Indexed by whole steps of 1/`steps` of a turn (teeth of a circular gear, lobes of a lobed one).
    Index {
        /// Steps a turn.
        steps: u32,
    },
}

/// Phases and what they give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseValue {
    /// φ1, rad, in (−π, π].
    pub phi1_rad: f64,
    /// φ2, rad, in (−π, π].
    pub phi2_rad: f64,
    /// The objective there, rad.
    pub value_rad: f64,
}

/// The optimal phases beside what the source document prescribes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phases {
    /// The global minimum within the freedoms.
    pub best: PhaseValue,
    /// The printed prescription φ1 = π − α ± nπ, φ2 = α ± nπ, with n even for both and with n even and odd: the two of its
    /// solutions that differ.
    pub published: [PhaseValue; 2],
}

/// The objective over all phases of one pair with given eccentricities.
#[derive(Clone, Debug)]
pub struct PhaseStudy {
    /// One entry a curve of the objective: at each angle what e1 cos φ1, e1 sin φ1, e2 cos φ2, e2 sin φ2 contribute.
    curves: Vec<Vec<[f64; 4]>>,
    errors: Errors,
    alpha_rad: f64,
}

/// Angles a turn on which the peak-to-peak is taken: its parabola's top is met to 1e-5 of the amplitude.
const ANGLES: u32 = 720;
/// Steps of the search along each phase.
const SCAN: u32 = 60;
/// Best cells of the scan that are refined.
const STARTS: usize = 12;

impl PhaseStudy {
    /// A study of `errors`' e1 and e2 for an objective.
    ///
    /// # Errors
    /// [`GeometryError`] when an error is out of range.
    pub fn new(pair: &GearPair, errors: &Errors, objective: PhaseObjective) -> Result<Self, GeometryError> {
        errors.check()?;
        let curve = |value: &dyn Fn(&Errors, f64) -> f64| -> Vec<[f64; 4]> {
            (0..ANGLES)
                .map(|n| {
                    let theta1_rad = TAU * f64::from(n) / f64::from(ANGLES);
                    Errors::UNIT_ECCENTRICITIES.map(|errors| value(&errors, theta1_rad))
                })
                .collect()
        };
        let te = |direction: Direction| {
            curve(&|errors, theta1_rad| {
                common_normal::eccentricity_te_rad(pair, errors, &pair.at(theta1_rad), direction)
            })
        };
        let curves = match objective {
            PhaseObjective::Backlash => {
                vec![curve(&|errors, theta1_rad| common_normal::backlash_variation_rad(pair, errors, theta1_rad))]
            }
            PhaseObjective::TransmissionError(direction) => vec![te(direction)],
            PhaseObjective::TransmissionErrorBoth => Direction::BOTH.map(te).into(),
        };
        Ok(Self { curves, errors: *errors, alpha_rad: pair.pressure_angle_rad() })
    }

    /// The objective at given phases, rad.
    #[must_use]
    pub fn value_rad(&self, phi1_rad: f64, phi2_rad: f64) -> f64 {
        let (sin1, cos1) = phi1_rad.sin_cos();
        let (sin2, cos2) = phi2_rad.sin_cos();
        let (e1, e2) = (self.errors.e1_mm, self.errors.e2_mm);
        let weights = [e1 * cos1, e1 * sin1, e2 * cos2, e2 * sin2];
        let mut worst = 0.0_f64;
        for curve in &self.curves {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for basis in curve {
                let value =
                    basis[0] * weights[0] + basis[1] * weights[1] + basis[2] * weights[2] + basis[3] * weights[3];
                low = low.min(value);
                high = high.max(value);
            }
            worst = worst.max(high - low);
        }
        worst
    }

    fn at(&self, phi1_rad: f64, phi2_rad: f64) -> PhaseValue {
        let wrap = |angle: f64| PI - (PI - angle).rem_euclid(TAU);
        PhaseValue { phi1_rad: wrap(phi1_rad), phi2_rad: wrap(phi2_rad), value_rad: self.value_rad(phi1_rad, phi2_rad) }
    }

    /// The global minimum within the freedoms of assembly, from the phases of the errors given, and the printed prescription.
    #[must_use]
    pub fn optimal(&self, driver: PhaseFreedom, driven: PhaseFreedom) -> Phases {
        let candidates = |freedom: PhaseFreedom, start_rad: f64| -> Vec<f64> {
            match freedom {
                PhaseFreedom::Fixed => vec![start_rad],
                PhaseFreedom::Hub => (0..SCAN).map(|n| TAU * f64::from(n) / f64::from(SCAN)).collect(),
                PhaseFreedom::Index { steps } => {
                    let steps = steps.max(1);
                    (0..steps).map(|n| start_rad + TAU * f64::from(n) / f64::from(steps)).collect()
                }
            }
        };
        let seconds = candidates(driven, self.errors.phi2_rad);
        let mut scanned: Vec<PhaseValue> = candidates(driver, self.errors.phi1_rad)
            .into_iter()
            .flat_map(|phi1| seconds.iter().map(move |phi2| (phi1, *phi2)))
            .map(|(phi1, phi2)| self.at(phi1, phi2))
            .collect();
        scanned.sort_by(|a, b| a.value_rad.total_cmp(&b.value_rad));
        let free = (driver == PhaseFreedom::Hub, driven == PhaseFreedom::Hub);
        let best = scanned
            .iter()
            .take(STARTS)
            .map(|start| self.refine(*start, free))
            .min_by(|a, b| a.value_rad.total_cmp(&b.value_rad))
            .unwrap_or_else(|| self.at(self.errors.phi1_rad, self.errors.phi2_rad));
        let alpha = self.alpha_rad;
        Phases { best, published: [self.at(PI - alpha, alpha), self.at(PI - alpha, alpha + PI)] }
    }

    /// Pattern search from a start, along both phases and both diagonals: the valley of b_v runs along φ1 = φ2.
    fn refine(&self, start: PhaseValue, free: (bool, bool)) -> PhaseValue {
        let directions: Vec<(f64, f64)> = match free {
            (true, true) => {
                vec![(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, -1.0), (1.0, 0.5), (0.5, 1.0), (1.0, -0.5), (0.5, -1.0)]
            }
            (true, false) => vec![(1.0, 0.0)],
            (false, true) => vec![(0.0, 1.0)],
            (false, false) => return start,
        };
        let mut best = start;
        let mut step = PI / f64::from(SCAN);
        while step > 1e-9 {
            let better = directions
                .iter()
                .flat_map(|d| [(step * d.0, step * d.1), (-step * d.0, -step * d.1)])
                .map(|(d1, d2)| self.at(best.phi1_rad + d1, best.phi2_rad + d2))
                .min_by(|a, b| a.value_rad.total_cmp(&b.value_rad));
            match better {
                Some(better) if better.value_rad < best.value_rad => best = better,
                _ => step *= 0.5,
            }
        }
        best
    }
}

impl GearPair {
    /// Phases that make an objective smallest when both gears can be turned on their hubs, beside the printed prescription.
    ///
    /// # Errors
    /// [`GeometryError`] when an error is out of range.
    pub fn optimal_phases(&self, errors: &Errors, objective: PhaseObjective) -> Result<Phases, GeometryError> {
        Ok(PhaseStudy::new(self, errors, objective)?.optimal(PhaseFreedom::Hub, PhaseFreedom::Hub))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CircularSpec, EllipticalSpec};

    const EQUAL: Errors = Errors { e1_mm: 0.05, e2_mm: 0.05, ..Errors::NONE };

    #[test]
    fn table_of_the_backlash_over_phases() {
        // k, printed even/even, printed even/odd, true minimum, maximum, median over phases; degrees
        let table = [
            (0.0, 0.1112, 0.0405, 0.0, 0.1183, 0.0837),
            (0.2, 0.1150, 0.0429, 0.0124, 0.1227, 0.0874),
            (0.3287, 0.1221, 0.0506, 0.0222, 0.1309, 0.0945),
            (0.4, 0.1283, 0.0574, 0.0289, 0.1380, 0.1006),
            (0.6, 0.1607, 0.0916, 0.0596, 0.1756, 0.1339),
        ];
        for (k, even, odd, minimum, maximum, median) in table {
            let pair = GearPair::elliptical(&EllipticalSpec { eccentricity: k, ..Default::default() }).unwrap();
            let study = PhaseStudy::new(&pair, &EQUAL, PhaseObjective::Backlash).unwrap();
            let phases = study.optimal(PhaseFreedom::Hub, PhaseFreedom::Hub);
            let mut values: Vec<f64> = (0..72)
                .flat_map(|n| (0..72).map(move |m| (n, m)))
                .map(|(n, m)| study.value_rad(f64::from(n) * PI / 36.0, f64::from(m) * PI / 36.0))
                .collect();
            values.sort_by(f64::total_cmp);
            let close = |name: &str, value_rad: f64, expected_deg: f64, tolerance: f64| {
                let value = value_rad.to_degrees();
                assert!((value - expected_deg).abs() <= tolerance, "k = {k}, {name}: {value} {expected_deg}");
            };
            close("even/even", phases.published[0].value_rad, even, 6e-5);
            close("even/odd", phases.published[1].value_rad, odd, 6e-5);
            close("minimum", phases.best.value_rad, minimum, 6e-5);
            close("maximum", values[values.len() - 1], maximum, 6e-5);
            close("median", values[values.len() / 2], median, 4e-4);
            if k > 0.0 {
                assert!(
                    phases.best.phi1_rad.sin().abs() < 1e-3 && phases.best.phi2_rad.sin().abs() < 1e-3,
                    "{phases:?}"
                );
                assert!((phases.best.phi1_rad - phases.best.phi2_rad).sin().abs() < 1e-3);
            }
        }
    }

    #[test]
    fn less_freedom_is_never_better() {
        let pair = GearPair::circular(&CircularSpec { teeth: (30, 45), ..Default::default() }).unwrap();
        let errors = Errors { phi1_rad: 0.7, phi2_rad: 2.0, ..EQUAL };
        for objective in [
            PhaseObjective::Backlash,
            PhaseObjective::TransmissionError(Direction::Cw),
            PhaseObjective::TransmissionErrorBoth,
        ] {
            let study = PhaseStudy::new(&pair, &errors, objective).unwrap();
            let value = |driver, driven| study.optimal(driver, driven).best.value_rad;
            let fixed = value(PhaseFreedom::Fixed, PhaseFreedom::Fixed);
            let index = value(PhaseFreedom::Fixed, PhaseFreedom::Index { steps: 45 });
            let hub = value(PhaseFreedom::Fixed, PhaseFreedom::Hub);
            let both = value(PhaseFreedom::Hub, PhaseFreedom::Hub);
            assert_eq!(fixed, study.value_rad(0.7, 2.0));
            assert!(both <= hub * (1.0 + 1e-9) && hub <= index * (1.0 + 1e-9) && index <= fixed);
        }
    }
}
