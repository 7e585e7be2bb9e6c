//! What the nominal model predicts at a sample, exact where teeth are known.

use std::f64::consts::TAU;

use super::predict::Condition;
use super::reduce::ReducedRun;
use crate::Direction;
use crate::contact::ContactModel;
use crate::effect::{Carrier, LEDGER_LOADS, Ledger, Rig, Station, Term};
use crate::increment::common_normal;

/// Angles a turn at which exact contact is tabulated against the first order.
const STEPS: usize = 1440;

/// The rig's model with a table of what exact contact adds to the first order.
#[derive(Clone, Debug)]
pub struct Nominal {
    rig: Rig,
    /// Exact less first-order TE over a turn of the driver, rad, ccw then cw; empty where it cannot be tabulated.
    correction_rad: [Vec<f64>; 2],
}

impl Nominal {
    /// Tabulates exact contact where the driven gear closes with the driver's turn; elsewhere the first order stands.
    #[must_use]
    pub fn new(rig: Rig) -> Self {
        let pair = rig.pair();
        let errors = rig.model().errors;
        let closes = (pair.closure() - pair.closure().round()).abs() < 1e-12;
        let displaced = errors.e1_mm != 0.0 || errors.e2_mm != 0.0;
        let exact =
            (closes && displaced && pair.has_teeth()).then(|| ContactModel::new(pair.clone(), &errors).ok()).flatten();
        let correction_rad = Direction::BOTH.map(|direction| {
            let Some(exact) = &exact else { return Vec::new() };
            (0..STEPS)
                .map(|step| {
                    let theta1_rad = TAU * step as f64 / STEPS as f64;
                    let first_order_rad = common_normal::te_rad(pair, &errors, theta1_rad, direction);
                    // Where no pair is within its tips the first order stands.
                    exact.te_rad(theta1_rad, direction).map_or(0.0, |te_rad| te_rad - first_order_rad)
                })
                .collect()
        });
        Self { rig, correction_rad }
    }

    /// The rig.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Notes the encoders' lines.
    pub fn set_lines(&mut self, lines: [Option<f64>; 2]) {
        self.rig.lines = lines;
    }

    /// Nominal TE of pair and errors, without documented effects, rad: those are taken off by [`Nominal::take_off_effects`].
    #[must_use]
    pub fn te_rad(&self, theta1_rad: f64, direction: Direction, load_nm: f64) -> f64 {
        let table = &self.correction_rad[usize::from(direction == Direction::Cw)];
        let correction_rad = if table.is_empty() {
            0.0
        } else {
            let place = (theta1_rad / TAU).rem_euclid(1.0) * STEPS as f64;
            let (low, part) = (place as usize % STEPS, place.fract());
            table[low] + part * (table[(low + 1) % STEPS] - table[low])
        };
        let model = self.rig.model();
        model.te_at_rad(&model.pair.at(theta1_rad), direction, load_nm) + correction_rad
    }
    /// Nominal TE with its documented effects, rad.
    #[must_use]
    pub fn te_under_rad(&self, theta1_rad: f64, under: &Condition) -> f64 {
        self.te_rad(theta1_rad, under.direction, under.load_nm) + self.rig.model().effects_te_rad(theta1_rad, under)
    }

    /// Documented sub-divisional errors of the encoders, which are taken off sample by sample.
    pub(super) fn line_errors(&self) -> impl Iterator<Item = &Term> {
        self.rig.model().effects.terms().iter().filter(|term| carried_by_line(term))
    }

    /// Takes the documented effects off runs that are in order of time and share one clock: what slipped, wore or warmed in
    /// one run stays in the next.
    pub fn take_off_effects(&self, runs: &mut [ReducedRun]) {
        let effects = &self.rig.model().effects;
        let Some(rig) = effects.rig() else { return };
        let terms: Vec<&Term> = effects.terms().iter().filter(|term| !carried_by_line(term)).collect();
        let start_s = runs.iter().filter_map(|run| run.points.first()).map(|p| p.time_s).fold(f64::INFINITY, f64::min);
        let mut ledger = Book::default();
        for run in runs {
            let speeds = speeds_rad_per_s(run);
            let mut before_rad = run.points.first().map_or(0.0, |point| point.theta1_rad);
            for (point, speed_rad_per_s) in run.points.iter_mut().zip(speeds) {
                ledger.turn(point.load_nm, (point.theta1_rad - before_rad) / TAU);
                before_rad = point.theta1_rad;
                let station = Station {
                    load_nm: point.load_nm,
                    speed_rad_per_s,
                    time_s: point.time_s - start_s,
                    way_rev: ledger.book.way_rev.iter().sum(),
                    ledger: ledger.book,
                    ..rig.station(point.theta1_rad, point.theta2_rad, run.direction)
                };
                point.rho_rad -= terms.iter().map(|term| term.te_rad(rig, &station)).sum::<f64>();
            }
        }
    }
}

fn carried_by_line(term: &Term) -> bool {
    term.effect.signature().carrier == Carrier::EncoderLine
}

/// Revolutions by load.
#[derive(Default)]
struct Book {
    book: Ledger,
    loads: usize,
}

impl Book {
    fn turn(&mut self, load_nm: f64, revolutions: f64) {
        let known = &self.book.load_nm[..self.loads];
        let nearest =
            (0..self.loads).min_by(|a, b| (known[*a] - load_nm).abs().total_cmp(&(known[*b] - load_nm).abs()));
        let slot = match nearest {
            Some(slot) if (known[slot] - load_nm).abs() <= 0.02 * load_nm.abs() || self.loads == LEDGER_LOADS => slot,
            _ => {
                self.book.load_nm[self.loads] = load_nm;
                self.loads += 1;
                self.loads - 1
            }
        };
        self.book.signed_rev[slot] += revolutions;
        self.book.way_rev[slot] += revolutions.abs();
    }
}

/// Driver speed at every point over a hundredth of a turn about it, signed, rad/s; the set-point's where that says nothing.
fn speeds_rad_per_s(run: &ReducedRun) -> Vec<f64> {
    const HALF: usize = 7;
    let (Some(first), Some(last)) = (run.points.first(), run.points.last()) else { return Vec::new() };
    let mean = (last.theta1_rad - first.theta1_rad) / (last.time_s - first.time_s);
    let mean = if mean.is_finite() { mean } else { run.direction.sign() * run.speed_rpm * TAU / 60.0 };
    (0..run.points.len())
        .map(|n| {
            let low = run.points[n.saturating_sub(HALF)];
            let high = run.points[(n + HALF).min(run.points.len() - 1)];
            let speed = (high.theta1_rad - low.theta1_rad) / (high.time_s - low.time_s);
            // A pause or a gap inside says nothing about the speed.
            if speed.is_finite() && (speed / mean - 1.0).abs() < 0.5 { speed } else { mean }
        })
        .collect()
}
