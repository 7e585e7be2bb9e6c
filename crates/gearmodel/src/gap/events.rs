//! What the angle does not carry: steps of one size, tones in time, knocks.
//!
//! Steps are looked for on means over sectors of a revolution: the residual stands at level c + Δ·k with k never falling, found by
//! dynamic programming for each step size Δ, once with a free level a run (what the conditions do to the level cannot hide or
//! feign a step) and once with one level for all. Tones and knocks are looked for in what differs between revolutions of
//! one condition.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::grid::Grid;
use super::noise::{Noise, waves};
use super::pool::Pool;
use super::reduce::ReducedRun;
use super::unknown::Pattern;

/// What a step costs on the way through the sectors, nats: its place is open.
const STEP_NATS: f64 = 4.0;
/// What steps cost as an effect, nats: to look for them, and each; less than on the way, since neighbouring places do as
/// well.
pub(super) const STEPS_COST_NATS: [f64; 2] = [6.0, 3.0];
/// Evidence from which steps are taken into the pool, nats.
const STEPS_FOUND_NATS: f64 = 8.0;
/// Sectors a revolution.
const SECTORS: usize = 12;
/// Most steps followed.
const MOST_STEPS: usize = 96;
/// Step sizes tried: 1.5 µrad to 1.2 mrad.
const SIZES: usize = 30;
const SMALLEST_RAD: f64 = 1.5e-6;
/// Ratio of neighbouring sizes.
const SIZE_RATIO: f64 = 1.26;
/// Frequencies of the search for tones.
const TONE_STEPS: usize = 1 << 17;
/// Log odds from which a tone is taken into the pool.
const TONE_NATS: f64 = 6.0;

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Events {
    /// Tones.
    pub patterns: Vec<Pattern>,
    /// Times of steps, s since the campaign's start.
    pub steps: Vec<Vec<f64>>,
}

/// Looks for events in what a model (column, amplitude) leaves; `steady` is the same without what accumulates, which could
/// have taken the steps for a drift.
#[must_use]
pub fn find(
    grid: &Grid,
    runs: &[ReducedRun],
    pool: &Pool,
    noise: &Noise,
    amplitudes: &[(usize, f64)],
    steady: &[(usize, f64)],
) -> Events {
    let trace = pool.trace(grid, amplitudes);
    let mut steps = Vec::new();
    let mut look = |trace: &[f64]| {
        let rest: Vec<f64> = grid.rho_rad.iter().zip(trace).map(|(y, m)| y - m).collect();
        let sectors = sectors(grid, noise, &rest);
        for tied in [false, true] {
            if let Some(times_s) = find_steps(&sectors, tied)
                && !steps.contains(&times_s)
            {
                steps.push(times_s);
            }
        }
    };
    look(&trace);
    if steady.len() < amplitudes.len() {
        look(&pool.trace(grid, steady));
    }
    Events { patterns: find_tone(grid, runs, noise, &trace).into_iter().collect(), steps }
}

/// Mean of a sector of a revolution.
struct Sector {
    run: usize,
    start_s: f64,
    mean_rad: f64,
    variance_rad2: f64,
}

fn sectors(grid: &Grid, noise: &Noise, rest: &[f64]) -> Vec<Sector> {
    // Waves above the sector's own length average out; the lower ones are as good as independent from turn to turn.
    let low: f64 = noise.order_rad2.iter().take(4).enumerate().map(|(n, v)| if n == 0 { *v } else { 2.0 * v }).sum();
    let mut sectors = Vec::new();
    for revolution in &grid.revolutions {
        let places: Vec<usize> = revolution.places.clone().collect();
        let mut ordered = places.clone();
        ordered.sort_by(|a, b| grid.places[*a].time_s.total_cmp(&grid.places[*b].time_s));
        let size = ordered.len().div_ceil(SECTORS).max(1);
        for chunk in ordered.chunks(size) {
            let weight: f64 = chunk.iter().map(|p| grid.weight[*p]).sum();
            let mean = |value: &dyn Fn(usize) -> f64| chunk.iter().map(|p| grid.weight[*p] * value(*p)).sum::<f64>() / weight;
            sectors.push(Sector {
                run: revolution.run,
                start_s: grid.places[chunk[0]].time_s,
                mean_rad: mean(&|p| rest[p]),
                variance_rad2: noise.white_rad2 / weight + low,
            });
        }
    }
    sectors
}

