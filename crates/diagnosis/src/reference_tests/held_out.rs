//! Held-out mean squares against explicit refits: each run r (each revolution, where there is one run) is predicted by
//!
//! ```text
//! β_r = (XᵀV⁻¹X + P)⁻¹ XᵀV⁻¹y  over all other places,    mean square = Σ_r Σ_{i in r} w_i (y_i − x_iᵀβ_r)² / Σ w
//! closed = (before² − after²)/(before² − floor²)
//! ```
//!
//! V dense, P of 1/rad² for the zero.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::support::{
    Run, add_trace, covariance, design, full, grid, level, order, pool, residual, revolution_of_place, rig, two_runs,
    uneven, with_scatter,
};
use crate::cross_validation::{HeldOut, Selection, closed, gap};
use crate::design_matrix::{Candidate, DesignMatrix};
use crate::grid::Grid;
use crate::nuisance_patterns::{Pattern, Weight};
use crate::settings::Settings;
use gearmodel::Direction::{Ccw, Cw};

/// Mean square over places, each predicted from those of the other units.
fn refitted(
    grid: &Grid,
    v: &DMatrix<f64>,
    x: &DMatrix<f64>,
    variances: &[f64],
    unit_of: impl Fn(usize) -> usize,
) -> f64 {
    let y = residual(grid);
    let n = grid.places.len();
    let units = (0..n).map(&unit_of).max().unwrap() + 1;
    let mut sum = 0.0;
    for unit in 0..units {
        let (out, rest): (Vec<usize>, Vec<usize>) = (0..n).partition(|place| unit_of(*place) == unit);
        let v = Cholesky::new(v.select_rows(&rest).select_columns(&rest)).unwrap();
        let (x_rest, y_rest) = (x.select_rows(&rest), y.select_rows(&rest));
        let mut a = x_rest.tr_mul(&v.solve(&x_rest));
        for (k, variance) in variances.iter().enumerate() {
            a[(k, k)] += 1.0 / variance;
        }
        let beta = a.lu().solve(&x_rest.tr_mul(&v.solve(&y_rest))).unwrap();
        let off = y.select_rows(&out) - x.select_rows(&out) * beta;
        sum += out.iter().zip(off.iter()).map(|(place, e)| grid.weight[*place] * e * e).sum::<f64>();
    }
    sum / grid.weight.iter().sum::<f64>()
}

/// Columns of some blocks with their prior variances.
fn selection(pool: &DesignMatrix, blocks: &[usize], scale_rad: f64) -> Selection {
    let mut selection = Selection::default();
    for block in blocks {
        let columns = pool.blocks[*block].columns.clone();
        selection.prior_rad2.extend(vec![scale_rad * scale_rad / columns.len() as f64; columns.len()]);
        selection.columns.extend(columns);
    }
    selection
}

fn compare(grid: Grid, candidates: &[Candidate], amplitudes: &[(usize, f64)], by_run: bool) {
    let rig = rig();
    let (mut grid, mut noise) = with_scatter(grid, 51);
    noise.run_ratio = [2.0, 0.5];
    let columns = pool(&rig, &grid, candidates);
    add_trace(&mut grid, &columns, amplitudes);
    let pool = pool(&rig, &grid, candidates);
    // Within one run what the run adds to all its revolutions is theirs alike: it goes with the zero and what repeats.
    let v = covariance(&grid, &noise, if by_run { noise.run_ratio } else { [0.0; 2] });
    let revolution = revolution_of_place(&grid);
    let unit_of = |place: usize| if by_run { grid.places[place].run } else { revolution[place] };
    let all: Vec<usize> = (1..pool.width()).collect();
    let held_out = HeldOut::new(&grid, &pool, &noise, &all);
    let mut sets: Vec<Vec<usize>> = vec![vec![], (0..candidates.len()).collect()];
    sets.extend((0..candidates.len()).map(|block| vec![block]));
    let mut means = Vec::new();
    for set in &sets {
        for scale_rad in [3e-6, 1e-4] {
            let selection = selection(&pool, set, scale_rad);
            let mut columns = vec![1];
            columns.extend(&selection.columns);
            let mut variances = vec![1.0];
            variances.extend(&selection.prior_rad2);
            let right = refitted(&grid, &v, &design(&grid, &pool, &columns), &variances, unit_of);
            let found = held_out.errors(&selection).mean();
            // n ε κ(V), κ about 1e4, and as much again for the sums that are subtracted from one another.
            assert!((found / right - 1.0).abs() < 1e-7, "{set:?} {scale_rad}: {found:e} {right:e}");
            means.push(found);
        }
    }
    // The share closed follows from them.
    let floor_rad2 = held_out.floor_rad2(&grid, &noise);
    let (before, after) = (held_out.errors(&Selection::default()), held_out.errors(&selection(&pool, &sets[1], 1e-4)));
    let (b, a) = (before.mean(), after.mean());
    assert!(b > floor_rad2 && b > 1.5 * a, "the traces show: {b:e} {a:e} {floor_rad2:e}");
    let (value, [low, high]) = closed(&before, &after, floor_rad2, Settings::default().report.resamples).unwrap();
    assert!((value - (b - a) / (b - floor_rad2)).abs() < 1e-12);
    assert!(low <= value && value <= high);
    let within_rad2 = 4e-12;
    let figures = gap(&before, &after, floor_rad2, within_rad2, 0.0, true, Settings::default().report.resamples);
    for (found, right) in [(figures.before_rad, b), (figures.after_rad, a), (figures.floor_rad, floor_rad2)] {
        assert!((found / (right + within_rad2).sqrt() - 1.0).abs() < 1e-12);
    }
    assert!((figures.closed.unwrap() - value).abs() < 1e-12);
    // Nothing above the floor, nothing to close.
    assert!(closed(&before, &after, b, Settings::default().report.resamples).is_none());
}

