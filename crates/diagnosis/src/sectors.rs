//! Means over sectors of a revolution: what moves the level, at a few hundred points a campaign.

use nalgebra::{DMatrix, DVector};

use super::evidence;
use super::grid::Grid;
use super::noise::Noise;
use super::nuisance_patterns::Pattern;
use super::settings::{EvidenceSettings, StepSettings};

/// Mean of a sector of a revolution.
pub(super) struct Sector {
    /// Run.
    pub run: usize,
    /// When it begins, s since the campaign's start.
    pub start_s: f64,
    /// Mean time of its samples, s since the campaign's start.
    pub middle_s: f64,
    /// Mean, rad.
    pub mean_rad: f64,
    /// Its variance, rad².
    pub variance_rad2: f64,
}

/// Means of all sectors in turn.
pub(super) fn sectors(grid: &Grid, noise: &Noise, rest: &[f64], settings: &StepSettings) -> Vec<Sector> {
    // Waves above the sector's own length average out; the lower ones are as good as independent from turn to turn.
    let low: f64 = noise.order_rad2.iter().take(4).enumerate().map(|(n, v)| if n == 0 { *v } else { 2.0 * v }).sum();
    let mut sectors = Vec::new();
    for revolution in &grid.revolutions {
        let places: Vec<usize> = revolution.places.clone().collect();
        let mut ordered = places.clone();
        ordered.sort_by(|a, b| grid.places[*a].time_s.total_cmp(&grid.places[*b].time_s));
        let size = ordered.len().div_ceil(settings.sectors).max(1);
        for chunk in ordered.chunks(size) {
            let weight: f64 = chunk.iter().map(|p| grid.weight[*p]).sum();
            let mean =
                |value: &dyn Fn(usize) -> f64| chunk.iter().map(|p| grid.weight[*p] * value(*p)).sum::<f64>() / weight;
            sectors.push(Sector {
                run: revolution.run,
                start_s: grid.places[chunk[0]].time_s,
                middle_s: mean(&|p| grid.places[p].time_s),
                mean_rad: mean(&|p| rest[p]),
                variance_rad2: noise.white_rad2 / weight + low,
            });
        }
    }
    sectors
}

/// Log evidence that a pattern of time adds to a free level, by the sectors alone: more than there can be, for neighbouring sectors
/// share their level. Where it is negative the pattern need not be looked at any closer.
pub(super) fn worth(grid: &Grid, sectors: &[Sector], pattern: &Pattern, settings: &EvidenceSettings) -> f64 {
    let width = pattern.width();
    let Some(mut at) = grid.places.first().copied() else { return f64::NEG_INFINITY };
    let mut columns = DMatrix::zeros(sectors.len(), width);
    let mut row = vec![0.0; width];
    for (n, sector) in sectors.iter().enumerate() {
        (at.run, at.time_s) = (sector.run, sector.middle_s);
        row.fill(0.0);
        pattern.row(&at, &mut row);
        columns.row_mut(n).copy_from_slice(&row);
    }
    let weights = DVector::from_iterator(sectors.len(), sectors.iter().map(|s| 1.0 / s.variance_rad2));
    let values = DVector::from_iterator(sectors.len(), sectors.iter().map(|s| s.mean_rad));
    let total = weights.sum();
    for mut column in columns.column_iter_mut() {
        let mean = column.dot(&weights) / total;
        column.add_scalar_mut(-mean);
    }
    let mut weighted = columns.clone();
    weighted.column_iter_mut().for_each(|mut column| column.component_mul_assign(&weights));
    let (gram, rhs) = (columns.tr_mul(&weighted), weighted.tr_mul(&values));
    // As in the design matrix: an amplitude of the block is the RMS of its trace.
    let scale2 = width as f64 * total / gram.trace();
    evidence::gain(&(gram * scale2), &(rhs * scale2.sqrt()), width, false, settings)
}
