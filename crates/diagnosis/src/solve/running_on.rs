//! Levels that run on with time: they settle in each run, swing or wander.

use super::state::State;
use super::weigh::{noise_with, weigh};
use crate::design_matrix::Candidate;
use crate::nuisance_patterns::Pattern;
use crate::{sectors, slow_tone};

/// Looks for levels that settle in each run, swing or wander with time, and takes into the design matrix what is worth it.
pub(super) fn look_for_what_runs_on(state: &mut State<'_>) -> bool {
    let settings = state.settings();
    let rest = state.design.rest(&state.grid, &state.steady_amplitudes());
    let sectors = sectors::sectors(&state.grid, &state.noise, &rest, &settings.steps);
    let (settling, walk) = Pattern::running_on(&state.grid.plan, &settings.running_on);
    let worth = |pattern: Pattern| (sectors::worth(&state.grid, &sectors, &pattern, &settings.evidence), pattern);
    let settles = settling.into_iter().map(worth).max_by(|a, b| a.0.total_cmp(&b.0));
    let others = slow_tone::strongest(&state.grid, &sectors, &settings.running_on).into_iter().chain(walk).map(worth);
    let worth_it: Vec<Pattern> =
        settles.into_iter().chain(others).filter(|(nats, _)| *nats > 0.0).map(|(_, pattern)| pattern).collect();
    let mut changed = false;
    for candidate in worth_it.into_iter().map(Candidate::Unknown) {
        if let Some(noise) = noise_with(state, &candidate, settings.running_on.rounds) {
            changed = true;
            for block in state.design.add(&state.grid, state.rig, &[candidate]) {
                weigh(state, block, noise.clone());
            }
        }
    }
    changed
}
