//! Small campaigns, their dense matrices, and draws.

use std::f64::consts::{SQRT_2, TAU};
use std::ops::Range;

use gearmodel::effect::{LIBRARY, NominalRig, OperatingPoint, Shaft, by_name};
use gearmodel::{Direction, EllipticalSpec, Errors, GearPair};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::design_matrix::{Candidate, DesignMatrix};
use crate::grid::{Grid, Revolution};
use crate::noise::Noise;
use crate::nuisance_patterns::{Pattern, Weight};
use crate::reduce::ReducedRun;
use crate::settings::Settings;

/// Duration of a revolution and of the pause between runs, s.
pub(super) const TURN_S: f64 = 10.0;
const PAUSE_S: f64 = 17.0;

/// Highest order that scatters, and the waves: the constant, cosine and sine of each order, a ramp alone and on order
/// 1.
pub(super) const ORDERS: usize = 8;
pub(super) const STEADY: usize = 2 * ORDERS + 1;

/// A run: its condition, and the bins that each of its revolutions covers.
pub(super) struct Run {
    pub direction: Direction,
    pub load_nm: f64,
    pub revolutions: Vec<Range<usize>>,
}

/// A run of full revolutions.
pub(super) fn full(direction: Direction, load_nm: f64, revolutions: usize, bins: usize) -> Run {
    Run { direction, load_nm, revolutions: vec![0..bins; revolutions] }
}

/// The default elliptical pair.
pub(super) fn rig() -> NominalRig {
    let pair = GearPair::elliptical(&EllipticalSpec::default()).unwrap();
    NominalRig::new(pair, Errors::default(), [None, None], None)
}

/// The grid of some runs with a residual of zero; `samples` at each place by its number.
pub(super) fn grid(rig: &NominalRig, runs: &[Run], bins: usize, samples: impl Fn(usize) -> f64) -> Grid {
    let mut grid = binned(rig, &[]);
    grid.bins = bins;
    let (mut start_s, mut way_rev) = (0.0, 0.0);
    for (run, plan) in runs.iter().enumerate() {
        grid.directions.push(plan.direction);
        grid.plan.starts_s.push(start_s);
        let mut cell_of_bin = vec![None; bins];
        for (turn, covered) in plan.revolutions.iter().enumerate() {
            let first = grid.places.len();
            for bin in covered.clone() {
                let part = (bin as f64 + 0.5) / bins as f64;
                let turns = turn as f64 + part;
                let theta1_rad = 0.3 * run as f64 + plan.direction.sign() * TAU * turns;
                let place = OperatingPoint {
                    load_nm: plan.load_nm,
                    speed_rad_per_s: plan.direction.sign() * TAU / TURN_S,
                    time_s: start_s + TURN_S * turns,
                    way_rev: way_rev + turns,
                    run,
                    ..rig.operating_point(theta1_rad, rig.pair().theta2(theta1_rad), plan.direction)
                };
                let cell = *cell_of_bin[bin].get_or_insert_with(|| {
                    grid.cells.push(place);
                    grid.part_of_cell.push(part);
                    grid.cells.len() - 1
                });
                grid.cell_of.push(cell);
                grid.weight.push(samples(grid.places.len()));
                grid.places.push(place);
                grid.rho_rad.push(0.0);
            }
            let coverage = covered.len() as f64 / bins as f64;
            grid.revolutions.push(Revolution { run, places: first..grid.places.len(), coverage });
        }
        start_s += TURN_S * plan.revolutions.len() as f64 + PAUSE_S;
        way_rev += plan.revolutions.len() as f64;
    }
    let mut loads_nm: Vec<f64> = runs.iter().map(|run| run.load_nm).collect();
    loads_nm.sort_by(f64::total_cmp);
    loads_nm.dedup();
    grid.plan.loads_nm = loads_nm;
    grid.plan.speeds_rad_per_s = vec![TAU / TURN_S];
    grid.plan.senses = [Direction::Ccw, Direction::Cw].map(|sense| runs.iter().any(|run| run.direction == sense));
    grid.plan.duration_s = start_s - PAUSE_S;
    grid.plan.runs = runs.len();
    grid.plan.revolutions = way_rev;
    grid.plan.turns = [1.0, 1.0];
    grid.samples = grid.weight.iter().sum();
    grid
}