/// Times of steps of one size, where they are worth their cost.
fn find_steps(sectors: &[Sector], tied: bool) -> Option<Vec<f64>> {
    let flat = level_cost(sectors, tied, &vec![0; sectors.len()], 0.0).0;
    let mut best: Option<(f64, Vec<usize>)> = None;
    for n in 0..SIZES {
        for sign in [1.0, -1.0] {
            let mut size_rad = sign * SMALLEST_RAD * SIZE_RATIO.powi(n as i32);
            let mut levels = initial_levels(sectors, tied);
            let mut counts = vec![0; sectors.len()];
            for _ in 0..3 {
                counts = follow(sectors, tied, &levels, size_rad);
                let (_, fitted, slope) = level_cost_with_size(sectors, tied, &counts);
                levels = fitted;
                if slope * size_rad > 0.0 && (slope / size_rad).abs() < 2.0 && (slope / size_rad).abs() > 0.5 {
                    size_rad = slope;
                }
            }
            let (cost, ..) = level_cost_with_size(sectors, tied, &counts);
            let steps = steps_in(sectors, tied, &counts);
            let score = flat - cost - STEP_NATS * steps as f64;
            if steps > 0 && best.as_ref().is_none_or(|(s, _)| score > *s) {
                best = Some((score, counts));
            }
        }
    }
    let (score, counts) = best?;
    if score < STEPS_FOUND_NATS {
        return None;
    }
    let mut times_s = Vec::new();
    for n in 1..sectors.len() {
        let joined = tied || sectors[n].run == sectors[n - 1].run;
        if joined && counts[n] > counts[n - 1] {
            let time_s = sectors[n].start_s;
            times_s.extend(std::iter::repeat_n(time_s, counts[n] - counts[n - 1]));
        }
    }
    Some(times_s)
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
    let states = MOST_STEPS;
    let mut cost = vec![f64::INFINITY; states];
    cost[0] = 0.0;
    let mut from: Vec<Vec<u8>> = Vec::with_capacity(sectors.len());
    for (n, sector) in sectors.iter().enumerate() {
        let fresh = n == 0 || (!tied && sector.run != sectors[n - 1].run);
        let mut next = vec![f64::INFINITY; states];
        let mut back = vec![0_u8; states];
        if fresh && n > 0 {
            // A new run with a level of its own begins at no steps; the way here is kept by its best end.
            let least = cost.iter().copied().fold(f64::INFINITY, f64::min);
            cost = vec![f64::INFINITY; states];
            cost[0] = least;
        }
        for k in 0..states {
            for jump in 0..=2_usize.min(k) {
                if fresh && jump > 0 {
                    break;
                }
                let value = cost[k - jump] + STEP_NATS * jump as f64;
                if value < next[k] {
                    next[k] = value;
                    back[k] = jump as u8;
                }
            }
            let deviation = sector.mean_rad - levels[sector.run] - size_rad * k as f64;
            next[k] += 0.5 * deviation * deviation / sector.variance_rad2;
        }
        cost = next;
        from.push(back);
    }
    // Back along the cheapest way; a run with a level of its own ends at its own cheapest state.
    let mut counts = vec![0; sectors.len()];
    let mut k = argmin(&cost);
    for n in (0..sectors.len()).rev() {
        counts[n] = k;
        k -= usize::from(from[n][k]);
        let fresh = n > 0 && !tied && sectors[n].run != sectors[n - 1].run;
        if fresh {
            k = run_end(sectors, levels, size_rad, n - 1);
        }
    }
    counts
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

/// The strongest tone in what differs between revolutions of a condition.
fn find_tone(grid: &Grid, runs: &[ReducedRun], noise: &Noise, trace: &[f64]) -> Option<Pattern> {
    let start_s = runs.iter().filter_map(|r| r.points.first()).map(|p| p.time_s).fold(f64::INFINITY, f64::min);
    let end_s = runs.iter().filter_map(|r| r.points.last()).map(|p| p.time_s).fold(f64::NEG_INFINITY, f64::max);
    let duration_s = end_s - start_s;
    if duration_s <= 0.0 || grid.revolutions.len() < 2 {
        return None;
    }
    let residual = incoherent(grid, trace);
    let step_s = duration_s / (TONE_STEPS as f64 - 1.0);
    let mut series = vec![Complex::new(0.0, 0.0); 2 * TONE_STEPS];
    let mut power = 0.0;
    let mut points = 0.0_f64;
    for (run, places) in runs.iter().zip(&grid.place_of_point) {
        for (point, place) in run.points.iter().zip(places) {
            // Deviation of the place's mean from the model, and of the point from its place.
            let value = point.rho_rad - grid.rho_rad[*place] + residual[*place];
            let weight = point.samples / noise.white_rad2;
            series[((point.time_s - start_s) / step_s) as usize].re += weight * value;
            power += weight * weight * value * value;
            points += 1.0;
        }
    }
    FftPlanner::new().plan_fft_forward(series.len()).process(&mut series);
    // Below a few turns' frequency the waves of the revolutions are not white.
    let turn_hz = grid.plan.speeds_rad_per_s.last().copied().unwrap_or(0.0) / std::f64::consts::TAU;
    let first = ((10.0 * turn_hz) * duration_s * 2.0).ceil().max(4.0) as usize;
    let peak = (first..TONE_STEPS).max_by(|a, b| series[*a].norm_sqr().total_cmp(&series[*b].norm_sqr()))?;
    let nats = series[peak].norm_sqr() / power - (points / 2.0).ln();
    let frequency_hz = peak as f64 / (2.0 * step_s * TONE_STEPS as f64);
    (nats > TONE_NATS).then_some(Pattern::Tone { frequency_hz })
}

/// Residual of every place less its cell's mean over the revolutions and the revolution's own waves.
fn incoherent(grid: &Grid, trace: &[f64]) -> Vec<f64> {
    let mut means = vec![(0.0, 0.0); grid.cells.len()];
    for (place, cell) in grid.cell_of.iter().enumerate() {
        means[*cell].0 += grid.weight[place] * (grid.rho_rad[place] - trace[place]);
        means[*cell].1 += grid.weight[place];
    }
    let several = grid.cells.len() < grid.places.len();
    let mut rest: Vec<f64> = (0..grid.places.len())
        .map(|place| {
            let (sum, weight) = means[grid.cell_of[place]];
            grid.rho_rad[place] - trace[place] - if several { sum / weight } else { 0.0 }
        })
        .collect();
    for revolution in &grid.revolutions {
        let n = super::noise::WAVES;
        let mut normal = nalgebra::DMatrix::zeros(n, n);
        let mut right = nalgebra::DVector::zeros(n);
        for place in revolution.places.clone() {
            let z = nalgebra::DVector::from_column_slice(&waves(grid.places[place].theta1_rad, grid.part_of_cell[grid.cell_of[place]]));
            normal.ger(grid.weight[place], &z, &z, 1.0);
            right.axpy(grid.weight[place] * rest[place], &z, 1.0);
        }
        // A short stretch does not fix its waves: a little of nothing is added.
        let ridge = 1e-6 * normal.diagonal().max();
        for k in 0..n {
            normal[(k, k)] += ridge;
        }
        if let Some(cholesky) = nalgebra::Cholesky::new(normal) {
            let u = cholesky.solve(&right);
            for place in revolution.places.clone() {
                let z = waves(grid.places[place].theta1_rad, grid.part_of_cell[grid.cell_of[place]]);
                rest[place] -= z.iter().zip(u.iter()).map(|(z, u)| z * u).sum::<f64>();
            }
        }
    }
    rest
}
