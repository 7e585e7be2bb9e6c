//! Steps of one size: the residual stands at level c + Δ·k with k never falling, found by dynamic programming for each step size Δ,
//! once with a free level a run (what the conditions do to the level cannot hide or feign a step) and once with one level for all.

use rayon::prelude::*;

use crate::sectors::Sector;
use crate::settings::StepSettings;

/// Most steps followed, and most from one sector to the next.
const MOST_STEPS: usize = 96;
const PAD: usize = 2;

/// What so many steps cost as an effect, nats: which of the places came first does not matter.
pub(crate) fn steps_cost_nats(steps: usize, settings: &StepSettings) -> f64 {
    let orders: f64 = (1..=steps).map(|n| (n as f64).ln()).sum();
    settings.looked_for_nats + settings.each_nats * steps as f64 - orders
}

/// Times of steps of one size and the size, where they are worth their cost; at most two such sets.
pub(super) fn find_steps(sectors: &[Sector], tied: bool, settings: &StepSettings) -> Vec<(Vec<f64>, f64)> {
    let flat = level_cost(sectors, tied, &vec![0; sectors.len()], 0.0).0;
    let followed = |size_rad: f64| {
        let mut size_rad = size_rad;
        let mut levels = initial_levels(sectors, tied, settings.sectors);
        let mut counts = Vec::new();
        let mut cost = f64::INFINITY;
        for _ in 0..3 {
            let next = follow(sectors, tied, &levels, size_rad, settings);
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
        (steps > 0).then_some((flat - cost - settings.step_nats * steps as f64, counts))
    };
    let sizes = (0..settings.sizes).map(|n| settings.smallest_rad * settings.size_ratio.powi(n));
    let sizes: Vec<f64> = sizes.flat_map(|size_rad| [size_rad, -size_rad]).collect();
    let mut tried: Vec<(f64, Vec<usize>)> = sizes.into_par_iter().filter_map(followed).collect();
    // How far they rise together is known well then; by a step of the grid too large the same way takes one step fewer.
    if let Some((_, counts)) = tried.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
        let rise_rad = level_cost_with_size(sectors, tied, counts).2 * steps_in(sectors, tied, counts) as f64;
        let shared: Vec<f64> = (1..=settings.most_shared).map(|steps| rise_rad / f64::from(steps)).collect();
        tried.extend(shared.into_par_iter().filter_map(followed).collect::<Vec<_>>());
    }
    // Many small steps and fewer large ones come near each other here, where all cost the same: the first by what they cost as an
    // effect too.
    let by_score = |a: &&(f64, Vec<usize>), b: &&(f64, Vec<usize>)| a.0.total_cmp(&b.0);
    let as_effect = |(score, counts): &(f64, Vec<usize>)| {
        let steps = steps_in(sectors, tied, counts);
        score + settings.step_nats * steps as f64 - steps_cost_nats(steps, settings)
    };
    let best = tried.iter().max_by(by_score).filter(|(score, _)| *score > settings.found_nats);
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
fn initial_levels(sectors: &[Sector], tied: bool, per_revolution: usize) -> Vec<f64> {
    let runs = sectors.iter().map(|s| s.run).max().map_or(0, |n| n + 1);
    (0..runs)
        .map(|run| {
            let from = if tied { 0 } else { run };
            let mut first: Vec<f64> =
                sectors.iter().filter(|s| s.run == from).take(per_revolution / 2).map(|s| s.mean_rad).collect();
            first.sort_by(f64::total_cmp);
            first.get(first.len() / 2).copied().unwrap_or(0.0)
        })
        .collect()
}

/// Number of steps so far at each sector, by dynamic programming.
fn follow(sectors: &[Sector], tied: bool, levels: &[f64], size_rad: f64, settings: &StepSettings) -> Vec<usize> {
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
        let jumps = if fresh(n) { 0.0 } else { settings.step_nats };
        let (first, weight) = (sector.mean_rad - levels[sector.run], 0.5 / sector.variance_rad2);
        for k in 0..MOST_STEPS {
            let least = if jumps > 0.0 { cheapest(before, k, settings.step_nats).0 } else { before[k + PAD] };
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
                k = run_end(sectors, levels, size_rad, n - 1, settings.sectors);
            }
        } else {
            k -= cheapest(&costs[n], k, settings.step_nats).1;
        }
    }
    counts
}

/// Cost of the cheapest way to k steps by a jump of none, one or two, and that jump.
fn cheapest(before: &[f64; PAD + MOST_STEPS], k: usize, step_nats: f64) -> (f64, usize) {
    let mut best = (before[k + PAD], 0);
    for jump in 1..=PAD {
        let cost = before[k + PAD - jump] + step_nats * jump as f64;
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
fn run_end(sectors: &[Sector], levels: &[f64], size_rad: f64, last: usize, per_revolution: usize) -> usize {
    let run = sectors[last].run;
    let tail: Vec<&Sector> =
        sectors[..=last].iter().rev().take_while(|s| s.run == run).take(per_revolution / 3).collect();
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
pub(super) fn level_cost_with_size(sectors: &[Sector], tied: bool, counts: &[usize]) -> (f64, Vec<f64>, f64) {
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
