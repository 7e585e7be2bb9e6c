//! Search over sets of blocks: several starts, additions, removals and swaps, until none raises the posterior.

use std::collections::HashMap;

use rayon::prelude::*;

use super::design_matrix::{Candidate, DesignMatrix};
use super::evidence::{Fit, fit, scan};
use super::noise::Whitened;
use super::settings::{SearchSettings, Settings};

/// What may join a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Allowed {
    /// Effects of few columns.
    Narrow,
    /// All effects.
    Library,
    /// Effects and patterns outside the library.
    All,
}

/// A set with its log posterior, not normalised.
#[derive(Clone, Debug)]
pub struct Model {
    /// The fit.
    pub fit: Fit,
    /// Log evidence + log prior.
    pub score: f64,
}

/// Blocks with the score that their addition is expected to reach, best first.
type Ranking = Vec<(usize, f64)>;

/// Everything seen on the way.
pub struct Search<'a> {
    design: &'a DesignMatrix,
    whitened: &'a Whitened,
    /// Constant of this noise: what the evidence of the empty set lacks.
    offset: f64,
    /// RMS below which a part may be what something that was cut out has left, rad.
    least_rad: f64,
    /// RMS from which two parts that cancel are no explanation, rad.
    largest_rad: f64,
    priors: Vec<f64>,
    settings: SearchSettings,
    seen: HashMap<Vec<usize>, Option<Model>>,
    scanned: HashMap<(Vec<usize>, Allowed), Ranking>,
}

impl<'a> Search<'a> {
    /// A search in a design matrix under one noise.
    #[must_use]
    pub fn new(
        design: &'a DesignMatrix,
        whitened: &'a Whitened,
        known: &[String],
        least_rad: f64,
        settings: &Settings,
    ) -> Self {
        let own = &settings.search;
        let unknowns =
            design.blocks.iter().filter(|b| matches!(b.candidate, Candidate::Unknown(_))).count().max(1) as f64;
        let priors = design
            .blocks
            .iter()
            .map(|block| match &block.candidate {
                // What is known to be there needs no evidence.
                Candidate::Effect { effect, .. } if known.iter().any(|name| name == effect.name()) => own.known_nats,
                Candidate::Effect { cost_nats, .. } => own.effect_odds.ln() - cost_nats,
                Candidate::Unknown(pattern) => own.unknown_odds.ln() - unknowns.ln() - pattern.cost_nats(settings),
            })
            .collect();
        let offset = -0.5 * whitened.log_det - 0.5 * whitened.gram[(0, 0)];
        let largest_rad = own.largest_part * design.residual_rms_rad();
        Self {
            design,
            whitened,
            offset,
            least_rad,
            largest_rad,
            priors,
            settings: settings.search,
            seen: HashMap::new(),
            scanned: HashMap::new(),
        }
    }

    fn library(&self, block: usize) -> Option<usize> {
        match &self.design.blocks[block].candidate {
            Candidate::Effect { number, .. } => Some(*number),
            Candidate::Unknown(_) => None,
        }
    }

    /// The model of a set; fitted once.
    pub fn model(&mut self, set: Vec<usize>, near: Option<&Fit>) -> Option<Model> {
        self.models_of(vec![set], near).pop()
    }

    /// The models of sets, each fitted once, on all cores; those that cannot be fitted are left out.
    fn models_of(&mut self, mut sets: Vec<Vec<usize>>, near: Option<&Fit>) -> Vec<Model> {
        sets.iter_mut().for_each(|set| set.sort_unstable());
        let mut fresh: Vec<Vec<usize>> = sets.iter().filter(|set| !self.seen.contains_key(*set)).cloned().collect();
        fresh.sort_unstable();
        fresh.dedup();
        let fitted: Vec<Option<Model>> = fresh.par_iter().map(|set| self.fit(set, near)).collect();
        self.seen.extend(fresh.into_iter().zip(fitted));
        sets.iter().filter_map(|set| self.seen[set].clone()).collect()
    }

    fn fit(&self, set: &[usize], near: Option<&Fit>) -> Option<Model> {
        let start: Vec<f64> = set
            .iter()
            .map(|b| {
                near.and_then(|fit| fit.set.iter().position(|x| x == b).map(|n| fit.scales_rad[n]))
                    .unwrap_or(self.design.evidence().first_scale_rad)
            })
            .collect();
        let fit = fit(self.design, self.whitened, set, &start)?;
        let possible =
            (0..set.len()).all(|n| (self.least_rad..self.largest_rad).contains(&fit.rms_rad(self.design, n)));
        let candidates = || set.iter().map(|b| &self.design.blocks[*b].candidate);
        let chances = candidates().flat_map(|a| candidates().map(|b| a.coincides(b))).filter(|same| *same).count();
        let prior = set.iter().map(|b| self.priors[*b]).sum::<f64>() - self.settings.chance_nats * chances as f64;
        possible.then_some(Model { score: self.offset + fit.log_evidence + prior, fit })
    }

    /// Candidates that may join a set: one shape of an effect at a time.
    fn open(&self, set: &[usize], allowed: Allowed) -> Vec<usize> {
        (0..self.design.blocks.len())
            .filter(|b| !set.contains(b))
            .filter(|b| match self.library(*b) {
                Some(number) => {
                    (allowed != Allowed::Narrow
                        || self.design.blocks[*b].width() <= self.design.evidence().wide_columns)
                        && !set.iter().any(|s| self.library(*s) == Some(number))
                }
                None => allowed == Allowed::All,
            })
            .filter(|b| {
                !set.iter().any(|s| self.design.blocks[*s].candidate.excludes(&self.design.blocks[*b].candidate))
            })
            .collect()
    }

