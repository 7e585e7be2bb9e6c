//! What passes for scatter until it is looked for: steps, waves that do not close with the turn, and what runs on with time. Each is
//! weighed under the scatter that it leaves.

use super::*;

/// Evidence from which a wave that does not close with the turn is taken into the design matrix, nats.
const WANDERING_NATS: f64 = 8.0;
/// Most times that what runs on with time is fitted under the scatter that it left, and the part of the scatter's square from which it
/// is not worth another. Steps are not: whatever they are fitted to would leave less and less.
const RUNNING_ON_ROUNDS: usize = 5;
const QUIETER: f64 = 0.9;
/// A set with an event that alone scores so much less than the best is not searched about, nats.
const NEAR_NATS: f64 = 30.0;
/// The same where the best model has nothing that the event could stand in for: it must be better by itself, nats.
const NEARER_NATS: f64 = 0.0;
/// Most steps looked for between runs.
const MOST_BETWEEN: usize = 4;

/// Candidates in a design matrix of their own, with what each would add to the set that stands there.
struct Beside {
    design: DesignMatrix,
    /// Blocks tried with their gain in log evidence.
    gains: Vec<(usize, f64)>,
}

impl Beside {
    fn best(&self) -> Option<(usize, f64)> {
        self.gains.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

impl Engine<'_> {
    /// The best model's blocks without what moves the level from revolution to revolution or run to run.
    fn steady_set(&self) -> Vec<usize> {
        let Some(best) = &self.best else { return Vec::new() };
        let steady = |b: &usize| match &self.design.blocks[*b].candidate {
            Candidate::Effect { effect, shape, .. } => {
                effect.signature_of(self.rig, shape).accumulates == Accumulates::No
            }
            Candidate::Unknown(pattern) => !pattern.moves_levels(),
        };
        best.fit.set.iter().copied().filter(steady).collect()
    }

    /// The amplitudes of that set alone.
    fn steady_amplitudes(&self) -> Vec<(usize, f64)> {
        evidence::fit(&self.design, &self.whitened, &self.steady_set(), &[])
            .map(|fit| fit.amplitudes())
            .unwrap_or_default()
    }

    /// Looks for steps, and takes what is found into the design matrix.
    pub(super) fn look_for_events(&mut self) -> bool {
        let amplitudes = self.best.as_ref().map(|m| m.fit.amplitudes()).unwrap_or_default();
        let steady = self.steady_amplitudes();
        let found = events::find(&self.grid, &self.design, &self.noise, &amplitudes, &steady);
        let mut candidates = Vec::new();
        candidates.extend(found.patterns.into_iter().map(Candidate::Unknown));
        let excluded = |effect: &dyn Effect| self.options.exclude.iter().any(|name| name == effect.name());
        if let Some((number, effect)) = LIBRARY.iter().copied().enumerate().find(|(_, e)| e.steps() && !excluded(*e)) {
            let steps = |times_s: Vec<f64>| {
                let cost_nats = events::steps_cost_nats(times_s.len());
                Candidate::Effect { effect, number, shape: times_s, cost_nats }
            };
            candidates.extend(found.steps.into_iter().map(steps));
            candidates.extend(self.steps_between_runs(&steps).into_iter().flatten().map(steps));
        }
        candidates.retain(|candidate| self.block_of(candidate).is_none());
        let changed = !candidates.is_empty();
        self.add_and_weigh(&candidates);
        changed
    }

    /// The steps of the best model and those between runs that were taken for levels of theirs: as they are, and each moved to where
    /// it fits best.
    fn steps_between_runs(&self, steps: &dyn Fn(Vec<f64>) -> Candidate) -> Option<[Vec<f64>; 3]> {
        let best = self.best.as_ref()?;
        let fit = &best.fit;
        let (mut times_s, size_rad) =
            (0..fit.set.len()).find_map(|n| match &self.design.blocks[fit.set[n]].candidate {
                Candidate::Effect { effect, shape, .. } if effect.steps() && shape.len() > 1 => {
                    Some((shape.clone(), self.raw(best, n).beta[0]))
                }
                _ => None,
            })?;
        // Without effects that show as levels only: they have taken the steps up.
        let mut others = self.steady_set();
        others.retain(|b| match &self.design.blocks[*b].candidate {
            Candidate::Effect { effect, shape, .. } => effect.signature_of(self.rig, shape).carrier != Carrier::None,
            Candidate::Unknown(_) => true,
        });
        let mut before = f64::NEG_INFINITY;
        for _ in 0..MOST_BETWEEN {
            let with = |more: Option<&f64>| {
                let mut shape: Vec<f64> = times_s.iter().chain(more).copied().collect();
                shape.sort_by(f64::total_cmp);
                steps(shape)
            };
            let tried = std::iter::once(with(None)).chain(self.grid.plan.starts_s.iter().map(|t| with(Some(t))));
            let beside = self.beside(&others, &tried.collect::<Vec<_>>())?;
            let (best, gain) = beside.best()?;
            let Candidate::Effect { shape, .. } = &beside.design.blocks[best].candidate else { return None };
            let cost_nats = events::steps_cost_nats(shape.len()) - events::steps_cost_nats(times_s.len());
            if gain < before + cost_nats || *shape == times_s {
                break;
            }
            (before, times_s) = (gain, shape.clone());
        }
        let place = |b: &usize| fit.set.iter().position(|own| own == b);
        let stays = |b: &usize| place(b).map(|n| fit.place(&self.design, n)).into_iter().flatten();
        let amplitudes: Vec<(usize, f64)> =
            others.iter().flat_map(stays).map(|n| (fit.columns[n], fit.mean[n])).collect();
        let rest = self.design.rest(&self.grid, &amplitudes);
        // Of the size in the model, and of their own: what else is in the model may have taken a part of it.
        let settled = |size_rad| events::settle(&self.grid, &self.noise, &rest, &times_s, size_rad);
        let (as_found, of_their_own) = (settled(Some(size_rad)), settled(None));
        before.is_finite().then_some([times_s, as_found, of_their_own])
    }

    /// Looks for levels that settle in each run, swing or wander with time, and takes into the design matrix what is worth it.
    pub(super) fn look_for_what_runs_on(&mut self) -> bool {
        let rest = self.design.rest(&self.grid, &self.steady_amplitudes());
        let sectors = sectors::sectors(&self.grid, &self.noise, &rest);
        let (settling, walk) = Pattern::running_on(&self.grid.plan);
        let worth = |pattern: Pattern| (sectors::worth(&self.grid, &sectors, &pattern), pattern);
        let settles = settling.into_iter().map(worth).max_by(|a, b| a.0.total_cmp(&b.0));
        let others = slow_tone::strongest(&self.grid, &sectors).into_iter().chain(walk).map(worth);
        let worth_it: Vec<Pattern> =
            settles.into_iter().chain(others).filter(|(nats, _)| *nats > 0.0).map(|(_, pattern)| pattern).collect();
        let mut changed = false;
        for candidate in worth_it.into_iter().map(Candidate::Unknown) {
            if let Some(noise) = self.noise_with(&candidate, RUNNING_ON_ROUNDS) {
                changed = true;
                for block in self.design.add(&self.grid, self.rig, &[candidate]) {
                    self.weigh_event(block, noise.clone());
                }
            }
        }
        changed
    }

    /// Looks for waves over the driver's angle that do not close with its turn, in a design matrix of its own, and takes the best into the
    /// design where it is worth it.
    pub(super) fn look_for_wandering_waves(&mut self) -> bool {
        let span_rev = self.grid.span_rev();
        let mut patterns = Pattern::wandering(span_rev);
        let mut step = 1.0;
        let found = self.best.as_ref().map(|m| m.fit.set.clone()).unwrap_or_default();
        let mut best: Option<(Pattern, f64)> = None;
        for _ in 0..3 {
            let tried: Vec<Candidate> = patterns.iter().cloned().map(Candidate::Unknown).collect();
            let Some(beside) = self.beside(&found, &tried) else { return false };
            for (block, gain) in &beside.gains {
                if let Candidate::Unknown(pattern) = &beside.design.blocks[*block].candidate
                    && best.as_ref().is_none_or(|(_, g)| gain > g)
                {
                    best = Some((pattern.clone(), *gain));
                }
            }
            let Some((pattern, _)) = best.as_ref().filter(|(_, gain)| *gain > WANDERING_NATS) else { return false };
            patterns = pattern.nearer(step, span_rev);
            step *= 0.5;
        }
        let Some((pattern, _)) = best else { return false };
        self.add_and_weigh(&[Candidate::Unknown(pattern)])
    }

    /// Adds events to the design matrix and weighs each; true where any could be added.
    fn add_and_weigh(&mut self, events: &[Candidate]) -> bool {
        let added = self.design.add(&self.grid, self.rig, events);
        for block in &added {
            if let Some(noise) = self.noise_with(&self.design.blocks[*block].candidate, 1) {
                self.weigh_event(*block, noise);
            }
        }
        !added.is_empty()
    }

    /// What each of several candidates would add to a set of blocks, in a design matrix of their own.
    fn beside(&self, others: &[usize], tried: &[Candidate]) -> Option<Beside> {
        let mut design = self.design.only(&self.grid, others);
        let set: Vec<usize> = (0..others.len()).collect();
        let tried = design.add(&self.grid, self.rig, tried);
        let whitened = self.noise.whiten(&self.grid, &design);
        let fit = evidence::fit(&design, &whitened, &set, &[])?;
        let gains = evidence::scan(&design, &whitened, &fit, &tried);
        Some(Beside { gains: tried.into_iter().zip(gains).collect(), design })
    }

    /// Steps and tones pass for scatter until they are taken off: the noise that one leaves beside what does not move the level,
    /// where that alone comes near the best model.
    fn noise_with(&self, event: &Candidate, rounds: usize) -> Option<Noise> {
        let steady = self.steady_set();
        let best = self.best.as_ref()?;
        // In a design matrix of its own: most events that are none fail here.
        let mut few = self.design.only(&self.grid, &steady);
        few.add(&self.grid, self.rig, std::slice::from_ref(event));
        let own: Vec<usize> = (0..few.blocks.len()).collect();
        let mut noise = self.noise.clone();
        // What passes for scatter holds its own amplitudes down until the scatter is less.
        for _ in 0..rounds {
            let before = noise.floor_rad2();
            let fit = evidence::fit(&few, &noise.whiten(&self.grid, &few), &own, &[])?;
            let run_ratio = noise.run_ratio;
            noise = Noise::estimate(&self.grid, &few, &fit.amplitudes());
            noise.run_ratio = run_ratio;
            noise.run_ratio = self.best_run_ratio(&noise, &few, &fit);
            if noise.floor_rad2() > QUIETER * before {
                break;
            }
        }
        let alone = self.search_in(&few, &noise.whiten(&self.grid, &few)).model(own, None)?;
        let room = if steady.len() < best.fit.set.len() { NEAR_NATS } else { NEARER_NATS };
        (alone.score > best.score - room).then_some(noise)
    }

    /// Weighs a model with an event under the noise that it leaves against the best model under its own.
    fn weigh_event(&mut self, block: usize, noise: Noise) {
        let mut set = self.steady_set();
        set.push(block);
        let whitened = noise.whiten(&self.grid, &self.design);
        let with_event = self.search_in(&self.design, &whitened).climb(set, Allowed::All);
        if let Some(model) = with_event.filter(|model| self.best.as_ref().is_none_or(|best| model.score > best.score)) {
            self.best = Some(model);
            self.noise = noise;
            self.whitened = whitened;
        }
    }
}
