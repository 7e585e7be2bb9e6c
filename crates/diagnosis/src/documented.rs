//! Takes documented effects off runs: what slipped, wore or warmed in one run stays in the next.

use std::f64::consts::TAU;

use super::nominal::{Nominal, carried_by_line};
use super::reduce::ReducedRun;
use gearmodel::effect::{MOST_LOADS, OperatingPoint, RevolutionsByLoad, Term};

impl Nominal {
    /// Takes the documented effects off runs that are in order of time and share one clock: what slipped, wore or warmed in
    /// one run stays in the next.
    pub fn take_off_effects(&self, runs: &mut [ReducedRun]) {
        let effects = &self.model().effects;
        let Some(rig) = effects.rig() else { return };
        let terms: Vec<&Term> = effects.terms().iter().filter(|term| !carried_by_line(term)).collect();
        let start_s = runs.iter().filter_map(|run| run.points.first()).map(|p| p.time_s).fold(f64::INFINITY, f64::min);
        let mut revolutions_by_load = Book::default();
        for run in runs {
            let speeds = speeds_rad_per_s(run);
            let mut before_rad = run.points.first().map_or(0.0, |point| point.theta1_rad);
            for (point, speed_rad_per_s) in run.points.iter_mut().zip(speeds) {
                revolutions_by_load.turn(point.load_nm, (point.theta1_rad - before_rad) / TAU);
                before_rad = point.theta1_rad;
                let station = OperatingPoint {
                    load_nm: point.load_nm,
                    speed_rad_per_s,
                    time_s: point.time_s - start_s,
                    way_rev: revolutions_by_load.book.way_rev.iter().sum(),
                    revolutions_by_load: revolutions_by_load.book,
                    ..rig.operating_point(point.theta1_rad, point.theta2_rad, run.direction)
                };
                point.rho_rad -= terms.iter().map(|term| term.te_rad(rig, &station)).sum::<f64>();
            }
        }
    }
}

/// Revolutions by load.
#[derive(Default)]
struct Book {
    book: RevolutionsByLoad,
    loads: usize,
}

impl Book {
    fn turn(&mut self, load_nm: f64, revolutions: f64) {
        let known = &self.book.load_nm[..self.loads];
        let nearest =
            (0..self.loads).min_by(|a, b| (known[*a] - load_nm).abs().total_cmp(&(known[*b] - load_nm).abs()));
        let slot = match nearest {
            Some(slot) if (known[slot] - load_nm).abs() <= 0.02 * load_nm.abs() || self.loads == MOST_LOADS => slot,
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
