//! What the angle does not carry: steps of one size, tones in time, knocks.
//!
//! Steps are looked for on means over sectors of a revolution: the residual stands at level c + Δ·k with k never falling, found by
//! dynamic programming for each step size Δ, once with a free level a run (what the conditions do to the level cannot hide or
//! feign a step) and once with one level for all. Tones and knocks are looked for in what differs between revolutions of
//! one condition.

use nalgebra::{Cholesky, SMatrix, SVector};
use rayon::prelude::*;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::design_matrix::DesignMatrix;
use super::grid::Grid;
use super::noise::Noise;
use super::nuisance_patterns::Pattern;
use super::reduce::{Point, ReducedRun};
use super::sectors::{SECTORS, Sector, sectors};
use super::waves::{WAVES, waves};
use gearmodel::effect::Rig;
use std::f64::consts::TAU;

/// What a step costs on the way through the sectors, nats: its place is open.
const STEP_NATS: f64 = 4.0;
/// What steps cost as an effect, nats: to look for them, and each, whose place was chosen to a fraction of a degree.
const STEPS_COST_NATS: [f64; 2] = [8.0, 6.5];
/// Steps up to which those at the edges of runs are moved off them: more speak for one another.
const FEW_STEPS: usize = 3;
/// Times that steps are moved.
const SETTLING_PASSES: usize = 3;
/// Most single steps of any size looked for, and the evidence from which one is taken into the design matrix, nats.
const SINGLE_STEPS: usize = 3;
const SINGLE_STEP_NATS: f64 = 14.0;
/// Evidence from which steps are taken into the design matrix, nats.
const STEPS_FOUND_NATS: f64 = 8.0;
/// What the time of such a step costs, nats, in a run and between two: something happens as readily in one of the few pauses.
const IN_RUN_NATS: f64 = 6.0;
const IN_PAUSE_NATS: f64 = 3.0;
/// Most steps followed, and most from one sector to the next.
const MOST_STEPS: usize = 96;
const PAD: usize = 2;
/// Step sizes tried: 1.5 µrad to 1.2 mrad.
const SIZES: usize = 30;
const SMALLEST_RAD: f64 = 1.5e-6;
/// Ratio of neighbouring sizes.
const SIZE_RATIO: f64 = 1.26;
/// Most steps that a rise is shared out to.
const MOST_SHARED: u32 = 32;
/// Frequencies of the search for tones.
const TONE_STEPS: usize = 1 << 17;
/// Log odds from which a tone is taken into the design matrix.
const TONE_NATS: f64 = 6.0;
/// The same below a few turns' frequency, where the scatter is not white.
const LOW_TONE_NATS: f64 = 60.0;
/// Most tones taken off.
const MOST_TONES: usize = 3;
/// Neighbours on either side that a tone must stand out of.
const NEIGHBOURS: usize = 100;
/// Part of the scatter that a tone must make.
const LEAST_TONE_SHARE: f64 = 0.002;

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Events {
    /// Single steps of any size.
    pub patterns: Vec<Pattern>,
    /// Times of steps, s since the campaign's start.
    pub steps: Vec<Vec<f64>>,
}

/// What so many steps cost as an effect, nats: which of the places came first does not matter.
pub(super) fn steps_cost_nats(steps: usize) -> f64 {
    let orders: f64 = (1..=steps).map(|n| (n as f64).ln()).sum();
    STEPS_COST_NATS[0] + STEPS_COST_NATS[1] * steps as f64 - orders
}

