//! Columns of a block and their sums:
//!
//! ```text
//! X = R T with R the raw columns,   Σ w (x_a − x̄_a)(x_b − x̄_b)/Σ w = δ_ab,   XᵀWX,  ZᵀWX and ZᵀWZ by revolution
//! ```

use nalgebra::DMatrix;

use super::support::{design, level, order, pool, rig, two_runs, waves_at_places, weights, with_scatter};
use crate::design_matrix::Candidate;
use crate::nuisance_patterns::{Pattern, Weight};

#[test]
fn columns_are_orthogonal_of_unit_rms_and_their_sums_those_of_the_places() {
    let rig = rig();
    let (grid, _) = with_scatter(two_runs(&rig), 5);
    let walk = Pattern::RandomWalk { terms: 7, duration_s: grid.plan.duration_s };
    let candidates = [
        order(3.0, false),
        Candidate::Unknown(Pattern::Tone { frequency_hz: 0.77 }),
        level(Weight::Load, false, 10.0),
        Candidate::Unknown(super::support::smooth(-1.0)),
        Candidate::Unknown(walk),
    ];
    let pool = pool(&rig, &grid, &candidates);
    let total: f64 = grid.weight.iter().sum();
    for block in &pool.blocks {
        let Candidate::Unknown(pattern) = &block.candidate else { unreachable!() };
        let mut raw = DMatrix::zeros(grid.places.len(), pattern.width());
        for (n, place) in grid.places.iter().enumerate() {
            let mut row = vec![0.0; pattern.width()];
            pattern.row(place, &mut row);
            raw.row_mut(n).copy_from_slice(&row);
        }
        let columns: Vec<usize> = block.columns.clone().collect();
        let x = design(&grid, &pool, &columns);
        // Whole orders repeat in every turn to rounding; directions are kept down to 1e-5 of the largest, which
        // magnifies it.
        assert!((&raw * &block.transform - &x).amax() < 1e-9 * block.transform.amax(), "{}", pattern.describe());
        let mean = x.tr_mul(&weights(&grid)).column_sum() / total;
        let covariance = x.tr_mul(&(weights(&grid) * &x)) / total - &mean * mean.transpose();
        if pattern.keeps_sizes() {
            // Only the trace is set: an amplitude of all columns alike is the block's mean RMS.
            assert!((covariance.trace() / columns.len() as f64 - 1.0).abs() < 1e-9);
            assert_eq!(block.transform, DMatrix::identity(columns.len(), columns.len()) * block.transform[(0, 0)]);
        } else {
            let off = (&covariance - DMatrix::identity(columns.len(), columns.len())).amax();
            // Rounding of the smallest direction kept, a variance of 1e-10 of the largest.
            assert!(off < 1e-5, "{}: {off:e}", pattern.describe());
        }
        for (m, a) in columns.iter().enumerate() {
            for (n, b) in columns.iter().enumerate() {
                assert!((pool.covariance(*a, *b) - covariance[(m, n)]).abs() < 1e-9);
            }
        }
    }
    let all: Vec<usize> = (0..pool.width()).collect();
    let x = design(&grid, &pool, &all);
    let wx = weights(&grid) * &x;
    // n ε of the sum of the terms' sizes.
    let n = grid.places.len() as f64;
    let within = |found: &DMatrix<f64>, right: &DMatrix<f64>, size: &DMatrix<f64>| {
        found.iter().zip(right).zip(size).all(|((f, r), s)| (f - r).abs() <= n * f64::EPSILON * s)
    };
    let abs = |m: &DMatrix<f64>| m.map(f64::abs);
    assert!(within(&pool.products, &x.tr_mul(&wx), &abs(&x).tr_mul(&abs(&wx))));
    let z = waves_at_places(&grid);
    let z = DMatrix::from_fn(z.len(), z[0].len(), |n, w| z[n][w]);
    for (number, revolution) in grid.revolutions.iter().enumerate() {
        let (first, count) = (revolution.places.start, revolution.places.len());
        let (z, wx) = (z.rows(first, count).into_owned(), wx.rows(first, count).into_owned());
        let wz = weights(&grid).view((first, first), (count, count)) * &z;
        // Angles of later turns stand n·2π further on: their waves agree to ε·8·6π, not to ε.
        let loose = 100.0;
        assert!(within(&pool.waves[number], &z.tr_mul(&wx), &(abs(&z).tr_mul(&abs(&wx)) * loose)));
        assert!(within(&pool.wave_products()[number], &z.tr_mul(&wz), &(abs(&z).tr_mul(&abs(&wz)) * loose)));
    }
}
