//! What passes for scatter until it is looked for: events are weighed under the scatter that they leave.

use super::run_ratio::best_run_ratio;
use super::state::State;
use crate::design_matrix::{Candidate, DesignMatrix};
use crate::evidence;
use crate::noise::Noise;
use crate::search::Allowed;

/// Candidates in a design matrix of their own, with what each would add to the set that stands there.
pub(super) struct Beside {
    pub(super) design: DesignMatrix,
    /// Blocks tried with their gain in log evidence.
    pub(super) gains: Vec<(usize, f64)>,
}

impl Beside {
    pub(super) fn best(&self) -> Option<(usize, f64)> {
        self.gains.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// What each of several candidates would add to a set of blocks, in a design matrix of their own.
pub(super) fn beside(state: &State<'_>, others: &[usize], tried: &[Candidate]) -> Option<Beside> {
    let mut design = state.design.only(&state.grid, others);
    let set: Vec<usize> = (0..others.len()).collect();
    let tried = design.add(&state.grid, state.rig, tried);
    let whitened = state.noise.whiten(&state.grid, &design);
    let fit = evidence::fit(&design, &whitened, &set, &[])?;
    let gains = evidence::scan(&design, &whitened, &fit, &tried);
    Some(Beside { gains: tried.into_iter().zip(gains).collect(), design })
}

/// Adds events to the design matrix and weighs each; true where any could be added.
pub(super) fn add_and_weigh(state: &mut State<'_>, events: &[Candidate]) -> bool {
    let added = state.design.add(&state.grid, state.rig, events);
    for block in &added {
        if let Some(noise) = noise_with(state, &state.design.blocks[*block].candidate, 1) {
            weigh(state, *block, noise);
        }
    }
    !added.is_empty()
}

/// Steps and tones pass for scatter until they are taken off: the noise that one leaves beside what does not move the level, where
/// that alone comes near the best model.
pub(super) fn noise_with(state: &State<'_>, event: &Candidate, rounds: usize) -> Option<Noise> {
    let settings = state.settings();
    let steady = state.steady_set();
    let best = state.best.as_ref()?;
    // In a design matrix of its own: most events that are none fail here.
    let mut few = state.design.only(&state.grid, &steady);
    few.add(&state.grid, state.rig, std::slice::from_ref(event));
    let own: Vec<usize> = (0..few.blocks.len()).collect();
    let mut noise = state.noise.clone();
    // What passes for scatter holds its own amplitudes down until the scatter is less.
    for _ in 0..rounds {
        let before = noise.floor_rad2();
        let fit = evidence::fit(&few, &noise.whiten(&state.grid, &few), &own, &[])?;
        let run_ratio = noise.run_ratio;
        noise = Noise::estimate(&state.grid, &few, &fit.amplitudes(), &settings.noise);
        noise.run_ratio = run_ratio;
        noise.run_ratio = best_run_ratio(&state.grid, &noise, &few, &fit, &settings.noise);
        if noise.floor_rad2() > settings.running_on.quieter * before {
            break;
        }
    }
    let alone = state.search_in(&few, &noise.whiten(&state.grid, &few)).model(own, None)?;
    let room = if steady.len() < best.fit.set.len() {
        settings.search.event_near_nats
    } else {
        settings.search.event_alone_nats
    };
    (alone.score > best.score - room).then_some(noise)
}

/// Weighs a model with an event under the noise that it leaves against the best model under its own.
pub(super) fn weigh(state: &mut State<'_>, block: usize, noise: Noise) {
    let mut set = state.steady_set();
    set.push(block);
    let whitened = noise.whiten(&state.grid, &state.design);
    let with_event = state.search_in(&state.design, &whitened).climb(set, Allowed::All);
    if let Some(model) = with_event.filter(|model| state.best.as_ref().is_none_or(|best| model.score > best.score)) {
        state.best = Some(model);
        state.noise = noise;
        state.whitened = whitened;
    }
}
