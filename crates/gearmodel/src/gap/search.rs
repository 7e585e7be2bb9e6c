//! Search over sets of blocks: several starts, additions, removals and swaps, until none raises the posterior.

use std::collections::HashMap;

use super::evidence::{Fit, WIDE, fit, scan};
use super::noise::Whitened;
use super::pool::{Cause, Pool};

/// Prior odds that an effect of the library is there, before its shape is chosen.
const EFFECT_ODDS: f64 = 0.04;
/// Prior odds that any pattern outside the library is there, shared by all of them.
const UNKNOWN_ODDS: f64 = 0.15;
/// Prior of an effect that is known to be there, nats.
const KNOWN_NATS: f64 = 1e4;
/// Most blocks of a set.
const LARGEST_SET: usize = 8;
/// Largest part, in parts of the whole residual.
const LARGEST: f64 = 3.0;
/// How many of the best candidates are tried exactly.
const TRIED: usize = 5;
/// Candidates kept of a scan.
const MOST_RANKED: usize = 60;
/// Starts beside the empty set.
const STARTS: usize = 4;

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
    pool: &'a Pool,
    whitened: &'a Whitened,
    /// Constant of this noise: what the evidence of the empty set lacks.
    offset: f64,
    /// RMS from which two parts that cancel are no explanation, rad.
    largest_rad: f64,
    priors: Vec<f64>,
    seen: HashMap<Vec<usize>, Option<Model>>,
    scanned: HashMap<(Vec<usize>, Allowed), Ranking>,
}

impl<'a> Search<'a> {
    /// A search in a pool under one noise.
    #[must_use]
    pub fn new(pool: &'a Pool, whitened: &'a Whitened, known: &[String]) -> Self {
        let unknowns = pool.blocks.iter().filter(|b| matches!(b.cause, Cause::Unknown(_))).count().max(1) as f64;
        let priors = pool
            .blocks
            .iter()
            .map(|block| match &block.cause {
                // What is known to be there needs no evidence.
                Cause::Effect { effect, .. } if known.iter().any(|name| name == effect.name()) => KNOWN_NATS,
                Cause::Effect { cost_nats, .. } => EFFECT_ODDS.ln() - cost_nats,
                Cause::Unknown(pattern) => UNKNOWN_ODDS.ln() - unknowns.ln() - pattern.cost_nats(),
            })
            .collect();
        let offset = -0.5 * whitened.log_det - 0.5 * whitened.gram[(0, 0)];
        let largest_rad = LARGEST * pool.residual_rms_rad();
        Self { pool, whitened, offset, largest_rad, priors, seen: HashMap::new(), scanned: HashMap::new() }
    }

    fn library(&self, block: usize) -> Option<usize> {
        match &self.pool.blocks[block].cause {
            Cause::Effect { number, .. } => Some(*number),
            Cause::Unknown(_) => None,
        }
    }

    /// The model of a set; fitted once.
    pub fn model(&mut self, mut set: Vec<usize>, near: Option<&Fit>) -> Option<Model> {
        set.sort_unstable();
        if let Some(known) = self.seen.get(&set) {
            return known.clone();
        }
        let start: Vec<f64> = set
            .iter()
            .map(|b| {
                near.and_then(|fit| fit.set.iter().position(|x| x == b).map(|n| fit.scales_rad[n])).unwrap_or(3e-5)
            })
            .collect();
        let fitted = fit(self.pool, self.whitened, &set, &start)
            .filter(|fit| (0..set.len()).all(|n| fit.rms_rad(self.pool, n) < self.largest_rad));
        let model = fitted.map(|fit| {
            let prior: f64 = set.iter().map(|b| self.priors[*b]).sum();
            Model { score: self.offset + fit.log_evidence + prior, fit }
        });
        self.seen.insert(set, model.clone());
        model
    }

    /// Candidates that may join a set: one shape of an effect at a time.
    fn open(&self, set: &[usize], allowed: Allowed) -> Vec<usize> {
        (0..self.pool.blocks.len())
            .filter(|b| !set.contains(b))
            .filter(|b| match self.library(*b) {
                Some(number) => {
                    (allowed != Allowed::Narrow || self.pool.blocks[*b].width() <= WIDE)
                        && !set.iter().any(|s| self.library(*s) == Some(number))
                }
                None => allowed == Allowed::All,
            })
            .filter(|b| !set.iter().any(|s| self.pool.blocks[*s].cause.excludes(&self.pool.blocks[*b].cause)))
            .collect()
    }

