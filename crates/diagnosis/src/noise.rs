//! Repeatability: what differs between revolutions and runs of one condition.
//!
//! Residual of a place = model + run's waves + revolution's waves + white noise. The waves are the low orders of the driver's
//! turn, 0 … 8, and what goes from one level to the next within a revolution: a ramp, alone and on order 1. Wave n has
//! variance λ_n between revolutions and κ λ_n between runs (κ of the level its own), white noise σ²/samples. With
//! Z the waves at the places, V = σ²W⁻¹ + Z Λ Zᵀ (+ the same across a run), inverted by Woodbury's identity on the sums
//! of the design matrix. Samples are not independent: treated as such, a null campaign shows false effects more often than not.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Cholesky, DMatrix, Dyn, SymmetricEigen};
use rayon::prelude::*;

use super::design_matrix::DesignMatrix;
use super::grid::Grid;
use super::settings::NoiseSettings;
use super::waves::{KINDS, ORDERS, STEADY, WAVES, kind, members, waves};

/// Variances of the noise.
#[derive(Clone, Debug)]
pub struct Noise {
    /// White, a sample, rad².
    pub white_rad2: f64,
    /// Between revolutions, by kind of wave, rad² of each wave.
    pub order_rad2: [f64; KINDS],
    /// Between runs, in parts of that between revolutions; of order 0 and of the others.
    pub run_ratio: [f64; 2],
    /// Independent differences from which the revolutions' scatter was estimated; 0 where it was assumed.
    pub freedom: f64,
    /// Least scatter taken of an order, rad.
    least_rad: f64,
    /// How the waves of every revolution are whitened.
    revolutions: Arc<Vec<Option<Passing>>>,
}

/// Everything a fit needs under one noise.
pub struct Whitened {
    /// XᵀV⁻¹X of all columns of the design matrix.
    pub gram: DMatrix<f64>,
    /// log det V + constant.
    pub log_det: f64,
    /// Eigenvectors of wide blocks' own part, by their first column, once they are asked for.
    bases: Mutex<HashMap<usize, Basis>>,
}

type Basis = Arc<SymmetricEigen<f64, Dyn>>;

impl Whitened {
    fn new(gram: DMatrix<f64>, log_det: f64) -> Self {
        Self { gram, log_det, bases: Mutex::default() }
    }

    /// Of no column.
    #[must_use]
    pub fn empty() -> Self {
        Self::new(DMatrix::zeros(0, 0), 0.0)
    }

    /// The directions in which the part of a block's columns is diagonal; worked out once.
    pub(super) fn basis(&self, columns: &Range<usize>) -> Basis {
        let mut bases = self.bases.lock().unwrap_or_else(PoisonError::into_inner);
        let basis = bases.entry(columns.start).or_insert_with(|| {
            let own = self.gram.view((columns.start, columns.start), (columns.len(), columns.len()));
            Arc::new(SymmetricEigen::new(own.into_owned()))
        });
        Arc::clone(basis)
    }
}

