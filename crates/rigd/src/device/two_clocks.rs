//! Two encoder readers have two clocks: each is fitted to the host's (offset and drift), and what is left is an uncertainty of TE.
//!
//! A line of a reader carries its own time and arrives at the host some time later: never earlier. The host time of a reader's tick
//! is therefore the line below all arrivals that is closest to them; it is an edge of their lower convex hull (Moon, Skelly and Towsley,
//! *Estimation and removal of clock skew from network delay measurements*, INFOCOM 1999). A mean would follow the host's own stalls.

use thiserror::Error;

/// Arrivals that a fit needs at least.
const FEWEST: usize = 50;

/// A reader's clock against the host's: host_s = offset_s + ticks · seconds_per_tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockFit {
    /// Host time of tick 0, s.
    pub offset_s: f64,
    /// Host seconds a tick.
    pub seconds_per_tick: f64,
    /// How far the fits of both halves of the arrivals lie apart at their middle, s: how well the line is known.
    pub repeatability_s: f64,
    /// Arrivals used.
    pub arrivals: usize,
}

/// Why there is no fit.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ClockError {
    /// Too few.
    #[error(
        "{found} lines are too few to fit a reader's clock, {FEWEST} are needed: wait, or raise its streaming rate"
    )]
    TooFew {
        /// How many there are.
        found: usize,
    },
    /// The reader's time does not run.
    #[error("the reader's time stamps do not run on: switch them on (end of response 15h, bit 2)")]
    Standing,
}

impl ClockFit {
    /// Fits arrivals (ticks, host s), in the order of arrival.
    ///
    /// # Errors
    /// [`ClockError`] when they are too few or the reader's time stands.
    pub fn of(arrivals: &[(f64, f64)]) -> Result<Self, ClockError> {
        if arrivals.len() < FEWEST {
            return Err(ClockError::TooFew { found: arrivals.len() });
        }
        let whole = below(arrivals).ok_or(ClockError::Standing)?;
        let (early, late) = arrivals.split_at(arrivals.len() / 2);
        let middle = early.last().map_or(0.0, |(ticks, _)| *ticks);
        let apart = match (below(early), below(late)) {
            (Some(early), Some(late)) => (early.at(middle) - late.at(middle)).abs(),
            _ => return Err(ClockError::Standing),
        };
        Ok(Self {
            offset_s: whole.at(0.0),
            seconds_per_tick: whole.slope,
            repeatability_s: apart,
            arrivals: arrivals.len(),
        })
    }

    /// Host time of a tick, s.
    #[must_use]
    pub fn host_s(&self, ticks: f64) -> f64 {
        self.offset_s + ticks * self.seconds_per_tick
    }

    /// Drift against a nominal tick, parts per million.
    #[must_use]
    pub fn drift_ppm(&self, nominal_s: f64) -> f64 {
        (self.seconds_per_tick / nominal_s - 1.0) * 1e6
    }
}

#[derive(Clone, Copy)]
struct Line {
    x: f64,
    y: f64,
    slope: f64,
}

impl Line {
    fn at(self, x: f64) -> f64 {
        self.y + (x - self.x) * self.slope
    }
}

/// The line below all points that is closest to them: the edge of the lower hull above their mean.
fn below(points: &[(f64, f64)]) -> Option<Line> {
    let mut hull: Vec<(f64, f64)> = Vec::new();
    for &point in points {
        if hull.last().is_some_and(|last| point.0 <= last.0) {
            // The same tick again: the earlier arrival is the better.
            continue;
        }
        let turns = |a: (f64, f64), b: (f64, f64)| (b.0 - a.0) * (point.1 - a.1) - (b.1 - a.1) * (point.0 - a.0) <= 0.0;
        while hull.len() >= 2 && turns(hull[hull.len() - 2], hull[hull.len() - 1]) {
            hull.pop();
        }
        hull.push(point);
    }
    let mean = points.iter().map(|(x, _)| x).sum::<f64>() / points.len() as f64;
    let edge = hull.windows(2).find(|edge| edge[1].0 >= mean)?;
    let (a, b) = (edge[0], edge[1]);
    Some(Line { x: a.0, y: a.1, slope: (b.1 - a.1) / (b.0 - a.0) })
}

/// How well the two readers' times are known against each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skew {
    /// Standard uncertainty of the time between them, s.
    pub uncertainty_s: f64,
}