/// Looks for steps in what a model (column, amplitude) leaves; `steady` is the same without what accumulates, which could
/// have taken the steps for a drift.
#[must_use]
pub fn find(
    grid: &Grid,
    design: &DesignMatrix,
    noise: &Noise,
    amplitudes: &[(usize, f64)],
    steady: &[(usize, f64)],
) -> Events {
    let mut found = Events::default();
    let mut look = |rest: &[f64]| {
        let sectors = sectors(grid, noise, rest);
        for tied in [false, true] {
            for (times_s, size_rad) in find_steps(&sectors, tied) {
                let mut times_s = sharpen(grid, rest, &times_s, size_rad);
                if times_s.len() <= FEW_STEPS {
                    times_s.iter_mut().for_each(|time_s| *time_s = off_the_edges(grid, *time_s));
                }
                if !found.steps.contains(&times_s) {
                    found.steps.push(times_s);
                }
            }
        }
        found.patterns.extend(single_steps(grid, &sectors, rest));
    };
    look(&design.rest(grid, amplitudes));
    if steady.len() < amplitudes.len() {
        look(&design.rest(grid, steady));
    }
    found
}

/// A step's time, moved to between two runs where it stands so near the end of one that it would only take off what is there.
fn off_the_edges(grid: &Grid, time_s: f64) -> f64 {
    let starts_s = &grid.plan.starts_s;
    let run = starts_s.partition_point(|start_s| *start_s <= time_s);
    let begins_s = run.checked_sub(1).map(|n| starts_s[n]);
    let (Some(begins_s), Some(next_s)) = (begins_s, starts_s.get(run)) else { return time_s };
    let speed = grid.places.iter().find(|place| place.run + 1 == run).map_or(0.0, |place| place.speed_rad_per_s.abs());
    let sector_s = TAU / SECTORS as f64 / speed;
    let last_s = grid.places.iter().filter(|place| place.run + 1 == run).map(|p| p.time_s).fold(begins_s, f64::max);
    if time_s + sector_s > last_s {
        *next_s
    } else if time_s - sector_s < begins_s {
        begins_s
    } else {
        time_s
    }
}

/// Steps of any size, one after the other, each where it takes most off the sectors' residual; one that is undone later counts as two.
fn single_steps(grid: &Grid, sectors: &[Sector], rest: &[f64]) -> Vec<Pattern> {
    let mut left: Vec<f64> = sectors.iter().map(|s| s.mean_rad).collect();
    let mut found = Vec::new();
    for _ in 0..SINGLE_STEPS {
        let sums = Sums::new(sectors, &left);
        let end = sectors.len();
        let stays = (1..end).map(|from| sums.segment(from, end));
        let goes_back = (1..end).flat_map(|from| (from + SECTORS / 2..end).map(move |until| (from, until)));
        let goes_back = goes_back.map(|(from, until)| sums.segment(from, until));
        let most = |a: &Segment, b: &Segment| a.gain.total_cmp(&b.gain);
        let (Some(once), back) = (stays.max_by(most), goes_back.max_by(most)) else { break };
        let best = back.filter(|back| back.gain > once.gain + SINGLE_STEP_NATS).unwrap_or(once);
        if best.gain < SINGLE_STEP_NATS {
            break;
        }
        let sharp = |at: usize, step_rad: f64| sharpen(grid, rest, &[sectors[at].start_s], step_rad)[0];
        let cost_nats = |at: usize| if sectors[at].run == sectors[at - 1].run { IN_RUN_NATS } else { IN_PAUSE_NATS };
        let time_s = sharp(best.from, best.step_rad);
        found.push(if best.until < end {
            let until_s = sharp(best.until, -best.step_rad);
            Pattern::Step { time_s, until_s, cost_nats: cost_nats(best.from) + cost_nats(best.until) }
        } else {
            Pattern::Step { time_s, until_s: f64::INFINITY, cost_nats: cost_nats(best.from) }
        });
        left[best.from..best.until].iter_mut().for_each(|y| *y -= best.step_rad);
    }
    found
}

/// Sectors that stand off the others.
struct Segment {
    from: usize,
    until: usize,
    /// By how much, rad.
    step_rad: f64,
    /// Evidence for it, nats.
    gain: f64,
}

/// Sums of the weights and weighted values of all sectors before each.
struct Sums(Vec<[f64; 2]>);

impl Sums {
    fn new(sectors: &[Sector], values: &[f64]) -> Self {
        let mut sums = vec![[0.0; 2]];
        for (sector, value) in sectors.iter().zip(values) {
            let [weight, sum] = sums[sums.len() - 1];
            sums.push([weight + 1.0 / sector.variance_rad2, sum + value / sector.variance_rad2]);
        }
        Self(sums)
    }