impl Noise {
    /// Estimates the scatter from what differs between revolutions of a run after the model `amplitudes` (column,
    /// amplitude) is taken off.
    #[must_use]
    pub fn estimate(grid: &Grid, design: &DesignMatrix, amplitudes: &[(usize, f64)], settings: &NoiseSettings) -> Self {
        let residual_waves: Vec<_> = design
            .waves
            .iter()
            .map(|c| {
                let mut e = c.column(0).into_owned();
                for (column, amplitude) in amplitudes {
                    e.axpy(-amplitude, &c.column(*column), 1.0);
                }
                e
            })
            .collect();
        let fitted: Vec<Option<_>> = grid
            .revolutions
            .iter()
            .zip(design.wave_products())
            .zip(&residual_waves)
            .map(|((revolution, k), e)| {
                // Without the ramps: over a whole turn they are nearly sums of the orders.
                let (k, e) = (k.view((0, 0), (STEADY, STEADY)).into_owned(), e.rows(0, STEADY).into_owned());
                (revolution.coverage >= settings.full_coverage).then(|| Cholesky::new(k).map(|c| c.solve(&e))).flatten()
            })
            .collect();
        let rest = design.rest(grid, amplitudes);
        let (white_rad2, weight) = white(grid, &fitted, &rest, settings);
        // Squared differences between neighbouring revolutions, by order.
        let mut squares: Vec<Vec<f64>> = vec![Vec::new(); ORDERS + 1];
        let of_white = white_rad2 / weight.max(1.0);
        for run in 0..grid.directions.len() {
            let numbers: Vec<usize> = (0..grid.revolutions.len())
                .filter(|n| grid.revolutions[*n].run == run && fitted[*n].is_some())
                .collect();
            let differences: Vec<_> = numbers
                .windows(2)
                .filter_map(|pair| Some(fitted[pair[1]].as_ref()? - fitted[pair[0]].as_ref()?))
                .collect();
            // What grows evenly is drift, not scatter: where there are enough differences their mean is taken off order 0.
            let mean = if differences.len() >= settings.drift_differences {
                differences.iter().map(|d| d[0]).sum::<f64>() / differences.len() as f64
            } else {
                0.0
            };
            let shrink = if differences.len() >= settings.drift_differences {
                1.0 - 1.0 / differences.len() as f64
            } else {
                1.0
            };
            for difference in &differences {
                squares[0].push((difference[0] - mean).powi(2) / shrink);
                for wave in 1..STEADY {
                    squares[kind(wave)].push(difference[wave].powi(2));
                }
            }
        }
        let mut order_rad2 = [0.0; KINDS];
        for (variance, squares) in order_rad2.iter_mut().zip(&mut squares) {
            *variance = scatter(squares, of_white, settings);
        }
        let freedom = squares.iter().map(Vec::len).sum::<usize>() as f64;
        if freedom == 0.0 {
            // One revolution a run: nothing says how well it repeats. As much scatter as white noise in a tenth of a turn.
            order_rad2 = std::array::from_fn(|n| settings.assumed_of_white * of_white / (1.0 + n as f64));
        }
        // A level that changes from turn to turn changes within them too.
        order_rad2[ORDERS + 1] = settings.ramp * order_rad2[0];
        order_rad2[ORDERS + 2] = settings.ramp * order_rad2[1];
        let wave_rad2 = wave_rad2(&order_rad2, settings.least_rad);
        let passing = |k: &DMatrix<f64>| Passing::new(&(k / white_rad2), &wave_rad2);
        let revolutions = Arc::new(design.wave_products().par_iter().map(passing).collect());
        Self {
            white_rad2,
            order_rad2,
            run_ratio: settings.first_run_ratio,
            freedom,
            revolutions,
            least_rad: settings.least_rad,
        }
    }

    /// RMS of what does not repeat, as a sample shows it, rad.
    #[must_use]
    pub fn floor_rad2(&self) -> f64 {
        let between = |n: usize| self.order_rad2[n] * (1.0 + self.run_ratio[usize::from(n > 0)]);
        // The ramps describe how the levels pass on, not more of them.
        (0..=ORDERS).map(|n| members(n) * between(n)).sum()
    }

    /// XᵀV⁻¹X and log det V.
    #[must_use]
    pub fn whiten(&self, grid: &Grid, design: &DesignMatrix) -> Whitened {
        self.within_runs(grid, design, None).between_runs(self.run_ratio)
    }

    /// How the waves of a revolution are whitened.
    pub(super) fn revolution(&self, number: usize) -> Option<&Passing> {
        self.revolutions[number].as_ref()
    }

    /// How what revolutions pass on to their run is whitened there; `left` is the sum of theirs.
    pub(super) fn run(&self, left: &DMatrix<f64>) -> Option<Passing> {
        Passing::new(left, &between(&wave_rad2(&self.order_rad2, self.least_rad), self.run_ratio))
    }

