//! What the steps of a report look at.

use gearmodel::effect::{Estimate, NominalRig};

use crate::design_matrix::{Candidate, DesignMatrix};
use crate::evidence;
use crate::grid::Grid;
use crate::noise::{Noise, Whitened};
use crate::search::Model;
use crate::settings::Settings;
use crate::solve::Solution;
use crate::taken_off::TakenOff;

/// The best model with all that it was found from.
pub(super) struct Context<'a> {
    pub(super) rig: &'a NominalRig,
    pub(super) grid: &'a Grid,
    pub(super) design: &'a DesignMatrix,
    pub(super) noise: &'a Noise,
    pub(super) whitened: &'a Whitened,
    pub(super) taken_off: &'a TakenOff,
    pub(super) best: &'a Model,
    pub(super) settings: &'a Settings,
}

impl<'a> Context<'a> {
    /// `None` where no model could be fitted.
    pub(super) fn new(solution: &'a Solution<'a>) -> Option<Self> {
        let Solution { rig, grid, design, noise, whitened, taken_off, models, options } = solution;
        Some(Self { rig, grid, design, noise, whitened, taken_off, best: models.first()?, settings: &options.settings })
    }

    /// Amplitudes of block `n` of a model in the effect's own units.
    pub(super) fn estimate(&self, model: &Model, n: usize) -> Estimate {
        evidence::estimate(self.design, self.whitened, &model.fit, n)
    }

    /// Mean square of the encoders' sub-divisional errors, rad².
    pub(super) fn lines_rad2(&self) -> f64 {
        self.taken_off.lines_rad2(self.grid.samples)
    }

    /// Where in the best model resonances stand, and their frequencies, Hz.
    pub(super) fn rings_hz(&self) -> impl Iterator<Item = (usize, f64)> {
        let set = &self.best.fit.set;
        (0..set.len()).filter_map(|n| match &self.design.blocks[set[n]].candidate {
            Candidate::Effect { effect, shape, .. } => Some((n, effect.rings_hz(shape, &self.estimate(self.best, n))?)),
            Candidate::Unknown(_) => None,
        })
    }

    /// Mean square of the resonances in the best model, rad².
    pub(super) fn rings_rad2(&self) -> f64 {
        self.rings_hz().map(|(n, _)| self.best.fit.rms_rad(self.design, n).powi(2)).sum()
    }
}
