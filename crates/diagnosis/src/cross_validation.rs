//! How far the gap shrinks on what was not used for the fit: each run in turn is predicted from all others.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::design_matrix::DesignMatrix;
use super::design_matrix::{RESIDUAL, ZERO};
use super::diagnosis::Gap;
use super::gram;
use super::grid::Grid;
use super::noise::Noise;
use super::waves::WAVES;

/// Columns that are refitted, with their prior variances.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Columns of the design matrix, the zero not among them.
    pub columns: Vec<usize>,
    /// Their prior variances, rad².
    pub prior_rad2: Vec<f64>,
}

/// Sums by held-out unit, ready for any selection of the columns they were made of.
pub struct HeldOut {
    /// Columns: residual, zero, then the rest.
    columns: Vec<usize>,
    /// XᵀV⁻¹X of every unit.
    grams: Vec<DMatrix<f64>>,
    /// XᵀWX of every revolution.
    squares: Vec<DMatrix<f64>>,
    /// Unit and weight of every revolution.
    revolutions: Vec<(usize, f64)>,
    /// Weight in all.
    weight: f64,
    /// Prior variance of the zero, rad².
    zero_rad2: f64,
}

/// Squared residual by revolution.
#[derive(Clone, Debug)]
pub struct Errors {
    by_revolution: Vec<f64>,
    weights: Vec<f64>,
}

impl Errors {
    /// Mean square, rad².
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.by_revolution.iter().sum::<f64>() / self.weights.iter().sum::<f64>()
    }
}

impl HeldOut {
    /// Sums for these columns of the design matrix. Units are runs, or revolutions where there is one run.
    #[must_use]
    pub fn new(grid: &Grid, design: &DesignMatrix, noise: &Noise, columns: &[usize]) -> Self {
        let mut all = vec![RESIDUAL, ZERO];
        all.extend(columns.iter().copied().filter(|c| *c != ZERO && *c != RESIDUAL));
        all.dedup();
        let values: Vec<Vec<f64>> = all.par_iter().map(|c| design.column(grid, *c)).collect();
        let by_run = grid.plan.runs > 1;
        let units = if by_run { grid.directions.len() } else { grid.revolutions.len() };
        let p = all.len();
        let precision = 1.0 / noise.white_rad2;
        let squares: Vec<DMatrix<f64>> = grid
            .revolutions
            .par_iter()
            .map(|revolution| {
                let at = revolution.places.clone();
                let x = DMatrix::from_fn(at.len(), p, |n, c| values[c][at.start + n]);
                gram::weighted(&x, &grid.weight[at])
            })
            .collect();
        let mut grams = vec![DMatrix::zeros(p, p); units];
        let mut revolutions = Vec::new();
        let mut run_sums: Vec<(DMatrix<f64>, DMatrix<f64>)> =
            vec![(DMatrix::zeros(WAVES, WAVES), DMatrix::zeros(WAVES, p)); units];
        for (number, (revolution, square)) in grid.revolutions.iter().zip(&squares).enumerate() {
            let unit = if by_run { revolution.run } else { number };
            let c = design.waves[number].select_columns(&all) * precision;
            if let Some(passing) = noise.revolution(number) {
                let lost = &passing.half * &c;
                grams[unit] += square * precision - lost.transpose() * &lost;
                run_sums[unit].0 += &passing.left;
                run_sums[unit].1 += &passing.on * &c;
            }
            revolutions.push((unit, grid.weight[revolution.places.clone()].iter().sum()));
        }
        if by_run {
            for (gram, (left, c)) in grams.iter_mut().zip(&run_sums) {
                if let Some(passing) = noise.run(left) {
                    let lost = &passing.half * c;
                    *gram -= lost.transpose() * &lost;
                }
            }
        }
        let weight = grid.weight.iter().sum();
        let zero_rad2 = design.evidence().zero_rad * design.evidence().zero_rad;
        Self { columns: all, grams, squares, revolutions, weight, zero_rad2 }
    }