/// 1 … 5 samples a place.
pub(super) fn uneven(place: usize) -> f64 {
    1.0 + (place * 7919 % 5) as f64
}

/// Two runs in both senses, revolutions whole and in part.
pub(super) fn two_runs(rig: &NominalRig) -> Grid {
    let bins = 40;
    let runs = [
        Run { direction: Direction::Ccw, load_nm: 5.0, revolutions: vec![0..bins, 0..bins, 0..23] },
        Run { direction: Direction::Cw, load_nm: 15.0, revolutions: vec![0..bins, 4..bins, 0..9] },
    ];
    grid(rig, &runs, bins, uneven)
}

/// An order of the driver, alike in both senses or opposite.
pub(super) fn order(order: f64, odd: bool) -> Candidate {
    Candidate::Unknown(Pattern::Order { shaft: Shaft::Input, order, odd, weight: Weight::One, mean: 1.0 })
}

/// A level that scales.
pub(super) fn level(weight: Weight, odd: bool, mean: f64) -> Candidate {
    Candidate::Unknown(Pattern::Level { odd, weight, mean })
}

/// Whatever is smooth over the driver's turn in one sense.
pub(super) fn smooth(sense: f64) -> Pattern {
    Pattern::Smooth { sense, orders: Settings::default().nuisance.smooth_orders }
}

/// An effect of the library at the first of its shapes.
pub(super) fn effect(rig: &NominalRig, grid: &Grid, name: &str) -> Candidate {
    let effect = by_name(name).unwrap();
    let number = LIBRARY.iter().position(|e| e.name() == name).unwrap();
    Candidate::Effect { effect, number, shape: effect.shapes(rig, &grid.plan).swap_remove(0), cost_nats: 0.0 }
}

/// What the points of runs are binned to.
pub(super) fn binned(rig: &NominalRig, runs: &[ReducedRun]) -> Grid {
    Grid::new(rig, runs, &Settings::default())
}

/// The pool of some candidates over a grid with a residual.
pub(super) fn pool(rig: &NominalRig, grid: &Grid, candidates: &[Candidate]) -> DesignMatrix {
    let mut pool = DesignMatrix::new(grid, &Settings::default());
    assert_eq!(pool.add(grid, rig, candidates).len(), candidates.len(), "the plan shows all of them");
    pool
}

/// Waves of unit RMS over a whole turn at an angle and a part of the revolution: order n as √2 cos nθ and √2 sin nθ,
/// the ramp 2√3 (part − ½).
pub(super) fn waves(theta1_rad: f64, part: f64) -> Vec<f64> {
    let mut waves = vec![1.0];
    for n in 1..=ORDERS {
        waves.extend([SQRT_2 * (n as f64 * theta1_rad).cos(), SQRT_2 * (n as f64 * theta1_rad).sin()]);
    }
    let ramp = 12.0_f64.sqrt() * (part - 0.5);
    waves.extend([ramp, ramp * waves[1], ramp * waves[2]]);
    waves
}

/// Order of each wave, and its place among the variances of a noise: those of the orders, of the ramp, of the ramp on
/// order 1.
pub(super) fn kind_of_wave(wave: usize) -> usize {
    if wave < STEADY { wave.div_ceil(2) } else { ORDERS + 1 + usize::from(wave > STEADY) }
}

/// Part of its revolution at which a place stands.
fn part(grid: &Grid, place: usize) -> f64 {
    grid.part_of_cell[grid.cell_of[place]]
}

/// Waves at every place.
pub(super) fn waves_at_places(grid: &Grid) -> Vec<Vec<f64>> {
    (0..grid.places.len()).map(|n| waves(grid.places[n].theta1_rad, part(grid, n))).collect()
}

