//! Steps in the level: single ones of any size, and an effect's of one size.

use gearmodel::effect::{Carrier, LIBRARY, Shape};

use super::state::State;
use super::weigh::{add_and_weigh, beside};
use crate::design_matrix::Candidate;
use crate::{evidence, steps};

/// Looks for steps, and takes what is found into the design matrix.
pub(super) fn look_for_steps(state: &mut State<'_>) -> bool {
    let settings = &state.settings().steps;
    let amplitudes = state.amplitudes();
    let steady = state.steady_amplitudes();
    let found = steps::find(&state.grid, &state.design, &state.noise, &amplitudes, &steady, settings);
    let mut candidates = Vec::new();
    candidates.extend(found.patterns.into_iter().map(Candidate::Unknown));
    let stepping = LIBRARY.iter().copied().enumerate().find(|(_, e)| e.steps() && !state.options.excludes(*e));
    if let Some((number, effect)) = stepping {
        let with_times = |times_s: Shape| {
            let cost_nats = steps::steps_cost_nats(times_s.len(), settings);
            Candidate::Effect { effect, number, shape: times_s, cost_nats }
        };
        candidates.extend(found.times_s.into_iter().map(with_times));
        candidates.extend(steps_between_runs(state, &with_times).into_iter().flatten().map(with_times));
    }
    candidates.retain(|candidate| state.block_of(candidate).is_none());
    let changed = !candidates.is_empty();
    add_and_weigh(state, &candidates);
    changed
}

/// The steps of the best model and those between runs that were taken for levels of theirs: as they are, and each moved to where it
/// fits best.
fn steps_between_runs(state: &State<'_>, with_times: &dyn Fn(Shape) -> Candidate) -> Option<[Shape; 3]> {
    let settings = &state.settings().steps;
    let fit = &state.best.as_ref()?.fit;
    let (times_s, size_rad) = (0..fit.set.len()).find_map(|n| match &state.design.blocks[fit.set[n]].candidate {
        Candidate::Effect { effect, shape, .. } if effect.steps() && shape.len() > 1 => {
            let estimate = evidence::estimate(&state.design, &state.whitened, fit, n);
            Some((shape.clone(), estimate.beta[0]))
        }
        _ => None,
    })?;
    // Without effects that show as levels only: they have taken the steps up.
    let mut others = state.steady_set();
    others.retain(|b| match &state.design.blocks[*b].candidate {
        Candidate::Effect { effect, shape, .. } => effect.signature_of(state.rig, shape).carrier != Carrier::None,
        Candidate::Unknown(_) => true,
    });
    let times_s = with_steps_between(state, &others, times_s, with_times)?;
    let place = |b: &usize| fit.set.iter().position(|own| own == b);
    let stays = |b: &usize| place(b).map(|n| fit.place(&state.design, n)).into_iter().flatten();
    let amplitudes: Vec<(usize, f64)> = others.iter().flat_map(stays).map(|n| (fit.columns[n], fit.mean[n])).collect();
    let rest = state.design.rest(&state.grid, &amplitudes);
    // Of the size in the model, and of their own: what else is in the model may have taken a part of it.
    let settled = |size_rad| steps::settle(&state.grid, &state.noise, &rest, &times_s, size_rad, settings);
    let (as_found, of_their_own) = (settled(Some(size_rad)), settled(None));
    Some([times_s, as_found, of_their_own])
}

/// Steps with those between two runs that are worth their cost beside a set of blocks.
fn with_steps_between(
    state: &State<'_>,
    others: &[usize],
    mut times_s: Shape,
    with_times: &dyn Fn(Shape) -> Candidate,
) -> Option<Shape> {
    let settings = &state.settings().steps;
    let cost_nats = |times_s: &[f64]| steps::steps_cost_nats(times_s.len(), settings);
    let mut before = f64::NEG_INFINITY;
    for _ in 0..settings.most_between {
        let with = |more: Option<&f64>| {
            let mut shape: Vec<f64> = times_s.iter().chain(more).copied().collect();
            shape.sort_by(f64::total_cmp);
            with_times(shape)
        };
        let tried = std::iter::once(with(None)).chain(state.grid.plan.starts_s.iter().map(|t| with(Some(t))));
        let beside = beside(state, others, &tried.collect::<Vec<_>>())?;
        let (best, gain) = beside.best()?;
        let Candidate::Effect { shape, .. } = &beside.design.blocks[best].candidate else { return None };
        let cost_nats = cost_nats(shape) - cost_nats(&times_s);
        if gain < before + cost_nats || *shape == times_s {
            break;
        }
        (before, times_s) = (gain, shape.clone());
    }
    before.is_finite().then_some(times_s)
}