    fn segment(&self, from: usize, until: usize) -> Segment {
        // Neighbouring sectors of a turn share its level: as many independent values as half turns.
        let share = 2.0 / SECTORS as f64;
        let [total, sum] = self.0[self.0.len() - 1];
        let [inside, inside_sum] = [0, 1].map(|n| self.0[until][n] - self.0[from][n]);
        let outside = total - inside;
        let step_rad = inside_sum / inside - (sum - inside_sum) / outside;
        let gain = 0.5 * share * step_rad * step_rad * inside * outside / total;
        Segment { from, until, step_rad, gain }
    }
}

/// Where among weighted values a step of a given size stands best: the first value that it raises.
fn edge(values: impl Iterator<Item = (f64, f64)> + Clone, step_rad: f64) -> usize {
    let (total, sum) = values.clone().fold((0.0, 0.0), |(total, sum), (w, y)| (total + w, sum + w * y));
    let mean = sum / total;
    let (mut after_weight, mut before_sum) = (total, 0.0);
    let mut best = (f64::NEG_INFINITY, 0);
    for (n, (weight, value)) in values.enumerate() {
        // Least squares with a free level: gain = 2Δ Σ_after (e − mean) − Δ² w_after w_before/w, and Σ_after = −Σ_before.
        let gain = -2.0 * step_rad * before_sum - step_rad * step_rad * after_weight * (total - after_weight) / total;
        if gain > best.0 {
            best = (gain, n);
        }
        after_weight -= weight;
        before_sum += weight * (value - mean);
    }
    best.1
}

/// Moves each step to where the places about it say: a step has a sharp edge, and one that lies off by a sector fits worse
/// than none.
fn sharpen(grid: &Grid, rest: &[f64], times_s: &[f64], size_rad: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..grid.places.len()).collect();
    order.sort_by(|a, b| grid.places[*a].time_s.total_cmp(&grid.places[*b].time_s));
    let half = grid.bins / SECTORS * 3 / 2;
    let mut found: Vec<f64> = times_s
        .iter()
        .enumerate()
        .map(|(n, time_s)| {
            let centre = order.partition_point(|p| grid.places[*p].time_s < *time_s);
            // Not past the neighbouring steps: each window holds one edge.
            let bound = |other: Option<&f64>, open: usize| {
                other
                    .filter(|t| (*t - time_s).abs() > 1e-9)
                    .map_or(open, |t| order.partition_point(|p| grid.places[*p].time_s < 0.5 * (t + time_s)))
            };
            let low = bound(n.checked_sub(1).and_then(|m| times_s.get(m)), 0).max(centre.saturating_sub(half));
            let high = bound(times_s.get(n + 1), order.len()).min(centre + half);
            if high < low + 8 {
                return *time_s;
            }
            let window = &order[low..high];
            // Size of all steps at this time.
            let together = times_s.iter().filter(|t| (*t - time_s).abs() < 1e-9).count() as f64;
            let step_rad = size_rad * together;
            let at = low + edge(window.iter().map(|p| (grid.weight[*p], rest[*p])), step_rad);
            let at = at.clamp(1, order.len() - 1);
            0.5 * (grid.places[order[at - 1]].time_s + grid.places[order[at]].time_s)
        })
        .collect();
    found.sort_by(f64::total_cmp);
    found
}