#[test]
fn runs_left_out_are_predicted_as_by_a_refit_without_them() {
    let rig = rig();
    let bins = 36;
    let runs = [
        full(Ccw, 5.0, 2, bins),
        Run { direction: Cw, load_nm: 15.0, revolutions: vec![0..bins, 0..20] },
        full(Ccw, 15.0, 1, bins),
        full(Cw, 5.0, 2, bins),
    ];
    let candidates = [order(11.0, false), level(Weight::One, true, 1.0), order(1.0, true)];
    compare(grid(&rig, &runs, bins, uneven), &candidates, &[(2, 30e-6), (4, 60e-6), (5, 40e-6)], true);
    let tone = Candidate::Unknown(Pattern::Tone { frequency_hz: 0.83 });
    compare(two_runs(&rig), &[tone, order(13.0, false)], &[(2, 40e-6), (4, 30e-6)], true);
}

#[test]
fn revolutions_left_out_of_one_run_are_predicted_as_by_a_refit_without_them() {
    let bins = 40;
    let runs = [Run { direction: Ccw, load_nm: 5.0, revolutions: vec![0..bins, 0..bins, 2..bins, 0..15] }];
    let candidates = [order(11.0, false), Candidate::Unknown(Pattern::Tone { frequency_hz: 0.83 })];
    compare(grid(&rig(), &runs, bins, uneven), &candidates, &[(2, 30e-6), (4, 40e-6)], false);
}

/// Under V the expectation of a run predicted by the zero alone is the trace of its part of V and the variance of the
/// zero fitted to the others: never under the floor by more than what the ramps add to it.
#[test]
fn scatter_alone_leaves_the_floor_and_the_zero_s_own_variance() {
    let rig = rig();
    let bins = 36;
    let runs: Vec<_> = (0..4).map(|n| full([Ccw, Cw][n % 2], 5.0, 2, bins)).collect();
    let (mut grid, noise) = with_scatter(grid(&rig, &runs, bins, |_| 2.0), 52);
    let n = grid.places.len();
    let v = covariance(&grid, &noise, noise.run_ratio);
    let total: f64 = grid.weight.iter().sum();
    let mut expected = (0..n).map(|k| grid.weight[k] * v[(k, k)]).sum::<f64>();
    for run in 0..4 {
        let rest: Vec<usize> = (0..n).filter(|k| grid.places[*k].run != run).collect();
        let own = total - rest.iter().map(|k| grid.weight[*k]).sum::<f64>();
        let one = DMatrix::from_element(rest.len(), 1, 1.0);
        let solved = Cholesky::new(v.select_rows(&rest).select_columns(&rest)).unwrap().solve(&one);
        expected += own / one.dot(&solved);
    }
    expected /= total;
    // Draws of V itself: L times white noise.
    let l = Cholesky::new(v).unwrap().l();
    let mut random = super::support::Random::new(53);
    let mut means = Vec::new();
    let mut floor_rad2 = 0.0;
    for _ in 0..300 {
        let white = DVector::from_fn(n, |_, _| random.normal());
        grid.rho_rad = (&l * white).iter().copied().collect();
        let pool = pool(&rig, &grid, &[]);
        let held_out = HeldOut::new(&grid, &pool, &noise, &[1]);
        means.push(held_out.errors(&Selection::default()).mean());
        floor_rad2 = held_out.floor_rad2(&grid, &noise);
    }
    let (mean, error) = super::support::mean_and_error(&means);
    assert!((mean - expected).abs() < 5.0 * error, "{mean:e} {expected:e} ± {error:e}");
    assert!(floor_rad2 < expected, "{floor_rad2:e} {expected:e}");
}
