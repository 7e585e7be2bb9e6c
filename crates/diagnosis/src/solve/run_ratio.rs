//! The scatter between runs, weighed against that between revolutions.

use super::state::State;
use crate::design_matrix::{DesignMatrix, RESIDUAL};
use crate::evidence::{self, Fit};
use crate::grid::Grid;
use crate::noise::Noise;
use crate::settings::NoiseSettings;

/// Estimates the noise that the best model leaves.
pub(super) fn estimate_noise(state: &mut State<'_>) {
    let ratio = state.noise.run_ratio;
    state.noise = Noise::estimate(&state.grid, &state.design, &state.amplitudes(), &state.settings().noise);
    state.noise.run_ratio = ratio;
    if let Some(best) = &state.best {
        state.noise.run_ratio =
            best_run_ratio(&state.grid, &state.noise, &state.design, &best.fit, &state.settings().noise);
    }
}

/// The scatter between runs that a fit leaves, weighed on a grid.
pub(super) fn best_run_ratio(
    grid: &Grid,
    noise: &Noise,
    design: &DesignMatrix,
    fit: &Fit,
    settings: &NoiseSettings,
) -> [f64; 2] {
    if grid.plan.runs < 2 {
        return noise.run_ratio;
    }
    let mut columns = vec![RESIDUAL];
    columns.extend(&fit.columns);
    let mut chosen = (f64::NEG_INFINITY, noise.run_ratio);
    let within = noise.within_runs(grid, design, Some(&columns));
    for level in settings.run_ratios {
        for waves in settings.run_ratios {
            let ratio = [level, waves];
            let whitened = within.between_runs(ratio);
            let log_prior: f64 = ratio
                .iter()
                .zip(settings.first_run_ratio)
                .map(|(ratio, usual)| -0.5 * ((ratio / usual).ln() / settings.run_ratio_spread).powi(2))
                .sum();
            let score = evidence::at_scales(design, &whitened, fit) + log_prior;
            if score > chosen.0 {
                chosen = (score, ratio);
            }
        }
    }
    chosen.1
}