/// Moves steps of one size, one after the other, to where the sectors of a residual want them while the others stay. Without a size it is
/// that which they have where they stand.
pub(super) fn settle(grid: &Grid, noise: &Noise, rest: &[f64], times_s: &[f64], size_rad: Option<f64>) -> Vec<f64> {
    let sectors = sectors(grid, noise, rest);
    let size_of = |times_s: &[f64]| {
        let so_far = |s: &Sector| times_s.iter().filter(|t| **t <= s.middle_s).count();
        size_rad
            .unwrap_or_else(|| level_cost_with_size(&sectors, true, &sectors.iter().map(so_far).collect::<Vec<_>>()).2)
    };
    let mut times_s = times_s.to_vec();
    for _ in 0..SETTLING_PASSES {
        let (before, size_rad) = (times_s.clone(), size_of(&times_s));
        for n in 0..times_s.len() {
            let without = |s: &Sector| {
                let others = times_s.iter().enumerate().filter(|(m, t)| *m != n && **t <= s.middle_s).count();
                s.mean_rad - size_rad * others as f64
            };
            let at = edge(sectors.iter().map(|s| (1.0 / s.variance_rad2, without(s))), size_rad);
            times_s[n] = sectors[at].start_s;
        }
        times_s.sort_by(f64::total_cmp);
        if times_s == before {
            break;
        }
    }
    sharpen(grid, rest, &times_s, size_of(&times_s))
}

/// Times of steps of one size and the size, where they are worth their cost; at most two such sets.
fn find_steps(sectors: &[Sector], tied: bool) -> Vec<(Vec<f64>, f64)> {
    let flat = level_cost(sectors, tied, &vec![0; sectors.len()], 0.0).0;
    let followed = |size_rad: f64| {
        let mut size_rad = size_rad;
        let mut levels = initial_levels(sectors, tied);
        let mut counts = Vec::new();
        let mut cost = f64::INFINITY;
        for _ in 0..3 {
            let next = follow(sectors, tied, &levels, size_rad);
            // The same steps have the same levels and size: nothing would move any more.
            if next == counts {
                break;
            }
            counts = next;
            let slope;
            (cost, levels, slope) = level_cost_with_size(sectors, tied, &counts);
            if slope * size_rad > 0.0 && (slope / size_rad).abs() < 2.0 && (slope / size_rad).abs() > 0.5 {
                size_rad = slope;
            }
        }
        let steps = steps_in(sectors, tied, &counts);
        (steps > 0).then_some((flat - cost - STEP_NATS * steps as f64, counts))
    };
    let sizes = (0..SIZES as i32).map(|n| SMALLEST_RAD * SIZE_RATIO.powi(n));
    let sizes: Vec<f64> = sizes.flat_map(|size_rad| [size_rad, -size_rad]).collect();
    let mut tried: Vec<(f64, Vec<usize>)> = sizes.into_par_iter().filter_map(followed).collect();
    // How far they rise together is known well then; by a step of the grid too large the same way takes one step fewer.
    if let Some((_, counts)) = tried.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
        let rise_rad = level_cost_with_size(sectors, tied, counts).2 * steps_in(sectors, tied, counts) as f64;
        let shared: Vec<f64> = (1..=MOST_SHARED).map(|steps| rise_rad / f64::from(steps)).collect();
        tried.extend(shared.into_par_iter().filter_map(followed).collect::<Vec<_>>());
    }
    // Many small steps and fewer large ones come near each other here, where all cost the same: the first by what they cost as an
    // effect too.
    let by_score = |a: &&(f64, Vec<usize>), b: &&(f64, Vec<usize>)| a.0.total_cmp(&b.0);
    let as_effect = |(score, counts): &(f64, Vec<usize>)| {
        let steps = steps_in(sectors, tied, counts);
        score + STEP_NATS * steps as f64 - steps_cost_nats(steps)
    };
    let best = tried.iter().max_by(by_score).filter(|(score, _)| *score > STEPS_FOUND_NATS);
    let other = best.and_then(|_| tried.iter().max_by(|a, b| as_effect(a).total_cmp(&as_effect(b))));
    let mut counts: Vec<&Vec<usize>> = best.into_iter().chain(other).map(|(_, counts)| counts).collect();
    counts.dedup();
    let times_and_size = |counts: &Vec<usize>| {
        let mut times_s = Vec::new();
        for n in 1..sectors.len() {
            let joined = tied || sectors[n].run == sectors[n - 1].run;
            if joined && counts[n] > counts[n - 1] {
                let time_s = sectors[n].start_s;
                times_s.extend(std::iter::repeat_n(time_s, counts[n] - counts[n - 1]));
            }
        }
        (times_s, level_cost_with_size(sectors, tied, counts).2)
    };
    counts.into_iter().map(times_and_size).collect()
}

