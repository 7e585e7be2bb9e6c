//! Shapes between the points of their grid: what a shape on a grid misses must not be made up by other effects.

use rayon::prelude::*;

use super::state::State;
use crate::design_matrix::{Candidate, DesignMatrix};
use crate::evidence;

/// Moves the shapes of the best model's larger effects to where they fit best, the small ones left out. Then both sets compete.
/// Works in a design matrix of its own, which stays small. True where any shape moved.
pub(super) fn sharpen(state: &mut State<'_>) -> bool {
    let settings = &state.settings().sharpening;
    let Some(best) = &state.best else { return false };
    let largest = (0..best.fit.set.len()).map(|n| best.fit.rms_rad(&state.design, n)).fold(0.0, f64::max);
    let large: Vec<usize> = (0..best.fit.set.len())
        .filter(|n| best.fit.rms_rad(&state.design, *n) > settings.large * largest)
        .map(|n| best.fit.set[n])
        .collect();
    let mut few = state.design.only(&state.grid, &large);
    let mut changed = false;
    for step in settings.steps {
        let mut moved = false;
        for _ in 0..large.len() {
            moved |= sharpen_first(state, &mut few, step);
        }
        changed |= moved;
        if !moved && step < settings.sharp_enough {
            break;
        }
    }
    if changed {
        let shaped: Vec<Candidate> = few.blocks.into_iter().map(|block| block.candidate).collect();
        let known: Vec<Option<usize>> = shaped.iter().map(|candidate| state.block_of(candidate)).collect();
        let fresh: Vec<Candidate> =
            shaped.into_iter().zip(&known).filter(|(_, k)| k.is_none()).map(|(candidate, _)| candidate).collect();
        let mut added = state.design.add(&state.grid, state.rig, &fresh).into_iter();
        state.large = Some(known.into_iter().filter_map(|k| k.or_else(|| added.next())).collect());
    }
    changed
}

/// Tries the shapes about that of a design matrix's first block, and puts the best behind the others; true where that is another.
fn sharpen_first(state: &State<'_>, few: &mut DesignMatrix, step: f64) -> bool {
    let all: Vec<usize> = (0..few.blocks.len()).collect();
    let whitened = state.noise.whiten(&state.grid, few);
    let Some(now) = evidence::fit(few, &whitened, &all, &[]) else { return false };
    let fresh: Vec<Candidate> = match few.blocks[0].candidate.clone() {
        Candidate::Effect { effect, number, shape, cost_nats } => {
            let refined = effect.refine(state.rig, &shape, &evidence::estimate(few, &whitened, &now, 0).beta);
            let shapes = effect.neighbours(&shape, step).into_iter().chain(refined);
            shapes.map(|shape| Candidate::Effect { effect, number, shape, cost_nats }).collect()
        }
        Candidate::Unknown(pattern) => {
            let nearer = pattern.nearer(step, state.grid.span_rev(), state.settings());
            nearer.into_iter().map(Candidate::Unknown).collect()
        }
    };
    let others = few.only(&state.grid, &all[1..]);
    let start_rad: Vec<f64> = now.scales_rad[1..].iter().chain(&now.scales_rad[..1]).copied().collect();
    let best = fresh
        .into_par_iter()
        .filter_map(|candidate| {
            let mut tried = others.clone();
            tried.add(&state.grid, state.rig, &[candidate]).first()?;
            let fit = evidence::fit(&tried, &state.noise.whiten(&state.grid, &tried), &all, &start_rad)?;
            Some((fit.log_evidence, tried))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(log_evidence, _)| *log_evidence > now.log_evidence + state.settings().sharpening.least_gain_nats);
    let moved = best.is_some();
    *few = best.map_or_else(|| few.only(&state.grid, &[&all[1..], &all[..1]].concat()), |(_, tried)| tried);
    moved
}
