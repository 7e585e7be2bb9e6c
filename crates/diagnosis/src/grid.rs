//! Points → revolutions × angle bins, with an operating point for every bin.
//!
//! A revolution begins where its run begins, so that n full turns are n revolutions wherever they start. Columns that are
//! the same in every revolution of a run are evaluated once a run and bin (a *cell*); columns that evolve, at every bin of
//! every revolution (a *place*).

use std::f64::consts::TAU;

use super::levels::levels;
use super::local_speed::{local_speeds, mean_speed};
use super::reduce::{Point, ReducedRun};
use super::settings::{ReductionSettings, Settings};
use gearmodel::Direction;
use gearmodel::effect::{MeasurementPlan, NominalRig, OperatingPoint, RevolutionsByLoad};

/// A revolution, or the mean of neighbouring ones.
#[derive(Clone, Debug)]
pub struct Revolution {
    /// Run.
    pub run: usize,
    /// Its places.
    pub places: std::ops::Range<usize>,
    /// Share of the turn that is covered.
    pub coverage: f64,
}

/// Residual by revolution and angle.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Revolutions, run after run.
    pub revolutions: Vec<Revolution>,
    /// Runs' senses.
    pub directions: Vec<Direction>,
    /// Operating point of every place.
    pub places: Vec<OperatingPoint>,
    /// Cell of every place.
    pub cell_of: Vec<usize>,
    /// Operating point of every cell.
    pub cells: Vec<OperatingPoint>,
    /// Part of its revolution at which every cell stands, 0 to 1.
    pub part_of_cell: Vec<f64>,
    /// Residual at every place, rad.
    pub rho_rad: Vec<f64>,
    /// Samples at every place.
    pub weight: Vec<f64>,
    /// Place of every point, run after run.
    pub place_of_point: Vec<Vec<usize>>,
    /// What the recordings cover.
    pub plan: MeasurementPlan,
    /// Bins a turn.
    pub bins: usize,
    /// Squared deviations of the samples from their place's mean, rad².
    pub within_rad2: f64,
    /// Samples in all.
    pub samples: f64,
}

/// Sums of a place.
#[derive(Clone, Copy, Default)]
struct Sum {
    weight: f64,
    time: f64,
    theta1: f64,
    theta2: f64,
    rho: f64,
    rho2: f64,
    load: f64,
    way: f64,
    /// Driver's way from the bin's middle, and its square over the samples.
    off: f64,
    off2: f64,
}

impl Sum {
    /// Mean way of the samples from the bin's middle, rad, and its variance, rad².
    fn spread(&self) -> (f64, f64) {
        let mean = self.off / self.weight;
        (mean, (self.off2 / self.weight - mean * mean).max(0.0))
    }

    fn add_spread(&mut self, weight: f64, off: f64, variance: f64) {
        self.weight += weight;
        self.off += weight * off;
        self.off2 += weight * (off * off + variance);
    }
}