fn steps_in(sectors: &[Sector], tied: bool, counts: &[usize]) -> usize {
    (1..sectors.len())
        .filter(|n| tied || sectors[*n].run == sectors[n - 1].run)
        .map(|n| counts[n].saturating_sub(counts[n - 1]))
        .sum()
}

/// Levels before any step: the median of the first revolution of each run, or of the campaign.
fn initial_levels(sectors: &[Sector], tied: bool) -> Vec<f64> {
    let runs = sectors.iter().map(|s| s.run).max().map_or(0, |n| n + 1);
    (0..runs)
        .map(|run| {
            let from = if tied { 0 } else { run };
            let mut first: Vec<f64> =
                sectors.iter().filter(|s| s.run == from).take(SECTORS / 2).map(|s| s.mean_rad).collect();
            first.sort_by(f64::total_cmp);
            first.get(first.len() / 2).copied().unwrap_or(0.0)
        })
        .collect()
}

/// Number of steps so far at each sector, by dynamic programming.
fn follow(sectors: &[Sector], tied: bool, levels: &[f64], size_rad: f64) -> Vec<usize> {
    let fresh = |n: usize| n == 0 || (!tied && sectors[n].run != sectors[n - 1].run);
    // Least costs of k steps before each sector, then after the last. Two places stand before k = 0, so that no jump needs a
    // look at where it comes from.
    let mut costs = vec![[f64::INFINITY; PAD + MOST_STEPS]; sectors.len() + 1];
    costs[0][PAD] = 0.0;
    for (n, sector) in sectors.iter().enumerate() {
        if n > 0 && fresh(n) {
            // A new run with a level of its own begins at no steps; the way here is kept by its best end.
            let least = costs[n].iter().copied().fold(f64::INFINITY, f64::min);
            costs[n] = [f64::INFINITY; PAD + MOST_STEPS];
            costs[n][PAD] = least;
        }
        let (done, open) = costs.split_at_mut(n + 1);
        let (before, after) = (&done[n], &mut open[0]);
        let jumps = if fresh(n) { 0.0 } else { STEP_NATS };
        let (first, weight) = (sector.mean_rad - levels[sector.run], 0.5 / sector.variance_rad2);
        for k in 0..MOST_STEPS {
            let least = if jumps > 0.0 { cheapest(before, k).0 } else { before[k + PAD] };
            let deviation = first - size_rad * k as f64;
            after[k + PAD] = least + weight * deviation * deviation;
        }
    }
    // Back along the cheapest way; a run with a level of its own ends at its own cheapest state.
    let mut counts = vec![0; sectors.len()];
    let mut k = argmin(&costs[sectors.len()][PAD..]);
    for n in (0..sectors.len()).rev() {
        counts[n] = k;
        if fresh(n) {
            if n > 0 {
                k = run_end(sectors, levels, size_rad, n - 1);
            }
        } else {
            k -= cheapest(&costs[n], k).1;
        }
    }
    counts
}

/// Cost of the cheapest way to k steps by a jump of none, one or two, and that jump.
fn cheapest(before: &[f64; PAD + MOST_STEPS], k: usize) -> (f64, usize) {
    let mut best = (before[k + PAD], 0);
    for jump in 1..=PAD {
        let cost = before[k + PAD - jump] + STEP_NATS * jump as f64;
        if cost < best.0 {
            best = (cost, jump);
        }
    }
    best
}

fn argmin(values: &[f64]) -> usize {
    (0..values.len()).min_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0)
}

/// The state in which the run that ends with sector `last` most likely ends.
fn run_end(sectors: &[Sector], levels: &[f64], size_rad: f64, last: usize) -> usize {
    let run = sectors[last].run;
    let tail: Vec<&Sector> = sectors[..=last].iter().rev().take_while(|s| s.run == run).take(SECTORS / 3).collect();
    let mean = tail.iter().map(|s| s.mean_rad - levels[run]).sum::<f64>() / tail.len().max(1) as f64;
    ((mean / size_rad).round().max(0.0) as usize).min(MOST_STEPS - 1)
}

