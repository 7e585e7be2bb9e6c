//! Amplitudes, covariance and evidence against QR of the whitened system, LLᵀ = V, P the prior precisions:
//!
//! ```text
//! minimise |L⁻¹(y − Xβ)|² + |P^½ β|²:   [L⁻¹X; P^½] = QR,  β = R⁻¹q,  q = Qᵀ[L⁻¹y; 0],  Σ = R⁻¹R⁻ᵀ
//! log evidence = ½|q|² − log|det R| + ½ log det P
//! ```

use nalgebra::{DMatrix, DVector};

use super::support::{
    Dense, add_trace, condition, covariance, design, full, grid, level, order, pool, residual, rig, two_runs, uneven,
    weights, with_scatter,
};
use crate::design_matrix::{Candidate, DesignMatrix};
use crate::grid::Grid;
use crate::noise::Noise;
use crate::normal_equations::NormalEquations;
use crate::nuisance_patterns::{Pattern, Weight};
use gearmodel::Direction::Ccw;

struct ByQr {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    log_evidence: f64,
    /// What the normal equations may lose of the amplitudes in their standard units, and of the evidence.
    tolerance: f64,
}

/// Columns of a set, the zero first.
fn columns(pool: &DesignMatrix, set: &[usize]) -> Vec<usize> {
    std::iter::once(1).chain(set.iter().flat_map(|b| pool.blocks[*b].columns.clone())).collect()
}

fn by_qr(grid: &Grid, pool: &DesignMatrix, noise: &Noise, columns: &[usize], variances: &[f64]) -> ByQr {
    let v = covariance(grid, noise, noise.run_ratio);
    let kappa_of_v = condition(&v);
    let dense = Dense::new(v);
    let x = design(grid, pool, columns);
    let (u, r) = (dense.whiten(&x), dense.whiten(&residual(grid)));
    let (n, p) = u.shape();
    let mut stacked = DMatrix::zeros(n + p, p);
    stacked.rows_mut(0, n).copy_from(&u);
    for (k, variance) in variances.iter().enumerate() {
        stacked[(n + k, k)] = 1.0 / variance.sqrt();
    }
    let mut right = DMatrix::zeros(n + p, 1);
    right.rows_mut(0, n).copy_from(&r);
    let qr = stacked.clone().qr();
    qr.q_tr_mul(&mut right);
    let (q, triangle) = (right.rows(0, p).into_owned(), qr.r());
    let mean = triangle.solve_upper_triangular(&q).unwrap().column(0).into_owned();
    let inverse = triangle.solve_upper_triangular(&DMatrix::identity(p, p)).unwrap();
    let log_det: f64 = triangle.diagonal().iter().map(|d| d.abs().ln()).sum();
    let log_prior: f64 = variances.iter().map(|v| v.ln()).sum();
    let log_evidence = 0.5 * q.norm_squared() - log_det - 0.5 * log_prior;
    // The matrix of the normal equations is known to ε of XᵀWX/σ², from which the waves' part was taken off; the
    // solution to that times the condition of what is solved, its columns at unit size, for Cholesky does not mind
    // their scaling.
    let a = stacked.tr_mul(&stacked);
    let scaled = DMatrix::from_fn(p, p, |i, j| a[(i, j)] / (a[(i, i)] * a[(j, j)]).sqrt());
    let whole = x.tr_mul(&(weights(grid) * &x)) / noise.white_rad2;
    let lost = (0..p).map(|k| whole[(k, k)] / a[(k, k)]).fold(1.0, f64::max);
    let tolerance = (n + p) as f64 * f64::EPSILON * (condition(&scaled) * lost + kappa_of_v);
    ByQr { mean, covariance: &inverse * inverse.transpose(), log_evidence, tolerance }
}

fn compare(name: &str, grid: &Grid, pool: &DesignMatrix, noise: &Noise, set: &[usize], variances: &[f64]) {
    let whitened = noise.whiten(grid, pool);
    let columns = columns(pool, set);
    let right = by_qr(grid, pool, noise, &columns, variances);
    let normal = NormalEquations::new(&pool.blocks, &whitened, set, &columns);
    let solved = normal.solve(variances).unwrap();
    let (mean, covariance) = (normal.mean(&solved), normal.covariance(&solved));
    let tolerance = right.tolerance;
    assert!(tolerance < 1e-4, "{name}: {tolerance:e} proves nothing");
    let p = columns.len();
    // In units of each amplitude's deviation; a deviation of y by one changes them by one at most.
    let size = 1.0 + (2.0 * right.log_evidence.abs()).sqrt() + noise_size(grid, noise);
    let deviation = |k: usize| right.covariance[(k, k)].sqrt();
    for a in 0..p {
        let off = (mean[a] - right.mean[a]).abs() / deviation(a);
        assert!(off < tolerance * size, "{name}: amplitude {a} off by {off:e} of its deviation");
        for b in 0..p {
            let off = (covariance[(a, b)] - right.covariance[(a, b)]).abs() / (deviation(a) * deviation(b));
            assert!(off < tolerance, "{name}: covariance {a} {b} off by {off:e}");
        }
    }
    let off = (solved.log_evidence - right.log_evidence).abs();
    assert!(off < tolerance * size * size, "{name}: evidence {} {}", solved.log_evidence, right.log_evidence);
    // What the squares of each block's columns are expected to be: |m|² + tr Σ.
    let squares = normal.squares(&solved);
    let mut first = 1;
    for block in set {
        let at = first..first + pool.blocks[*block].width();
        let found: f64 = squares[at.clone()].iter().sum();
        let expected: f64 = at.clone().map(|k| right.mean[k].powi(2) + right.covariance[(k, k)]).sum();
        assert!((found / expected - 1.0).abs() < tolerance * size, "{name}: squares of {block}: {found} {expected}");
        first = at.end;
    }
}