impl Grid {
    /// Bins the runs' points.
    #[must_use]
    pub fn new(rig: &NominalRig, runs: &[ReducedRun], settings: &Settings) -> Self {
        let same_level = settings.reduction.same_level;
        let way_of = |run: &ReducedRun, point: &Point| (point.theta1_rad - run.points[0].theta1_rad).abs() / TAU;
        let turns: Vec<usize> = runs
            .iter()
            .map(|run| run.points.last().map_or(0, |last| (way_of(run, last) - 1e-3).max(0.0) as usize + 1))
            .collect();
        let total: usize = turns.iter().sum();
        // Revolutions may be averaged only where the driven gear closes with them.
        let closes = (rig.pair().closure() - rig.pair().closure().round()).abs() < 1e-9;
        let merge = if closes { total.div_ceil(settings.grid.most_revolutions).max(1) } else { 1 };
        let merged: usize = turns.iter().map(|n| n.div_ceil(merge)).sum();
        let bins =
            (settings.grid.most_places / merged.max(1)).clamp(settings.grid.fewest_bins, settings.grid.most_bins);

        let start_s = runs.iter().filter_map(|run| run.points.first()).map(|p| p.time_s).fold(f64::INFINITY, f64::min);
        let loads_nm = levels(runs.iter().flat_map(|run| run.points.iter().map(|p| p.load_nm)), same_level);
        let mut revolutions_by_load = RevolutionsByLoad::at_loads(&loads_nm);
        let mut order: Vec<usize> = (0..runs.len()).filter(|n| !runs[*n].points.is_empty()).collect();
        order.sort_by(|a, b| runs[*a].points[0].time_s.total_cmp(&runs[*b].points[0].time_s));

        let mut grid = Self {
            revolutions: Vec::new(),
            directions: Vec::new(),
            places: Vec::new(),
            cell_of: Vec::new(),
            cells: Vec::new(),
            part_of_cell: Vec::new(),
            rho_rad: Vec::new(),
            weight: Vec::new(),
            place_of_point: vec![Vec::new(); runs.len()],
            plan: MeasurementPlan::default(),
            bins,
            within_rad2: runs.iter().map(|run| run.within_rad2).sum(),
            samples: runs.iter().map(|run| run.samples).sum(),
        };
        let mut speeds = Vec::new();
        let mut end_s = start_s;
        for n in order {
            let run = &runs[n];
            let (first, last) = (run.points[0], run.points[run.points.len() - 1]);
            end_s = end_s.max(last.time_s);
            let mean_speed = mean_speed(run);
            let nominal = run.direction.sign() * run.speed_rpm * TAU / 60.0;
            let speed = if run.speed_rpm > 0.0 { nominal } else { mean_speed };
            speeds.push(speed.abs());
            grid.plan.starts_s.push(first.time_s - start_s);
            grid.plan.senses[usize::from(run.direction == Direction::Cw)] = true;
            grid.plan.revolutions += way_of(run, &last);
            grid.add_run(
                rig,
                run,
                n,
                &RunFrame { turns: turns[n], merge, closes, start_s, mean_speed, settings: &settings.reduction },
                &mut revolutions_by_load,
            );
        }
        grid.plan.runs = grid.directions.len();
        grid.plan.loads_nm = loads_nm;
        grid.plan.speeds_rad_per_s = levels(speeds.into_iter(), same_level);
        grid.plan.duration_s = end_s - start_s;
        grid.plan.turns = [|at: &OperatingPoint| at.theta1_rad, |at: &OperatingPoint| at.theta2_rad].map(
            |angle: fn(&OperatingPoint) -> f64| {
                let (low, high) = grid
                    .places
                    .iter()
                    .map(angle)
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
                ((high - low) / TAU).clamp(0.0, 1.0)
            },
        );
        grid
    }

    /// Turns between the least and the largest angle of the driver.
    #[must_use]
    pub fn span_rev(&self) -> f64 {
        let (low, high) = self
            .places
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), at| (l.min(at.theta1_rad), h.max(at.theta1_rad)));
        (high - low) / TAU
    }

    fn add_run(
        &mut self,
        rig: &NominalRig,
        run: &ReducedRun,
        number: usize,
        frame: &RunFrame<'_>,
        revolutions_by_load: &mut RevolutionsByLoad,
    ) {
        let index = self.directions.len();
        self.directions.push(run.direction);
        let bins = self.bins;
        let revolutions = frame.turns.div_ceil(frame.merge).max(1);
        let binned = Binned::new(rig, run, frame, [revolutions, bins], revolutions_by_load);
        let steady = frame.closes && steady_load(&run.points, frame.settings.same_level);
        let mut place_of_key = vec![usize::MAX; binned.sums.len()];
        let mut cell_of_bin = vec![usize::MAX; bins];
        let first_cell = self.cells.len();
        // Way of a cell's first operating point from the bin's middle, and the ways of all of its places.
        let mut cell_sums: Vec<(f64, Sum)> = Vec::new();
        for revolution in 0..revolutions {
            let first = self.places.len();
            for (bin, cell) in cell_of_bin.iter_mut().enumerate() {
                let key = revolution * bins + bin;
                let sum = binned.sums[key];
                if sum.weight == 0.0 {
                    continue;
                }
                let at = OperatingPoint { run: index, ..binned.operating_point(key, rig, run.direction) };
                let (off_rad, variance_rad2) = sum.spread();
                if !steady || *cell == usize::MAX {
                    *cell = self.cells.len();
                    self.cells.push(at);
                    self.part_of_cell.push((bin as f64 + 0.5) / bins as f64);
                    cell_sums.push((off_rad, Sum::default()));
                }
                cell_sums[*cell - first_cell].1.add_spread(sum.weight, off_rad, variance_rad2);
                place_of_key[key] = self.places.len();
                self.places.push(at);
                self.cell_of.push(*cell);
                self.rho_rad.push(sum.rho / sum.weight);
                self.weight.push(sum.weight);
                self.within_rad2 += (sum.rho2 - sum.rho * sum.rho / sum.weight).max(0.0);
            }
            let places = first..self.places.len();
            if !places.is_empty() {
                let coverage = places.len() as f64 / bins as f64;
                self.revolutions.push(Revolution { run: index, places, coverage });
            }
        }
        // A cell stands for its places of all revolutions: where their samples lie in the mean, and as far about it as they do.
        for (cell, (first_rad, sum)) in self.cells[first_cell..].iter_mut().zip(cell_sums) {
            let (mean_rad, variance_rad2) = sum.spread();
            let step_rad = run.direction.sign() * (mean_rad - first_rad);
            let (theta1_rad, theta2_rad) = (cell.theta1_rad + step_rad, cell.theta2_rad + cell.ratio * step_rad);
            cell.take_angles_of(&rig.operating_point(theta1_rad, theta2_rad, run.direction));
            cell.spread_rad = variance_rad2.sqrt();
        }
        self.place_of_point[number] = binned.keys.into_iter().map(|key| place_of_key[key]).collect();
    }
}