/// Revolution of every place.
pub(super) fn revolution_of_place(grid: &Grid) -> Vec<usize> {
    let numbered = grid.revolutions.iter().enumerate();
    numbered.flat_map(|(number, revolution)| revolution.places.clone().map(move |_| number)).collect()
}

/// V, entry by entry: σ²/w on the diagonal, Σ λ z z where two places share a revolution, Σ κ λ z z where they share a
/// run.
pub(super) fn covariance(grid: &Grid, noise: &Noise, run_ratio: [f64; 2]) -> DMatrix<f64> {
    let (z, revolution) = (waves_at_places(grid), revolution_of_place(grid));
    let n = grid.places.len();
    DMatrix::from_fn(n, n, |a, b| {
        let mut v = if a == b { noise.white_rad2 / grid.weight[a] } else { 0.0 };
        for (wave, (za, zb)) in z[a].iter().zip(&z[b]).enumerate() {
            let variance = noise.order_rad2[kind_of_wave(wave)];
            if revolution[a] == revolution[b] {
                v += variance * za * zb;
            }
            if grid.places[a].run == grid.places[b].run {
                v += run_ratio[usize::from(wave > 0)] * variance * za * zb;
            }
        }
        v
    })
}

/// A dense covariance, factorised.
pub(super) struct Dense {
    pub cholesky: Cholesky<f64, Dyn>,
}

impl Dense {
    pub(super) fn new(covariance: DMatrix<f64>) -> Self {
        Self { cholesky: Cholesky::new(covariance).expect("a covariance is positive definite") }
    }

    /// L⁻¹A.
    pub(super) fn whiten(&self, a: &DMatrix<f64>) -> DMatrix<f64> {
        self.cholesky.l().solve_lower_triangular(a).unwrap()
    }

    /// AᵀV⁻¹B.
    pub(super) fn product(&self, a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
        self.whiten(a).tr_mul(&self.whiten(b))
    }

    pub(super) fn log_det(&self) -> f64 {
        2.0 * self.cholesky.l().diagonal().iter().map(|d| d.ln()).sum::<f64>()
    }

    /// log N(y; 0, V + 11ᵀ) without the ½ n log 2π that all share: V, and a zero with a prior of 1 rad. The zero is
    /// put in by hand, for 1 rad² added to every entry would swallow the digits of σ²:
    ///
    /// ```text
    /// det(V + 11ᵀ) = det V (1 + 1ᵀV⁻¹1),    (V + 11ᵀ)⁻¹ = V⁻¹ − V⁻¹11ᵀV⁻¹/(1 + 1ᵀV⁻¹1)
    /// ```
    pub(super) fn log_normal_with_zero(&self, y: &DMatrix<f64>) -> f64 {
        let one = DMatrix::from_element(y.nrows(), 1, 1.0);
        let precision = 1.0 + self.product(&one, &one)[(0, 0)];
        let square = self.product(y, y)[(0, 0)] - self.product(&one, y)[(0, 0)].powi(2) / precision;
        -0.5 * (square + self.log_det() + precision.ln())
    }
}

/// Largest over smallest eigenvalue.
pub(super) fn condition(a: &DMatrix<f64>) -> f64 {
    let values = a.symmetric_eigenvalues();
    values.max() / values.min()
}

/// The residual as a column.
pub(super) fn residual(grid: &Grid) -> DMatrix<f64> {
    DMatrix::from_column_slice(grid.places.len(), 1, &grid.rho_rad)
}

/// Columns of a pool at every place.
pub(super) fn design(grid: &Grid, pool: &DesignMatrix, columns: &[usize]) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = columns.iter().map(|c| DVector::from_vec(pool.column(grid, *c))).collect();
    DMatrix::from_columns(&columns)
}

