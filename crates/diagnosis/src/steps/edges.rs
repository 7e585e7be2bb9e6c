//! Where a step stands: its sharp edge.

use crate::grid::Grid;

/// Where among weighted values a step of a given size stands best: the first value that it raises.
pub(super) fn edge(values: impl Iterator<Item = (f64, f64)> + Clone, step_rad: f64) -> usize {
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
pub(super) fn sharpen(grid: &Grid, rest: &[f64], times_s: &[f64], size_rad: f64, sectors: usize) -> Vec<f64> {
    let mut order: Vec<usize> = (0..grid.places.len()).collect();
    order.sort_by(|a, b| grid.places[*a].time_s.total_cmp(&grid.places[*b].time_s));
    let half = grid.bins / sectors * 3 / 2;
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