/// Cost of the counts with levels fitted for a given step size.
fn level_cost(sectors: &[Sector], tied: bool, counts: &[usize], size_rad: f64) -> (f64, Vec<f64>) {
    let runs = sectors.iter().map(|s| s.run).max().map_or(0, |n| n + 1);
    let mut sums = vec![(0.0, 0.0); runs];
    for (sector, count) in sectors.iter().zip(counts) {
        let slot = if tied { 0 } else { sector.run };
        sums[slot].0 += (sector.mean_rad - size_rad * *count as f64) / sector.variance_rad2;
        sums[slot].1 += 1.0 / sector.variance_rad2;
    }
    let levels: Vec<f64> = (0..runs)
        .map(|run| {
            let (sum, weight) = sums[if tied { 0 } else { run }];
            if weight > 0.0 { sum / weight } else { 0.0 }
        })
        .collect();
    let cost = sectors
        .iter()
        .zip(counts)
        .map(|(s, k)| 0.5 * (s.mean_rad - levels[s.run] - size_rad * *k as f64).powi(2) / s.variance_rad2)
        .sum();
    (cost, levels)
}

/// The same with the step size fitted too: cost, levels, size.
fn level_cost_with_size(sectors: &[Sector], tied: bool, counts: &[usize]) -> (f64, Vec<f64>, f64) {
    let (_, mean_y) = level_cost(sectors, tied, counts, 0.0);
    // Mean count a level by the same weights.
    let runs = mean_y.len();
    let mut sums = vec![(0.0, 0.0); runs];
    for (sector, count) in sectors.iter().zip(counts) {
        let slot = if tied { 0 } else { sector.run };
        sums[slot].0 += *count as f64 / sector.variance_rad2;
        sums[slot].1 += 1.0 / sector.variance_rad2;
    }
    let (mut top, mut bottom) = (0.0, 0.0);
    for (sector, count) in sectors.iter().zip(counts) {
        let (sum, weight) = sums[if tied { 0 } else { sector.run }];
        let x = *count as f64 - sum / weight;
        top += x * (sector.mean_rad - mean_y[sector.run]) / sector.variance_rad2;
        bottom += x * x / sector.variance_rad2;
    }
    let size_rad = if bottom > 0.0 { top / bottom } else { 0.0 };
    let (cost, levels) = level_cost(sectors, tied, counts, size_rad);
    (cost, levels, size_rad)
}

/// A tone in time.
#[derive(Clone, Copy, Debug)]
pub struct Tone {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, rad.
    pub amplitude_rad: f64,
}

/// Finds tones in what differs between revolutions of a condition, and takes them off the points. With them the grid of what is
/// left.
pub fn take_off_tones(rig: &Rig, runs: &mut [ReducedRun], mut grid: Grid) -> (Vec<Tone>, Grid) {
    let mut tones = Vec::new();
    for band in [Band::High, Band::Low] {
        while tones.len() < MOST_TONES
            && let Some(frequency_hz) = strongest_tone(&grid, runs, band)
            && let Some(tone) = take_off_tone(runs, &grid, frequency_hz, band)
        {
            tones.push(tone);
            grid = Grid::new(rig, runs);
        }
    }
    (tones, grid)
}

/// Where tones are looked for. Below a few turns' frequency a tone looks like the waves that scatter from revolution to revolution:
/// there they must not be taken off, and a line must stand the more out of them.
#[derive(Clone, Copy, PartialEq)]
enum Band {
    High,
    Low,
}

impl Band {
    /// Its limits in turns' frequencies.
    fn turns(self) -> [f64; 2] {
        match self {
            Self::High => [10.0, f64::INFINITY],
            Self::Low => [2.0, 10.0],
        }
    }