    /// The best additions to a model: (block, score by the scan).
    fn additions(&mut self, model: &Model, allowed: Allowed, count: usize) -> Ranking {
        let key = (model.fit.set.clone(), allowed);
        if let Some(known) = self.scanned.get(&key) {
            return known[..count.min(known.len())].to_vec();
        }
        let candidates = self.open(&model.fit.set, allowed);
        let gains = scan(self.design, self.whitened, &model.fit, &candidates);
        let mut ranked: Ranking =
            candidates.iter().zip(gains).map(|(b, gain)| (*b, model.score + gain + self.priors[*b])).collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranked.truncate(self.settings.most_ranked);
        let best = ranked[..count.min(ranked.len())].to_vec();
        self.scanned.insert(key, ranked);
        best
    }

    /// Models of sets about a model: some `bases`, and each with the additions that might come within `room` of the model.
    fn about(
        &mut self,
        model: &Model,
        bases: Vec<Vec<usize>>,
        allowed: Allowed,
        tried: usize,
        room: f64,
    ) -> Vec<Model> {
        let mut models = self.models_of(bases, Some(&model.fit));
        let mut sets = Vec::new();
        let largest_set = self.settings.largest_set;
        for base in models.iter().filter(|base| base.fit.set.len() < largest_set) {
            let additions = self.additions(base, allowed, tried).into_iter();
            let near = additions.filter(|(_, score)| *score > model.score - room);
            sets.extend(near.map(|(block, _)| with(&base.fit.set, block)));
        }
        models.extend(self.models_of(sets, Some(&model.fit)));
        models
    }

    /// Climbs from a set to where no addition, removal or swap raises the posterior.
    pub fn climb(&mut self, start: Vec<usize>, allowed: Allowed) -> Option<Model> {
        let mut best = self.model(start, None)?;
        for _ in 0..self.settings.most_moves {
            let set = &best.fit.set;
            let mut next = self.higher(&best, fewer_by_one(set).chain([set.clone()]).collect(), allowed);
            if next.is_none() {
                // At the top of one hill: one effect may stand for two that together look like it.
                next = self.higher(&best, fewer_by_two(&best.fit.set), allowed);
            }
            match next {
                Some(next) => best = next,
                None => break,
            }
        }
        Some(best)
    }

    /// The best model about another, where it is better.
    fn higher(&mut self, best: &Model, bases: Vec<Vec<usize>>, allowed: Allowed) -> Option<Model> {
        let models = self.about(best, bases, allowed, self.settings.tried, self.settings.climbing_nats);
        let highest = models.into_iter().max_by(|a, b| a.score.total_cmp(&b.score))?;
        (highest.score > best.score + 1e-6).then_some(highest)
    }

    /// The best model: the library first from several starts, then with patterns outside it.
    pub fn run(&mut self) -> Option<Model> {
        let empty = self.model(Vec::new(), None)?;
        let mut best = self.climb(Vec::new(), Allowed::Library)?;
        // A wide block takes up what a few narrow ones would explain, and is not given up again: those first, without it.
        let narrow = self.climb(Vec::new(), Allowed::Narrow)?;
        let narrow = self.climb(narrow.fit.set, Allowed::Library)?;
        if narrow.score > best.score {
            best = narrow;
        }
        for (block, score) in self.additions(&empty, Allowed::Library, self.settings.starts) {
            if score < empty.score - self.settings.start_nats {
                continue;
            }
            if let Some(model) = self.climb(vec![block], Allowed::Library)
                && model.score > best.score
            {
                best = model;
            }
        }
        let mut with_unknown = self.climb(best.fit.set, Allowed::All)?;
        // And the other way round: what lies outside may be the larger part.
        if let Some((block, score)) = self.additions(&empty, Allowed::All, 1).into_iter().next()
            && score > empty.score
            && self.library(block).is_none()
            && let Some(model) = self.climb(vec![block], Allowed::All)
            && model.score > with_unknown.score
        {
            with_unknown = model;
        }
        Some(with_unknown)
    }

    /// Looks around a model so that what competes with it has been seen: additions, removals, swaps.
    pub fn explore(&mut self, best: &Model) {
        self.about(
            best,
            vec![best.fit.set.clone()],
            Allowed::All,
            self.settings.most_ranked,
            self.settings.competing_nats,
        );
        self.about(
            best,
            fewer_by_one(&best.fit.set).collect(),
            Allowed::All,
            self.settings.most_exchanged,
            self.settings.competing_nats,
        );
    }

    /// All models seen, best first.
    #[must_use]
    pub fn models(&self) -> Vec<Model> {
        let mut models: Vec<Model> = self.seen.values().flatten().cloned().collect();
        models.sort_by(|a, b| b.score.total_cmp(&a.score).then_with(|| a.fit.set.cmp(&b.fit.set)));
        models
    }
}

fn fewer_by_one(set: &[usize]) -> impl Iterator<Item = Vec<usize>> + '_ {
    set.iter().map(|out| set.iter().copied().filter(|b| b != out).collect())
}

fn fewer_by_two(set: &[usize]) -> Vec<Vec<usize>> {
    let pairs = (0..set.len()).flat_map(|m| (0..m).map(move |n| [set[m], set[n]]));
    pairs.map(|out| set.iter().copied().filter(|b| !out.contains(b)).collect()).collect()
}

fn with(set: &[usize], block: usize) -> Vec<usize> {
    let mut set = set.to_vec();
    set.push(block);
    set.sort_unstable();
    set
}
