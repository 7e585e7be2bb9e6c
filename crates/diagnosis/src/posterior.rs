//! Posterior over models → probabilities of effects, groups and the unknown.

use nalgebra::{Cholesky, DMatrix};

use super::design_matrix::ZERO;
use super::design_matrix::{Block, Candidate, DesignMatrix};
use super::noise::Whitened;
use super::search::Model;
use super::settings::ReportSettings;
use gearmodel::effect::LIBRARY;

/// Ridge of the Gram matrix of a sum of two blocks.
const SUM_RIDGE: f64 = 1e-10;

/// Probabilities from all models seen.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// Posterior inclusion by place in the library.
    pub probability: Vec<f64>,
    /// Best block of every effect: of the most probable models that have it, else the one that fits best alone.
    pub block: Vec<Option<usize>>,
    /// Probability of any pattern outside the library.
    pub unknown: f64,
    /// Weights of the models, best first.
    pub weights: Vec<f64>,
}

fn number(block: &Block) -> Option<usize> {
    match &block.candidate {
        Candidate::Effect { number, .. } => Some(*number),
        Candidate::Unknown(_) => None,
    }
}

/// Posterior of effects. `sharpness` under 1 flattens what the noise model's own error makes too sure.
#[must_use]
pub fn posterior(design: &DesignMatrix, models: &[Model], sharpness: f64) -> Posterior {
    let best = models.first().map_or(0.0, |m| m.score);
    let mut weights: Vec<f64> = models.iter().map(|m| (sharpness * (m.score - best)).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= total);
    let mut probability = vec![0.0; LIBRARY.len()];
    let mut block = vec![None; LIBRARY.len()];
    let mut unknown = 0.0;
    for (model, weight) in models.iter().zip(&weights) {
        let mut outside = false;
        for b in &model.fit.set {
            match number(&design.blocks[*b]) {
                Some(n) => {
                    probability[n] += weight;
                    // Models come best first.
                    block[n].get_or_insert(*b);
                }
                None => outside = true,
            }
        }
        if outside {
            unknown += weight;
        }
    }
    Posterior { probability, block, unknown, weights }
}

/// Largest principal angle between two blocks' subspaces, of the smaller one's directions, deg.
#[must_use]
pub fn angle_deg(design: &DesignMatrix, whitened: &Whitened, a: usize, b: usize) -> f64 {
    let columns = |block: usize| design.blocks[block].columns.clone().collect::<Vec<_>>();
    principal_angle_deg(whitened, &columns(a), &columns(b), 0.0)
}

/// Largest principal angle from a block to the sum of two others, deg.
#[must_use]
pub(super) fn angle_to_sum_deg(design: &DesignMatrix, whitened: &Whitened, target: usize, a: usize, b: usize) -> f64 {
    let columns = |block: usize| design.blocks[block].columns.clone();
    let sum: Vec<usize> = columns(a).chain(columns(b)).collect();
    principal_angle_deg(whitened, &sum, &columns(target).collect::<Vec<_>>(), SUM_RIDGE)
}

/// Largest principal angle between the spans of columns, of the smaller one's directions, as the noise weighs them and with the zero
/// free, deg; `ridge` is what the Gram matrix of `a`, whose columns may depend on one another, gets in parts of its largest entry.
fn principal_angle_deg(whitened: &Whitened, a: &[usize], b: &[usize], ridge: f64) -> f64 {
    let g = &whitened.gram;
    let zero = g[(ZERO, ZERO)];
    let entry = |m: usize, n: usize| g[(m, n)] - g[(m, ZERO)] * g[(n, ZERO)] / zero;
    let part = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |m, n| entry(rows[m], columns[n]))
    };
    let mut gram = part(a, a);
    let ridge = ridge * gram.diagonal().max();
    for n in 0..a.len() {
        gram[(n, n)] += ridge;
    }
    let (Some(la), Some(lb)) = (Cholesky::new(gram), Cholesky::new(part(b, b))) else { return 90.0 };
    let Some(left) = la.l().solve_lower_triangular(&part(a, b)) else { return 90.0 };
    let Some(both) = lb.l().solve_lower_triangular(&left.transpose()) else { return 90.0 };
    let smallest = both.singular_values().iter().copied().fold(1.0, f64::min);
    smallest.clamp(0.0, 1.0).acos().to_degrees()
}

/// Effects that cannot be told from `effect` in this plan and fit the data about as well: their places in the library
/// with the angle, the effect itself not included.
#[must_use]
pub fn confusable(
    design: &DesignMatrix,
    whitened: &Whitened,
    posterior: &Posterior,
    effect: usize,
    swapped_score: &mut dyn FnMut(usize) -> Option<f64>,
    best_score: f64,
    settings: &ReportSettings,
) -> Vec<(usize, f64)> {
    let Some(own) = posterior.block[effect] else { return Vec::new() };
    let own_width = design.blocks[own].width();
    let mut found: Vec<(usize, f64, f64)> = Vec::new();
    for (b, block) in design.blocks.iter().enumerate() {
        let Some(n) = number(block) else { continue };
        if n == effect
            || block.width() * settings.much_wider < own_width
            || own_width * settings.much_wider < block.width()
        {
            continue;
        }
        let angle = angle_deg(design, whitened, own, b);
        if angle >= settings.same_deg {
            continue;
        }
        let Some(score) = swapped_score(b) else { continue };
        if score < best_score - settings.member_nats {
            continue;
        }
        match found.iter_mut().find(|(m, ..)| *m == n) {
            Some(known) if known.2 < score => *known = (n, angle, score),
            Some(_) => {}
            None => found.push((n, angle, score)),
        }
    }
    found.into_iter().map(|(n, angle, _)| (n, angle)).collect()
}