    /// Everything that does not depend on the scatter between runs, of all columns or of some.
    #[must_use]
    pub(super) fn within_runs(&self, grid: &Grid, design: &DesignMatrix, only: Option<&[usize]>) -> WithinRuns {
        let precision = 1.0 / self.white_rad2;
        let wave_rad2 = wave_rad2(&self.order_rad2, self.least_rad);
        let mut gram = match only {
            None => design.products.clone(),
            Some(columns) => design.products.select_rows(columns).select_columns(columns),
        };
        gram *= precision;
        let p = gram.ncols();
        let mut log_det = -grid.weight.iter().map(|w| (w * precision).ln()).sum::<f64>();
        let runs = grid.directions.len();
        let mut left = vec![DMatrix::zeros(WAVES, WAVES); runs];
        let mut waves = vec![DMatrix::zeros(WAVES, p); runs];
        let mut rows = DMatrix::zeros(grid.revolutions.len() * WAVES, p);
        for (number, revolution) in grid.revolutions.iter().enumerate() {
            let Some(passing) = self.revolution(number) else { continue };
            log_det += passing.log_det;
            let c = match only {
                None => &design.waves[number] * precision,
                Some(columns) => design.waves[number].select_columns(columns) * precision,
            };
            left[revolution.run] += &passing.left;
            waves[revolution.run].gemm(1.0, &passing.on, &c, 1.0);
            rows.view_mut((number * WAVES, 0), (WAVES, p)).gemm(1.0, &passing.half, &c, 0.0);
        }
        gram -= super::gram::gram(&rows);
        WithinRuns { gram, log_det, left, waves, wave_rad2 }
    }
}

/// Variance of every wave between revolutions, rad².
fn wave_rad2(order_rad2: &[f64; KINDS], least_rad: f64) -> Vec<f64> {
    (0..WAVES).map(|w| order_rad2[kind(w)].max(least_rad * least_rad)).collect()
}

/// Variance of every wave between runs.
fn between(wave_rad2: &[f64], run_ratio: [f64; 2]) -> Vec<f64> {
    wave_rad2.iter().enumerate().map(|(n, l)| l * run_ratio[usize::from(n > 0)].max(1e-9)).collect()
}

/// Woodbury's identity at one level: K = ZᵀV⁻¹Z of what lies below, Λ the waves' own variance, S = (Λ⁻¹ + K)⁻¹.
#[derive(Debug)]
pub(super) struct Passing {
    /// L⁻¹ with LLᵀ = Λ⁻¹ + K: what a column with ZᵀV⁻¹x = c loses is |L⁻¹c|².
    pub half: DMatrix<f64>,
    /// 1 − K S: what of c passes on to the next level.
    pub on: DMatrix<f64>,
    /// K − K S K: what of K does.
    pub left: DMatrix<f64>,
    /// log det(Λ⁻¹ + K) + log det Λ.
    pub log_det: f64,
}

impl Passing {
    fn new(k: &DMatrix<f64>, variances: &[f64]) -> Option<Self> {
        let mut inner = k.clone();
        for (n, variance) in variances.iter().enumerate() {
            inner[(n, n)] += 1.0 / variance;
        }
        let cholesky = Cholesky::new(inner)?;
        let log_det = 2.0 * cholesky.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>()
            + variances.iter().map(|l| l.ln()).sum::<f64>();
        let n = variances.len();
        let half = cholesky.l().solve_lower_triangular(&DMatrix::identity(n, n))?;
        let on = DMatrix::identity(n, n) - k * (half.transpose() * &half);
        let left = &on * k;
        Some(Self { half, on, left, log_det })
    }
}

/// Sums whitened as far as revolutions go.
pub(super) struct WithinRuns {
    gram: DMatrix<f64>,
    log_det: f64,
    /// What is left of ZᵀV⁻¹Z, by run.
    left: Vec<DMatrix<f64>>,
    /// What is left of ZᵀV⁻¹X, by run.
    waves: Vec<DMatrix<f64>>,
    wave_rad2: Vec<f64>,
}