/// A run's points by revolution and bin; the key of a bin is its number in the run.
struct Binned {
    /// Key of every point.
    keys: Vec<usize>,
    sums: Vec<Sum>,
    /// Weighted sums of speeds, and of the revolutions driven so far.
    speeds: Vec<f64>,
    revolutions_by_load: Vec<RevolutionsByLoad>,
}

impl Binned {
    fn new(
        rig: &NominalRig,
        run: &ReducedRun,
        frame: &RunFrame<'_>,
        [revolutions, bins]: [usize; 2],
        revolutions_by_load: &mut RevolutionsByLoad,
    ) -> Self {
        let mut binned = Self {
            keys: Vec::with_capacity(run.points.len()),
            sums: vec![Sum::default(); revolutions * bins],
            speeds: vec![0.0; revolutions * bins],
            revolutions_by_load: vec![RevolutionsByLoad::at_loads(&revolutions_by_load.load_nm); revolutions * bins],
        };
        let origin_rad = run.points[0].theta1_rad;
        let speeds = local_speeds(&run.points, frame.mean_speed, frame.settings);
        let mut before = origin_rad;
        for (point, speed) in run.points.iter().zip(&speeds) {
            revolutions_by_load.turn(point.load_nm, (point.theta1_rad - before) / TAU);
            before = point.theta1_rad;
            // Bins count from where the run begins, so that none holds both ends of a revolution.
            let way_rev = (point.theta1_rad - origin_rad).abs() / TAU;
            let turn = (way_rev as usize).min(frame.turns - 1);
            let bin = (((way_rev - turn as f64).clamp(0.0, 1.0) * bins as f64) as usize).min(bins - 1);
            let key = turn / frame.merge * bins + bin;
            binned.keys.push(key);
            let w = point.samples;
            // Means of the first turn's angles stand for all turns of a merged revolution.
            let turns_away = ((point.theta1_rad - origin_rad) / TAU).trunc() * f64::from(u8::from(frame.merge > 1));
            let sum = &mut binned.sums[key];
            let middle_rev = turn as f64 + (bin as f64 + 0.5) / bins as f64;
            sum.add_spread(w, (way_rev - middle_rev) * TAU, point.spread_rad2);
            sum.time += w * (point.time_s - frame.start_s);
            sum.theta1 += w * (point.theta1_rad - TAU * turns_away);
            sum.theta2 += w * (point.theta2_rad - TAU * turns_away * rig.pair().closure());
            sum.rho += w * point.rho_rad;
            sum.rho2 += w * point.rho_rad * point.rho_rad;
            sum.load += w * point.load_nm;
            sum.way += w * revolutions_by_load.total_way_rev();
            binned.speeds[key] += w * speed;
            let so_far = &mut binned.revolutions_by_load[key];
            for slot in 0..revolutions_by_load.load_nm.len() {
                so_far.signed_rev[slot] += w * revolutions_by_load.signed_rev[slot];
                so_far.way_rev[slot] += w * revolutions_by_load.way_rev[slot];
            }
        }
        binned
    }

    /// Mean operating point of a bin.
    fn operating_point(&self, key: usize, rig: &NominalRig, direction: Direction) -> OperatingPoint {
        let sum = &self.sums[key];
        let w = sum.weight;
        let so_far = &self.revolutions_by_load[key];
        OperatingPoint {
            load_nm: sum.load / w,
            time_s: sum.time / w,
            way_rev: sum.way / w,
            speed_rad_per_s: self.speeds[key] / w,
            spread_rad: sum.spread().1.sqrt(),
            revolutions_by_load: RevolutionsByLoad {
                load_nm: so_far.load_nm,
                signed_rev: so_far.signed_rev.map(|x| x / w),
                way_rev: so_far.way_rev.map(|x| x / w),
            },
            ..rig.operating_point(sum.theta1 / w, sum.theta2 / w, direction)
        }
    }
}

/// What a run's binning needs beside its points.
struct RunFrame<'a> {
    turns: usize,
    merge: usize,
    closes: bool,
    start_s: f64,
    mean_speed: f64,
    settings: &'a ReductionSettings,
}

/// Whether a run keeps its load within a part of its largest.
fn steady_load(points: &[Point], same_level: f64) -> bool {
    let (low, high) = points
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p.load_nm), high.max(p.load_nm)));
    high - low <= same_level * high.abs().max(low.abs()).max(1e-9)
}