impl Skew {
    /// Of two fits. `tick_s` is the readers' time step; `asymmetry_s` is by how much their shortest ways to the host may differ (USB full
    /// speed: a frame of 1 ms), which no fit can see. Both count as uniform, a width w as w/√12; steps of both readers.
    #[must_use]
    pub fn between(input: &ClockFit, output: &ClockFit, tick_s: f64, asymmetry_s: f64) -> Self {
        let uniform = |width: f64| width / 12_f64.sqrt();
        let parts = [
            input.repeatability_s,
            output.repeatability_s,
            uniform(tick_s),
            uniform(tick_s),
            uniform(2.0 * asymmetry_s),
        ];
        Self { uncertainty_s: parts.iter().map(|part| part * part).sum::<f64>().sqrt() }
    }

    /// What it is worth in TE, rad: TE = θ2(t + dt) − f(θ1(t)) departs by ω2·dt, and ω2 = f′·ω1 is largest at the steepest place.
    #[must_use]
    pub fn te_uncertainty_rad(&self, input_rpm: f64, steepest_ratio: f64) -> f64 {
        input_rpm.abs() * std::f64::consts::TAU / 60.0 * steepest_ratio.abs() * self.uncertainty_s
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    const TICK_S: f64 = 1.0 / 512.0;

    /// Arrivals of a clock that is `offset_s` off and drifts, each late by 0.3 ms and more, now and then by much.
    fn arrivals(offset_s: f64, drift_ppm: f64, seed: u64) -> Vec<(f64, f64)> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        (0..5000)
            .map(|n| {
                let ticks = f64::from(n);
                let stall = if random.random::<f64>() < 0.02 { 0.05 * random.random::<f64>() } else { 0.0 };
                let late = 0.3e-3 + 1e-3 * random.random::<f64>() + stall;
                (ticks, offset_s + ticks * TICK_S * (1.0 + drift_ppm * 1e-6) + late)
            })
            .collect()
    }

    #[test]
    fn offset_and_drift_are_found_under_stalls() {
        let fit = ClockFit::of(&arrivals(12.5, 80.0, 1)).expect("fits");
        assert!((fit.drift_ppm(TICK_S) - 80.0).abs() < 2.0, "{} ppm", fit.drift_ppm(TICK_S));
        // The shortest way of 0.3 ms is no part of what can be seen.
        assert!((fit.host_s(2500.0) - (12.5 + 2500.0 * TICK_S * 1.00008 + 0.3e-3)).abs() < 20e-6);
        assert!(fit.repeatability_s < 50e-6, "{}", fit.repeatability_s);
    }

    #[test]
    fn the_skew_between_two_readers_lies_within_its_uncertainty() {
        for seed in 0..20 {
            let input = ClockFit::of(&arrivals(3.0, -40.0, 2 * seed)).expect("fits");
            let output = ClockFit::of(&arrivals(3.0, -40.0, 2 * seed + 1)).expect("fits");
            let skew = Skew::between(&input, &output, TICK_S, 0.0);
            let error = (input.host_s(2500.0) - output.host_s(2500.0)).abs();
            assert!(error < 3.0 * skew.uncertainty_s, "seed {seed}: {error} against {}", skew.uncertainty_s);
        }
    }

    #[test]
    fn te_uncertainty_grows_with_speed_and_ratio_and_says_why_two_clocks_are_no_counter_box() {
        let skew = Skew { uncertainty_s: 1e-3 };
        let at = |rpm, ratio| skew.te_uncertainty_rad(rpm, ratio);
        // 5 rpm is 0.5236 rad/s: a millisecond is 524 µrad.
        assert!((at(5.0, 1.0) - 523.6e-6).abs() < 0.1e-6);
        assert_eq!(at(10.0, 1.0), 2.0 * at(5.0, 1.0));
        assert_eq!(at(-5.0, 2.0), 2.0 * at(5.0, 1.0));
        assert_eq!(at(0.0, 1.0), 0.0);
    }

    #[test]
    fn too_little_and_standing_clocks_are_refused() {
        assert_eq!(ClockFit::of(&arrivals(0.0, 0.0, 1)[..10]), Err(ClockError::TooFew { found: 10 }));
        let standing: Vec<(f64, f64)> = (0..100).map(|n| (7.0, f64::from(n))).collect();
        assert_eq!(ClockFit::of(&standing), Err(ClockError::Standing));
    }
}