    /// Residual on each unit predicted from the others with a selection of columns.
    #[must_use]
    pub fn errors(&self, selection: &Selection) -> Errors {
        let places: Vec<usize> = std::iter::once(1)
            .chain(selection.columns.iter().filter_map(|c| self.columns.iter().position(|x| x == c)))
            .collect();
        let p = places.len();
        let mut total = DMatrix::zeros(self.columns.len(), self.columns.len());
        for gram in &self.grams {
            total += gram;
        }
        let betas: Vec<DVector<f64>> = self
            .grams
            .iter()
            .map(|gram| {
                // With one unit there is nothing else to fit from: what fits is judged on itself.
                let rest = if self.grams.len() > 1 { &total - gram } else { total.clone() };
                let mut a = DMatrix::from_fn(p, p, |m, n| rest[(places[m], places[n])]);
                for n in 0..p {
                    a[(n, n)] += 1.0 / if n == 0 { self.zero_rad2 } else { selection.prior_rad2[n - 1].max(1e-20) };
                }
                let b = DVector::from_fn(p, |n, _| rest[(places[n], 0)]);
                Cholesky::new(a).map_or_else(|| DVector::zeros(p), |c| c.solve(&b))
            })
            .collect();
        let mut by_revolution = Vec::new();
        for (square, (unit, _)) in self.squares.iter().zip(&self.revolutions) {
            let beta = &betas[*unit];
            let mut sum = square[(0, 0)];
            for m in 0..p {
                sum -= 2.0 * beta[m] * square[(0, places[m])];
                for n in 0..p {
                    sum += beta[m] * beta[n] * square[(places[m], places[n])];
                }
            }
            by_revolution.push(sum.max(0.0));
        }
        Errors { by_revolution, weights: self.revolutions.iter().map(|(_, w)| *w).collect() }
    }

    /// Mean square that repeatability alone leaves at the places, rad².
    #[must_use]
    pub fn floor_rad2(&self, grid: &Grid, noise: &Noise) -> f64 {
        noise.white_rad2 * grid.places.len() as f64 / self.weight + noise.floor_rad2()
    }
}

/// Share of the reducible gap closed, with its 90 % interval from resampled revolutions; `None` where before is not above
/// the floor.
#[must_use]
pub fn closed(before: &Errors, after: &Errors, floor_rad2: f64, resamples: usize) -> Option<(f64, [f64; 2])> {
    let share = |b: f64, a: f64| (b - a) / (b - floor_rad2);
    let (b, a) = (before.mean(), after.mean());
    if b <= floor_rad2 * 1.000_001 {
        return None;
    }
    let mut random = Pcg64Mcg::seed_from_u64(0x6761_7073);
    let count = before.by_revolution.len();
    let mut shares: Vec<f64> = (0..resamples)
        .filter_map(|_| {
            let (mut weight, mut b, mut a) = (0.0, 0.0, 0.0);
            for _ in 0..count {
                let n = random.random_range(0..count);
                weight += before.weights[n];
                b += before.by_revolution[n];
                a += after.by_revolution[n];
            }
            (b / weight > floor_rad2).then(|| share(b / weight, a / weight))
        })
        .collect();
    shares.sort_by(f64::total_cmp);
    let value = share(b, a);
    if shares.len() < resamples / 2 {
        return Some((value, [value, value]));
    }
    let quantile = |q: f64| shares[((shares.len() - 1) as f64 * q) as usize];
    Some((value, [quantile(0.05).min(value), quantile(0.95).max(value)]))
}

/// RMS figures of the gap; `within_rad2` is the mean square inside the places, `explained_rad2` that part of all which line
/// errors explain.
#[must_use]
pub fn gap(
    before: &Errors,
    after: &Errors,
    floor_rad2: f64,
    within_rad2: f64,
    explained_rad2: f64,
    found: bool,
    resamples: usize,
) -> Gap {
    let total = |mean: f64| (mean + within_rad2).max(0.0).sqrt();
    let closed = if found {
        let full = Errors {
            by_revolution: before
                .by_revolution
                .iter()
                .zip(&before.weights)
                .map(|(b, w)| b + explained_rad2 * w)
                .collect(),
            weights: before.weights.clone(),
        };
        closed(&full, after, floor_rad2, resamples)
    } else {
        None
    };
    Gap {
        before_rad: total(before.mean() + explained_rad2),
        after_rad: total(after.mean()),
        floor_rad: total(floor_rad2),
        closed: closed.map(|(value, _)| value),
        closed_interval: closed.map(|(_, interval)| interval),
        budget: Vec::new(),
    }
}