/// Σ over blocks of s²/d X Xᵀ: what a set with amplitudes N(0, s²/d) adds to V.
pub(super) fn spread_of(grid: &Grid, pool: &DesignMatrix, set: &[usize], scales_rad: &[f64]) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(grid.places.len(), grid.places.len());
    for (block, scale) in set.iter().zip(scales_rad) {
        let columns: Vec<usize> = pool.blocks[*block].columns.clone().collect();
        let x = design(grid, pool, &columns);
        sum += &x * x.transpose() * (scale * scale / columns.len() as f64);
    }
    sum
}

/// Sample weights as a matrix.
pub(super) fn weights(grid: &Grid) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_column_slice(&grid.weight))
}

/// A source of draws.
pub(super) struct Random(Pcg64Mcg);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// A draw of N(0, 1), by Box and Muller.
    pub(super) fn normal(&mut self) -> f64 {
        let (u, v): (f64, f64) = (self.0.random(), self.0.random());
        (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos()
    }

    /// A whole number below a bound.
    pub(super) fn below(&mut self, bound: usize) -> usize {
        self.0.random_range(0..bound)
    }
}

/// Variances that a residual is drawn with.
#[derive(Clone, Copy)]
pub(super) struct Truth {
    /// White, a sample, rad².
    pub white_rad2: f64,
    /// Of every order between revolutions, rad².
    pub order_rad2: [f64; ORDERS + 1],
    /// Between runs, in parts of that: of the level, of the other orders.
    pub run_ratio: [f64; 2],
}

/// 3 µrad a sample; 10 µrad of level between revolutions, falling with the order.
pub(super) const TRUTH: Truth = Truth {
    white_rad2: 9e-12,
    order_rad2: [1e-10, 5e-11, 3e-11, 2e-11, 1e-11, 8e-12, 6e-12, 5e-12, 4e-12],
    run_ratio: [1.0, 0.3],
};

/// A residual of nothing but scatter, without ramps.
pub(super) fn draw(grid: &Grid, truth: &Truth, random: &mut Random) -> Vec<f64> {
    let mut of = |size: [f64; 2]| -> Vec<f64> {
        (0..STEADY)
            .map(|w| (size[usize::from(w > 0)] * truth.order_rad2[kind_of_wave(w)]).sqrt() * random.normal())
            .collect()
    };
    let runs: Vec<Vec<f64>> = grid.directions.iter().map(|_| of(truth.run_ratio)).collect();
    let revolutions: Vec<Vec<f64>> = grid.revolutions.iter().map(|_| of([1.0, 1.0])).collect();
    let revolution = revolution_of_place(grid);
    let z = waves_at_places(grid);
    (0..grid.places.len())
        .map(|n| {
            let (of_revolution, of_run) = (&revolutions[revolution[n]], &runs[grid.places[n].run]);
            let low: f64 = (0..STEADY).map(|w| z[n][w] * (of_revolution[w] + of_run[w])).sum();
            low + (truth.white_rad2 / grid.weight[n]).sqrt() * random.normal()
        })
        .collect()
}

/// The grid with scatter as its residual, and what the estimate makes of it: a noise of the right size, whose own
/// variances the dense references then take.
pub(super) fn with_scatter(mut grid: Grid, seed: u64) -> (Grid, Noise) {
    grid.rho_rad = draw(&grid, &TRUTH, &mut Random::new(seed));
    let noise = estimate(&grid);
    (grid, noise)
}

/// The noise of a residual from which nothing is taken off.
pub(super) fn estimate(grid: &Grid) -> Noise {
    let settings = Settings::default();
    Noise::estimate(grid, &DesignMatrix::new(grid, &settings), &[], &settings.noise)
}

/// Adds columns of a pool, times amplitudes, to the residual.
pub(super) fn add_trace(grid: &mut Grid, pool: &DesignMatrix, amplitudes: &[(usize, f64)]) {
    for (column, amplitude) in amplitudes {
        let values = pool.column(grid, *column);
        grid.rho_rad.iter_mut().zip(values).for_each(|(rho, x)| *rho += amplitude * x);
    }
}

/// Mean and its standard error.
pub(super) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}