impl WithinRuns {
    /// The rest of the way: with scatter between runs.
    pub(super) fn between_runs(&self, run_ratio: [f64; 2]) -> Whitened {
        let variances = between(&self.wave_rad2, run_ratio);
        let p = self.gram.ncols();
        let mut rows = DMatrix::zeros(self.left.len() * WAVES, p);
        let mut log_det = self.log_det;
        for (run, (left, waves)) in self.left.iter().zip(&self.waves).enumerate() {
            if let Some(passing) = Passing::new(left, &variances) {
                log_det += passing.log_det;
                rows.view_mut((run * WAVES, 0), (WAVES, p)).gemm(1.0, &passing.half, waves, 0.0);
            }
        }
        Whitened::new(&self.gram - super::gram::gram(&rows), log_det)
    }
}

/// White noise a sample, rad², from places of neighbouring revolutions of a run freed of their waves; from neighbouring places
/// where runs have one revolution. With it the mean sum of weights of a revolution.
fn white(grid: &Grid, fitted: &[Option<nalgebra::DVector<f64>>], rest: &[f64], settings: &NoiseSettings) -> (f64, f64) {
    let mut squares = 0.0;
    let mut count = 0.0;
    let closes = grid.cells.len() < grid.places.len();
    let deviation = |number: usize, place: usize| {
        let z = waves(grid.places[place].theta1_rad, grid.part_of_cell[grid.cell_of[place]]);
        let low: f64 = fitted[number].as_ref().map_or(0.0, |u| z.iter().zip(u.iter()).map(|(z, u)| z * u).sum());
        rest[place] - low
    };
    for number in 1..grid.revolutions.len() {
        let (before, after) = (&grid.revolutions[number - 1], &grid.revolutions[number]);
        if !closes || before.run != after.run || fitted[number - 1].is_none() || fitted[number].is_none() {
            continue;
        }
        let mut other = before.places.clone().peekable();
        for place in after.places.clone() {
            while other.peek().is_some_and(|p| grid.cell_of[*p] < grid.cell_of[place]) {
                other.next();
            }
            if let Some(mate) = other.peek().copied().filter(|p| grid.cell_of[*p] == grid.cell_of[place]) {
                let difference = deviation(number, place) - deviation(number - 1, mate);
                squares += difference * difference / (1.0 / grid.weight[place] + 1.0 / grid.weight[mate]);
                count += 1.0;
            }
        }
    }
    let weight = grid.weight.iter().sum::<f64>() / grid.revolutions.len().max(1) as f64;
    if count < settings.fewest_pairs {
        // Second differences along the turn: blind to what is smooth over three bins.
        (squares, count) = (0.0, 0.0);
        for revolution in &grid.revolutions {
            for n in revolution.places.start + 1..revolution.places.end.saturating_sub(1) {
                let (a, b, c) = (grid.weight[n - 1], grid.weight[n], grid.weight[n + 1]);
                let difference = rest[n] - 0.5 * (rest[n - 1] + rest[n + 1]);
                squares += difference * difference / (1.0 / b + 0.25 / a + 0.25 / c);
                count += 1.0;
            }
        }
    }
    let floor = settings.least_white_rad;
    ((squares / f64::max(count, 1.0)).max(floor * floor), weight)
}

/// Variance from squared differences of two: robust against few large ones (steps, knocks), less what is white noise's.
fn scatter(squares: &mut [f64], of_white: f64, settings: &NoiseSettings) -> f64 {
    let least = settings.least_rad * settings.least_rad;
    if squares.is_empty() {
        return least;
    }
    squares.sort_by(f64::total_cmp);
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    // Median of χ²(1) is 0.4549.
    let middle = 0.5 * (squares[(squares.len() - 1) / 2] + squares[squares.len() / 2]) / 0.4549;
    let robust =
        if squares.len() >= settings.robust_differences { mean.min(settings.robust_factor * middle) } else { mean };
    (0.5 * robust - of_white).max(settings.least_of_white * of_white).max(least)
}