/// |L⁻¹y| at most: the residual in units of the white noise.
fn noise_size(grid: &Grid, noise: &Noise) -> f64 {
    grid.rho_rad.iter().zip(&grid.weight).map(|(y, w)| w * y * y / noise.white_rad2).sum::<f64>().sqrt()
}

fn variances(pool: &DesignMatrix, set: &[usize], scale_rad: f64) -> Vec<f64> {
    let mut variances = vec![1.0];
    for block in set {
        let d = pool.blocks[*block].width();
        variances.extend(vec![scale_rad * scale_rad / d as f64; d]);
    }
    variances
}

#[test]
fn amplitudes_covariance_and_evidence_are_those_of_the_whitened_least_squares() {
    let rig = rig();
    let (mut grid, noise) = with_scatter(two_runs(&rig), 41);
    let candidates = [
        order(11.0, false),
        level(Weight::One, true, 1.0),
        Candidate::Unknown(super::support::smooth(1.0)),
        Candidate::Unknown(Pattern::RandomWalk { terms: 20, duration_s: 60.0 }),
        order(2.0, true),
    ];
    let columns = pool(&rig, &grid, &candidates);
    add_trace(&mut grid, &columns, &[(2, 12e-6), (4, 30e-6), (9, 7e-6), (45, 4e-6)]);
    let pool = pool(&rig, &grid, &candidates);
    // Without a wide block; one that is turned, first, last and between; two, of which the wider is turned.
    for set in [vec![], vec![0], vec![0, 1, 4], vec![2], vec![0, 2], vec![2, 4], vec![0, 1, 2, 4], vec![0, 2, 3, 4]] {
        for scale_rad in [1e-6, 3e-5, 1e-3] {
            compare(&format!("{set:?} {scale_rad}"), &grid, &pool, &noise, &set, &variances(&pool, &set, scale_rad));
        }
    }
}

/// In one sense an order alike in both and the same order opposite are one and the same column: only the prior parts
/// them. Orders that differ by a hundredth over three turns are nearly so.
#[test]
fn columns_that_hardly_differ_are_parted_by_the_prior() {
    let rig = rig();
    let (mut grid, noise) = with_scatter(grid(&rig, &[full(Ccw, 5.0, 3, 40)], 40, uneven), 43);
    let candidates = [order(11.0, false), order(11.0, true), order(11.01, false)];
    let columns = pool(&rig, &grid, &candidates);
    add_trace(&mut grid, &columns, &[(2, 12e-6), (3, -5e-6)]);
    let pool = pool(&rig, &grid, &candidates);
    for set in [vec![0, 1], vec![0, 2], vec![0, 1, 2]] {
        for scale_rad in [1e-6, 1e-4] {
            compare(&format!("{set:?} {scale_rad}"), &grid, &pool, &noise, &set, &variances(&pool, &set, scale_rad));
        }
    }
}

/// No room at all: β = 0 and nothing is gained. All the room there is: generalised least squares, and each decade of
/// s costs a block of d columns d ln 10.
#[test]
fn limits_of_the_prior() {
    let rig = rig();
    let (mut grid, noise) = with_scatter(two_runs(&rig), 47);
    let candidates = [order(11.0, false), Candidate::Unknown(super::support::smooth(1.0))];
    let columns_of = pool(&rig, &grid, &candidates);
    add_trace(&mut grid, &columns_of, &[(2, 12e-6), (3, -5e-6)]);
    let pool = pool(&rig, &grid, &candidates);
    let whitened = noise.whiten(&grid, &pool);
    for set in [vec![0], vec![0, 1]] {
        let columns = columns(&pool, &set);
        let normal = NormalEquations::new(&pool.blocks, &whitened, &set, &columns);
        let evidence = |scale_rad: f64| normal.solve(&variances(&pool, &set, scale_rad)).unwrap();
        let nothing = NormalEquations::new(&pool.blocks, &whitened, &[], &[1]).solve(&[1.0]).unwrap();
        let narrow = evidence(1e-15);
        // β = v b to first order, and b is at most |X|·|y| in units of the noise: 1e-30 · 1e12 · 1e-3.
        assert!(normal.mean(&narrow).iter().skip(1).all(|m| m.abs() < 1e-18));
        assert!((narrow.log_evidence - nothing.log_evidence).abs() < 1e-9);
        // A ridge of 1/v on a G of at least …: v G ≥ 1e7 here, so that it moves nothing by more than 1e-7 of itself.
        let wide = [1e2, 1e3].map(evidence);
        let free = by_qr(&grid, &pool, &noise, &columns, &vec![f64::INFINITY; columns.len()]);
        for (k, (found, right)) in normal.mean(&wide[1]).iter().zip(&free.mean).enumerate() {
            let deviation = free.covariance[(k, k)].sqrt();
            assert!((found - right).abs() < 1e-5 * deviation, "{k}: {found} {right} ± {deviation}");
        }
        let d = (columns.len() - 1) as f64;
        let fall = wide[0].log_evidence - wide[1].log_evidence;
        assert!((fall - d * 10.0_f64.ln()).abs() < 1e-5 * d, "{fall} of {d} columns");
    }
}
