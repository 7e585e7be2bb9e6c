//! What is known at a moment: the grid, its design matrix and noise, and the best model so far.

use gearmodel::effect::{Accumulates, LIBRARY, NominalRig};

use crate::design_matrix::{Candidate, DesignMatrix};
use crate::evidence;
use crate::ghosts;
use crate::grid::Grid;
use crate::noise::{Noise, Whitened};
use crate::nuisance_patterns::Pattern;
use crate::options::Options;
use crate::search::{Allowed, Model, Search};
use crate::settings::Settings;
use crate::taken_off::TakenOff;

/// The state of a diagnosis under way.
pub(super) struct State<'a> {
    pub(super) rig: &'a NominalRig,
    pub(super) options: &'a Options,
    pub(super) taken_off: TakenOff,
    pub(super) grid: Grid,
    pub(super) design: DesignMatrix,
    pub(super) noise: Noise,
    pub(super) whitened: Whitened,
    pub(super) best: Option<Model>,
    /// The larger blocks with their shapes moved to where they fit best: a start for the next search.
    pub(super) large: Option<Vec<usize>>,
}

/// What was found, with all that it was found from.
pub(crate) struct Solution<'a> {
    /// The rig.
    pub(crate) rig: &'a NominalRig,
    /// What was said beforehand.
    pub(crate) options: &'a Options,
    /// What was taken off before.
    pub(crate) taken_off: TakenOff,
    /// Residual by revolution and angle.
    pub(crate) grid: Grid,
    /// Columns of all candidates.
    pub(crate) design: DesignMatrix,
    /// Scatter under the best model.
    pub(crate) noise: Noise,
    /// Sums under it.
    pub(crate) whitened: Whitened,
    /// All models seen under it, best first.
    pub(crate) models: Vec<Model>,
}

impl<'a> State<'a> {
    /// All candidates that the rig and the plan allow; nothing found yet.
    pub(super) fn new(rig: &'a NominalRig, grid: Grid, taken_off: TakenOff, options: &'a Options) -> Self {
        let settings = &options.settings;
        let mut design = DesignMatrix::new(&grid, settings);
        let mut candidates = Vec::new();
        for (number, effect) in LIBRARY.iter().copied().enumerate() {
            if !effect.applies(rig) || options.excludes(effect) {
                continue;
            }
            let shapes = effect.shapes(rig, &grid.plan);
            let cost_nats = settings.search.shape_cost * (shapes.len().max(1) as f64).ln();
            candidates.extend(shapes.into_iter().map(|shape| Candidate::Effect { effect, number, shape, cost_nats }));
        }
        candidates.extend(Pattern::all(&grid.plan, &settings.nuisance).into_iter().map(Candidate::Unknown));
        design.add(&grid, rig, &candidates);
        let noise = Noise::estimate(&grid, &design, &[], &settings.noise);
        let ghosts = ghosts::find(&grid, &noise, &grid.rho_rad, settings);
        design.add(&grid, rig, &ghosts.into_iter().map(Candidate::Unknown).collect::<Vec<_>>());
        let whitened = Whitened::empty();
        Self { rig, options, taken_off, grid, design, noise, whitened, best: None, large: None }
    }

    /// Every number that may be chosen.
    pub(super) fn settings(&self) -> &'a Settings {
        &self.options.settings
    }

    /// Searches under the present noise, from nothing and from the last best model.
    pub(super) fn search(&mut self) {
        self.whitened = self.noise.whiten(&self.grid, &self.design);
        let starts = self.starts();
        let best = highest(&mut self.search_in(&self.design, &self.whitened), starts);
        self.best = best;
    }

    /// Searches once more, and looks about the best model for what competes with it.
    pub(super) fn finish(mut self) -> Solution<'a> {
        self.whitened = self.noise.whiten(&self.grid, &self.design);
        let starts = self.starts();
        let mut search = self.search_in(&self.design, &self.whitened);
        if let Some(model) = highest(&mut search, starts) {
            search.explore(&model);
        }
        let models = search.models();
        let Self { rig, options, taken_off, grid, design, noise, whitened, .. } = self;
        Solution { rig, options, taken_off, grid, design, noise, whitened, models }
    }

    /// Sets that a search also starts from.
    fn starts(&mut self) -> Vec<Vec<usize>> {
        self.best.as_ref().map(|m| m.fit.set.clone()).into_iter().chain(self.large.take()).collect()
    }

    /// A search in a design matrix under one noise, with what is known and what was cut out.
    pub(super) fn search_in<'b>(&self, design: &'b DesignMatrix, whitened: &'b Whitened) -> Search<'b> {
        let settings = &self.options.settings;
        Search::new(design, whitened, &self.options.known, self.taken_off.least_rad(&settings.transients), settings)
    }

    /// Block of the design matrix with the same candidate.
    pub(super) fn block_of(&self, candidate: &Candidate) -> Option<usize> {
        self.design.blocks.iter().position(|block| match (&block.candidate, candidate) {
            (Candidate::Unknown(a), Candidate::Unknown(b)) => a == b,
            (Candidate::Effect { number: m, shape: a, .. }, Candidate::Effect { number: n, shape: b, .. }) => {
                m == n && a == b
            }
            _ => false,
        })
    }

    /// Amplitudes of the best model.
    pub(super) fn amplitudes(&self) -> Vec<(usize, f64)> {
        self.best.as_ref().map(|m| m.fit.amplitudes()).unwrap_or_default()
    }

    /// The best model's blocks without what moves the level from revolution to revolution or run to run.
    pub(super) fn steady_set(&self) -> Vec<usize> {
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
    pub(super) fn steady_amplitudes(&self) -> Vec<(usize, f64)> {
        evidence::fit(&self.design, &self.whitened, &self.steady_set(), &[])
            .map(|fit| fit.amplitudes())
            .unwrap_or_default()
    }
}

impl Solution<'_> {
    /// A search under the noise found, with what is known and what was cut out.
    pub(crate) fn search(&self) -> Search<'_> {
        let settings = &self.options.settings;
        let least_rad = self.taken_off.least_rad(&settings.transients);
        Search::new(&self.design, &self.whitened, &self.options.known, least_rad, settings)
    }
}

/// The highest model that a search reaches from nothing and from other sets.
fn highest(search: &mut Search<'_>, starts: Vec<Vec<usize>>) -> Option<Model> {
    let mut best = search.run();
    for set in starts {
        if let Some(other) = search.climb(set, Allowed::All)
            && best.as_ref().is_none_or(|b| other.score > b.score)
        {
            best = Some(other);
        }
    }
    best
}
