//! Woodbury against the full matrix:
//!
//! ```text
//! V = σ² W⁻¹ + Σ_revolutions Z Λ Zᵀ + Σ_runs Z κΛ Zᵀ,    XᵀV⁻¹X,  XᵀV⁻¹y,  log det V
//! ```

use gearmodel::Direction::{Ccw, Cw};
use gearmodel::effect::NominalRig;

use super::support::{
    Dense, Run, condition, covariance, design, full, grid, level, order, pool, residual, rig, spread_of, two_runs,
    uneven, weights, with_scatter,
};
use crate::design_matrix::Candidate;
use crate::evidence;
use crate::grid::Grid;
use crate::nuisance_patterns::{Pattern, Weight};

/// Plans: two runs of uneven coverage, one run, one run a condition of one revolution each.
fn grids(rig: &NominalRig) -> [Grid; 3] {
    let bins = 40;
    let one = [Run { direction: Ccw, load_nm: 10.0, revolutions: vec![0..bins, 3..bins, 0..17] }];
    let conditions = [(Ccw, 5.0), (Ccw, 15.0), (Cw, 5.0), (Cw, 15.0)].map(|(sense, load)| full(sense, load, 1, bins));
    [two_runs(rig), grid(rig, &one, bins, uneven), grid(rig, &conditions, bins, uneven)]
}

fn candidates(grid: &Grid) -> Vec<Candidate> {
    let growing = Pattern::Order {
        shaft: gearmodel::effect::Shaft::Input,
        order: 2.0,
        odd: false,
        weight: Weight::Time,
        mean: grid.plan.duration_s,
    };
    let mut candidates = vec![
        order(1.0, false),
        order(13.0, false),
        Candidate::Unknown(growing),
        Candidate::Unknown(Pattern::Tone { frequency_hz: 1.37 }),
        Candidate::Unknown(super::support::smooth(1.0)),
        level(Weight::Time, false, grid.plan.duration_s),
    ];
    if grid.plan.runs > 1 {
        candidates
            .extend([level(Weight::One, true, 1.0), Candidate::Unknown(Pattern::RunLevels { runs: grid.plan.runs })]);
    }
    candidates
}

#[test]
fn products_and_determinant_are_those_of_the_full_matrix() {
    let rig = rig();
    for (number, grid) in grids(&rig).into_iter().enumerate() {
        let (grid, mut noise) = with_scatter(grid, 11 + number as u64);
        let pool = pool(&rig, &grid, &candidates(&grid));
        let all: Vec<usize> = (0..pool.width()).collect();
        let x = design(&grid, &pool, &all);
        let size = x.tr_mul(&(weights(&grid) * &x)) / noise.white_rad2;
        for run_ratio in [[1.0, 0.3], [0.02, 10.0], [10.0, 0.02]] {
            noise.run_ratio = run_ratio;
            let v = covariance(&grid, &noise, run_ratio);
            let n = v.nrows() as f64;
            let kappa = condition(&v);
            let dense = Dense::new(v);
            let right = dense.product(&x, &x);
            let whitened = noise.whiten(&grid, &pool);
            let few: Vec<usize> = (0..pool.width()).step_by(3).collect();
            let of_few = noise.within_runs(&grid, &pool, Some(&few)).between_runs(run_ratio);
            // The dense factorisation is exact for V + δV, |δV| ≤ n ε |V|: n ε κ(V) of the product. The identity
            // subtracts from XᵀWX/σ² what the waves take up: n ε of that.
            let tolerance = |a: usize, b: usize| {
                let norm = |m: &nalgebra::DMatrix<f64>| (m[(a, a)] * m[(b, b)]).sqrt();
                n * f64::EPSILON * (kappa * norm(&right) + norm(&size))
            };
            for a in 0..pool.width() {
                for b in 0..pool.width() {
                    let off = (whitened.gram[(a, b)] - right[(a, b)]).abs();
                    assert!(off <= tolerance(a, b), "plan {number} {run_ratio:?} ({a}, {b}): {off:e}");
                    // And that is fine enough to see a wave of a thousandth of its variance.
                    assert!(a != b || tolerance(a, a) < 1e-6 * right[(a, a)], "({a}, {a})");
                }
            }
            for (m, a) in few.iter().enumerate() {
                for (n, b) in few.iter().enumerate() {
                    assert!((of_few.gram[(m, n)] - right[(*a, *b)]).abs() <= tolerance(*a, *b), "of some: {a} {b}");
                }
            }
            // n logarithms of about −25 each, and κ in the pivots.
            let right = dense.log_det();
            let tolerance = n * f64::EPSILON * (kappa + right.abs());
            for log_det in [whitened.log_det, of_few.log_det] {
                assert!((log_det - right).abs() <= tolerance, "plan {number}: log det {log_det} {right}");
            }
        }
    }
}

/// log p(y | scales, κ) = log N(y; 0, V(κ) + X P⁻¹ Xᵀ): what the scatter between runs is weighed by.
#[test]
fn evidence_at_given_scales_is_the_normal_density_of_the_residual() {
    let rig = rig();
    let (grid, mut noise) = with_scatter(two_runs(&rig), 21);
    let pool = pool(&rig, &grid, &[order(1.0, false), order(13.0, true)]);
    let set = [0, 1];
    let fit = evidence::fit(&pool, &noise.whiten(&grid, &pool), &set, &[]).unwrap();
    let mut columns = vec![0];
    columns.extend(&fit.columns);
    for run_ratio in [[0.02, 0.02], [1.0, 0.3], [10.0, 3.0]] {
        noise.run_ratio = run_ratio;
        let v = covariance(&grid, &noise, run_ratio) + spread_of(&grid, &pool, &set, &fit.scales_rad);
        // Each of the n values adds about one; n ε κ of that is rounding's.
        let n = v.nrows() as f64;
        let tolerance = n * f64::EPSILON * condition(&v) * n;
        let right = Dense::new(v).log_normal_with_zero(&residual(&grid));
        let whitened = noise.within_runs(&grid, &pool, Some(&columns)).between_runs(run_ratio);
        let found = evidence::at_scales(&pool, &whitened, &fit);
        assert!(tolerance < 1e-3, "{tolerance}");
        assert!((found - right).abs() < tolerance, "{run_ratio:?}: {found} {right} ± {tolerance:e}");
    }
}