    /// The best additions to a model: (block, score by the scan).
    fn additions(&mut self, model: &Model, allowed: Allowed, count: usize) -> Ranking {
        let key = (model.fit.set.clone(), allowed);
        if let Some(known) = self.scanned.get(&key) {
            return known[..count.min(known.len())].to_vec();
        }
        let candidates = self.open(&model.fit.set, allowed);
        let gains = scan(self.pool, self.whitened, &model.fit, &candidates);
        let mut ranked: Ranking =
            candidates.iter().zip(gains).map(|(b, gain)| (*b, model.score + gain + self.priors[*b])).collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranked.truncate(MOST_RANKED);
        let best = ranked[..count.min(ranked.len())].to_vec();
        self.scanned.insert(key, ranked);
        best
    }

    /// Climbs from a set to where no addition, removal or swap raises the posterior.
    pub fn climb(&mut self, start: Vec<usize>, allowed: Allowed) -> Option<Model> {
        let mut best = self.model(start, None)?;
        for _ in 0..40 {
            let mut next = best.clone();
            let mut consider = |search: &mut Self, set: Vec<usize>, near: &Fit| {
                if let Some(model) = search.model(set, Some(near))
                    && model.score > next.score + 1e-6
                {
                    next = model;
                }
            };
            if best.fit.set.len() < LARGEST_SET {
                for (block, score) in self.additions(&best, allowed, TRIED) {
                    if score > best.score - 3.0 {
                        consider(self, with(&best.fit.set, block), &best.fit);
                    }
                }
            }
            for n in 0..best.fit.set.len() {
                let mut set = best.fit.set.clone();
                set.remove(n);
                let Some(fewer) = self.model(set.clone(), Some(&best.fit)) else { continue };
                consider(self, set.clone(), &best.fit);
                for (block, score) in self.additions(&fewer, allowed, TRIED) {
                    if score > best.score - 3.0 {
                        consider(self, with(&set, block), &best.fit);
                    }
                }
            }
            if next.score <= best.score + 1e-6 {
                // At the top of one hill: one effect may stand for two that together look like it.
                next = self.one_for_two(&best, allowed).unwrap_or(next);
            }
            if next.score <= best.score + 1e-6 {
                break;
            }
            best = next;
        }
        Some(best)
    }

    /// The best model with one block in place of two, where that is better.
    fn one_for_two(&mut self, best: &Model, allowed: Allowed) -> Option<Model> {
        let mut better: Option<Model> = None;
        let set = &best.fit.set;
        for m in 0..set.len() {
            for n in 0..m {
                let rest = without(set, &[set[m], set[n]]);
                let Some(fewer) = self.model(rest.clone(), Some(&best.fit)) else { continue };
                for (block, score) in self.additions(&fewer, allowed, TRIED) {
                    if score > best.score - 3.0
                        && let Some(model) = self.model(with(&rest, block), Some(&best.fit))
                        && model.score > better.as_ref().map_or(best.score + 1e-6, |b| b.score)
                    {
                        better = Some(model);
                    }
                }
            }
        }
        better
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
        for (block, score) in self.additions(&empty, Allowed::Library, STARTS) {
            if score < empty.score - 2.0 {
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
        let room = 9.0;
        for (block, score) in self.additions(best, Allowed::All, 60) {
            if score > best.score - room {
                self.model(with(&best.fit.set, block), Some(&best.fit));
            }
        }
        for n in 0..best.fit.set.len() {
            let mut set = best.fit.set.clone();
            set.remove(n);
            let Some(fewer) = self.model(set.clone(), Some(&best.fit)) else { continue };
            for (block, score) in self.additions(&fewer, Allowed::All, 40) {
                if score > best.score - room {
                    self.model(with(&set, block), Some(&best.fit));
                }
            }
        }
    }

    /// All models seen, best first.
    #[must_use]
    pub fn models(&self) -> Vec<Model> {
        let mut models: Vec<Model> = self.seen.values().flatten().cloned().collect();
        models.sort_by(|a, b| b.score.total_cmp(&a.score).then_with(|| a.fit.set.cmp(&b.fit.set)));
        models
    }
}

fn without(set: &[usize], blocks: &[usize]) -> Vec<usize> {
    set.iter().copied().filter(|b| !blocks.contains(b)).collect()
}

fn with(set: &[usize], block: usize) -> Vec<usize> {
    let mut set = set.to_vec();
    set.push(block);
    set.sort_unstable();
    set
}