    fn least_nats(self) -> f64 {
        match self {
            Self::High => TONE_NATS,
            Self::Low => LOW_TONE_NATS,
        }
    }
}

/// Values at the points detrended of what goes with the angle and, in the high band, is a slow wave of a revolution.
fn detrended(grid: &Grid, runs: &[ReducedRun], band: Band, value: &dyn Fn(&Point) -> f64) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); grid.places.len()];
    let each = || runs.iter().zip(&grid.place_of_point).flat_map(|(run, places)| run.points.iter().zip(places));
    for (point, place) in each() {
        sums[*place].0 += point.samples * value(point);
        sums[*place].1 += point.samples;
    }
    let means: Vec<f64> = sums.iter().map(|(sum, weight)| sum / weight.max(f64::MIN_POSITIVE)).collect();
    let residual = incoherent(grid, band, &means);
    each().map(|(point, place)| value(point) - means[*place] + residual[*place]).collect()
}

fn strongest_tone(grid: &Grid, runs: &[ReducedRun], band: Band) -> Option<f64> {
    let duration_s = grid.plan.duration_s;
    if grid.revolutions.len() < 2 || duration_s <= 0.0 {
        return None;
    }
    let values = detrended(grid, runs, band, &|point| point.rho_rad);
    let points: Vec<&Point> = runs.iter().flat_map(|run| &run.points).collect();
    let start_s = points.iter().map(|p| p.time_s).fold(f64::INFINITY, f64::min);
    let step_s = duration_s / (TONE_STEPS as f64 - 1.0);
    let mut series = vec![Complex::new(0.0, 0.0); 2 * TONE_STEPS];
    let mut power = 0.0;
    for (point, value) in points.iter().zip(&values) {
        series[((point.time_s - start_s) / step_s) as usize].re += point.samples * value;
        power += point.samples * point.samples * value * value;
    }
    FftPlanner::new().plan_fft_forward(series.len()).process(&mut series);
    // Above half the points' rate all is mirrored.
    let turn_hz = grid.plan.speeds_rad_per_s.last().copied().unwrap_or(0.0) / TAU;
    let bins_per_hz = 2.0 * duration_s;
    let [low, high] = band.turns().map(|turns| turns * turn_hz * bins_per_hz);
    let first = low.ceil().max(2.0 * NEIGHBOURS as f64) as usize;
    let mut gaps_s: Vec<f64> = points.windows(2).map(|w| w[1].time_s - w[0].time_s).collect();
    gaps_s.sort_by(f64::total_cmp);
    let gap_s = gaps_s.get(gaps_s.len() / 2).copied()?;
    let last = ((0.45 / gap_s * bins_per_hz).min(high) as usize).min(TONE_STEPS - 2 * NEIGHBOURS);
    let size: Vec<f64> = series[..TONE_STEPS].iter().map(|x| x.norm_sqr() / power).collect();
    let peak = (first..last).max_by(|a, b| size[*a].total_cmp(&size[*b]))?;
    // A tone is a line: it stands out of its neighbours too, which the broad spectrum of a step or a knock does not.
    let about = size[peak - NEIGHBOURS..peak - 4].iter().chain(&size[peak + 5..peak + NEIGHBOURS]);
    let level = about.sum::<f64>() / (2 * NEIGHBOURS - 9) as f64;
    let level = if band == Band::High { level.max(1.0) } else { level };
    let nats = size[peak] / level - (points.len() as f64).ln();
    (nats > band.least_nats()).then_some(peak as f64 / bins_per_hz)
}

