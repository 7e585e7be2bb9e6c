//! Steps of the level: of one size, as an effect makes them, and single ones of any size.
//!
//! They are looked for on means over sectors of a revolution, then moved to the sharp edges that the places about them show.

mod edges;
mod follow;
mod single;

use std::f64::consts::TAU;

use super::design_matrix::DesignMatrix;
use super::grid::Grid;
use super::noise::Noise;
use super::nuisance_patterns::Pattern;
use super::sectors::{Sector, sectors};
use super::settings::StepSettings;
use edges::{edge, sharpen};
use follow::{find_steps, level_cost_with_size};
use single::single_steps;

pub(super) use follow::steps_cost_nats;

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    /// Single steps of any size.
    pub patterns: Vec<Pattern>,
    /// Times of steps, s since the campaign's start.
    pub times_s: Vec<Vec<f64>>,
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
    settings: &StepSettings,
) -> Steps {
    let mut found = Steps::default();
    let mut look = |rest: &[f64]| {
        let sectors = sectors(grid, noise, rest, settings);
        for tied in [false, true] {
            for (times_s, size_rad) in find_steps(&sectors, tied, settings) {
                let mut times_s = sharpen(grid, rest, &times_s, size_rad, settings.sectors);
                if times_s.len() <= settings.few {
                    times_s.iter_mut().for_each(|time_s| *time_s = off_the_edges(grid, *time_s, settings.sectors));
                }
                if !found.times_s.contains(&times_s) {
                    found.times_s.push(times_s);
                }
            }
        }
        found.patterns.extend(single_steps(grid, &sectors, rest, settings));
    };
    look(&design.rest(grid, amplitudes));
    if steady.len() < amplitudes.len() {
        look(&design.rest(grid, steady));
    }
    found
}

/// A step's time, moved to between two runs where it stands so near the end of one that it would only take off what is there.
fn off_the_edges(grid: &Grid, time_s: f64, sectors: usize) -> f64 {
    let starts_s = &grid.plan.starts_s;
    let run = starts_s.partition_point(|start_s| *start_s <= time_s);
    let begins_s = run.checked_sub(1).map(|n| starts_s[n]);
    let (Some(begins_s), Some(next_s)) = (begins_s, starts_s.get(run)) else { return time_s };
    let speed = grid.places.iter().find(|place| place.run + 1 == run).map_or(0.0, |place| place.speed_rad_per_s.abs());
    let sector_s = TAU / sectors as f64 / speed;
    let last_s = grid.places.iter().filter(|place| place.run + 1 == run).map(|p| p.time_s).fold(begins_s, f64::max);
    if time_s + sector_s > last_s {
        *next_s
    } else if time_s - sector_s < begins_s {
        begins_s
    } else {
        time_s
    }
}

/// Moves steps of one size, one after the other, to where the sectors of a residual want them while the others stay. Without a size it is
/// that which they have where they stand.
pub(super) fn settle(
    grid: &Grid,
    noise: &Noise,
    rest: &[f64],
    times_s: &[f64],
    size_rad: Option<f64>,
    settings: &StepSettings,
) -> Vec<f64> {
    let sectors = sectors(grid, noise, rest, settings);
    let size_of = |times_s: &[f64]| {
        let so_far = |s: &Sector| times_s.iter().filter(|t| **t <= s.middle_s).count();
        size_rad
            .unwrap_or_else(|| level_cost_with_size(&sectors, true, &sectors.iter().map(so_far).collect::<Vec<_>>()).2)
    };
    let mut times_s = times_s.to_vec();
    for _ in 0..settings.settling_passes {
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
    sharpen(grid, rest, &times_s, size_of(&times_s), settings.sectors)
}
