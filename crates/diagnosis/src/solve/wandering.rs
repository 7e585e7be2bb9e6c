//! Waves over the driver's angle that do not close with its turn.

use super::state::State;
use super::weigh::{add_and_weigh, beside};
use crate::design_matrix::Candidate;
use crate::nuisance_patterns::Pattern;

/// Looks for such waves in a design matrix of their own, and takes the best into that of all where it is worth it.
pub(super) fn look_for_wandering_waves(state: &mut State<'_>) -> bool {
    let settings = state.settings();
    let span_rev = state.grid.span_rev();
    let mut patterns = Pattern::wandering(span_rev, &settings.nuisance);
    let mut step = 1.0;
    let found = state.best.as_ref().map(|m| m.fit.set.clone()).unwrap_or_default();
    let mut best: Option<(Pattern, f64)> = None;
    for _ in 0..settings.nuisance.wandering_passes {
        let tried: Vec<Candidate> = patterns.iter().cloned().map(Candidate::Unknown).collect();
        let Some(beside) = beside(state, &found, &tried) else { return false };
        for (block, gain) in &beside.gains {
            if let Candidate::Unknown(pattern) = &beside.design.blocks[*block].candidate
                && best.as_ref().is_none_or(|(_, g)| gain > g)
            {
                best = Some((pattern.clone(), *gain));
            }
        }
        let Some((pattern, _)) = best.as_ref().filter(|(_, gain)| *gain > settings.nuisance.wandering_nats) else {
            return false;
        };
        patterns = pattern.nearer(step, span_rev, settings);
        step *= 0.5;
    }
    let Some((pattern, _)) = best else { return false };
    add_and_weigh(state, &[Candidate::Unknown(pattern)])
}