/// Refines the frequency, fits the tone and subtracts it; `None` where it is too small to matter.
fn take_off_tone(runs: &mut [ReducedRun], grid: &Grid, frequency_hz: f64, band: Band) -> Option<Tone> {
    let values = detrended(grid, runs, band, &|point| point.rho_rad);
    let points: Vec<Point> = runs.iter().flat_map(|run| &run.points).copied().collect();
    let start_s = points.first()?.time_s;
    let explained = |frequency_hz: f64| {
        let (mut of_sin, mut of_cos) = (0.0, 0.0);
        for (point, value) in points.iter().zip(&values) {
            let (sin, cos) = (TAU * frequency_hz * (point.time_s - start_s)).sin_cos();
            of_sin += point.samples * value * sin;
            of_cos += point.samples * value * cos;
        }
        of_sin * of_sin + of_cos * of_cos
    };
    let mut centre_hz = frequency_hz;
    let mut width_hz = 0.5 / grid.plan.duration_s;
    for _ in 0..7 {
        centre_hz = [-1.0, -0.5, 0.0, 0.5, 1.0]
            .into_iter()
            .map(|part| (centre_hz + part * width_hz, explained(centre_hz + part * width_hz)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?
            .0;
        width_hz *= 0.5;
    }
    // The tone's own waves lose to the angle what the residual lost: both are detrended alike before the fit.
    let phase = |point: &Point| TAU * centre_hz * (point.time_s - start_s);
    let sines = detrended(grid, runs, band, &|point| phase(point).sin());
    let cosines = detrended(grid, runs, band, &|point| phase(point).cos());
    let mut normal = nalgebra::Matrix2::zeros();
    let mut right = nalgebra::Vector2::zeros();
    let mut square = 0.0;
    for ((point, value), (sin, cos)) in points.iter().zip(&values).zip(sines.iter().zip(&cosines)) {
        let x = nalgebra::Vector2::new(*sin, *cos);
        normal += point.samples * x * x.transpose();
        right += point.samples * *value * x;
        square += point.samples * value * value;
    }
    let beta = normal.try_inverse()? * right;
    if right.dot(&beta) < LEAST_TONE_SHARE * square {
        return None;
    }
    for point in runs.iter_mut().flat_map(|run| &mut run.points) {
        let (sin, cos) = phase(point).sin_cos();
        point.rho_rad -= beta[0] * sin + beta[1] * cos;
    }
    Some(Tone { frequency_hz: centre_hz, amplitude_rad: beta.norm() })
}

/// Values of every place less their cell's mean over the revolutions and, in the high band, the revolution's own waves.
fn incoherent(grid: &Grid, band: Band, values: &[f64]) -> Vec<f64> {
    let mut means = vec![(0.0, 0.0); grid.cells.len()];
    for (place, cell) in grid.cell_of.iter().enumerate() {
        means[*cell].0 += grid.weight[place] * values[place];
        means[*cell].1 += grid.weight[place];
    }
    let several = grid.cells.len() < grid.places.len();
    let mut rest: Vec<f64> = (0..grid.places.len())
        .map(|place| {
            let (sum, weight) = means[grid.cell_of[place]];
            values[place] - if several { sum / weight } else { 0.0 }
        })
        .collect();
    if band == Band::Low {
        return rest;
    }
    let detrended: Vec<Vec<f64>> = grid
        .revolutions
        .par_iter()
        .map(|revolution| {
            let places = revolution.places.clone();
            let at: Vec<_> = places
                .clone()
                .map(|place| {
                    let part = grid.part_of_cell[grid.cell_of[place]];
                    SVector::<f64, WAVES>::from(waves(grid.places[place].theta1_rad, part))
                })
                .collect();
            let mut normal = SMatrix::<f64, WAVES, WAVES>::zeros();
            let mut right = SVector::<f64, WAVES>::zeros();
            for (z, place) in at.iter().zip(places.clone()) {
                normal.ger(grid.weight[place], z, z, 1.0);
                right.axpy(grid.weight[place] * rest[place], z, 1.0);
            }
            // A short segment does not fix its waves: a little of nothing is added.
            let ridge = 1e-6 * normal.diagonal().max();
            for k in 0..WAVES {
                normal[(k, k)] += ridge;
            }
            let u = Cholesky::new(normal).map_or_else(SVector::zeros, |cholesky| cholesky.solve(&right));
            at.iter().zip(&rest[places]).map(|(z, rest)| rest - z.dot(&u)).collect()
        })
        .collect();
    // Revolutions stand one after the other.
    rest.splice(.., detrended.into_iter().flatten());
    rest
}
