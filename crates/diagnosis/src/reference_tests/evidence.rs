//! Evidence of a set at scales s, the zero c among the amplitudes with a prior of 1 rad:
//!
//! ```text
//! p(y | s) = ∫ N(y; Xβ, V) Π_j N(β_j; 0, s_j²/d_j) dβ,     β of one sign: 2 N(β; 0, s²) on β > 0
//! ```
//!
//! by quadrature over the amplitudes, and as the normal density with covariance V + Σ s²/d XXᵀ, which is the same
//! integral done another way. A candidate's scale is averaged over 1 µrad · 2ⁿ, n = 0 … 10; a set's scales are where
//! the evidence is largest.

use gearmodel::effect::NominalRig;
use nalgebra::{DMatrix, DVector};

use super::support::{
    Dense, Random, TRUTH, add_trace, covariance, design, draw, effect, full, grid, level, order, pool, residual, rig,
    spread_of, two_runs, uneven, with_scatter,
};
use crate::design_matrix::{Candidate, DesignMatrix};
use crate::evidence::{Fit, fit, scan};
use crate::grid::Grid;
use crate::noise::{Noise, Whitened};
use crate::nuisance_patterns::Pattern;
use gearmodel::Direction::{Ccw, Cw};

/// What a free scale costs a block of up to two columns, nats.
const SCALE_NATS: f64 = 1.3;

/// A campaign with its pool, noise and what it is whitened to.
struct Case {
    grid: Grid,
    pool: DesignMatrix,
    noise: Noise,
    whitened: Whitened,
}

impl Case {
    /// Scatter, and traces of a pool's columns.
    fn new(rig: &NominalRig, grid: Grid, candidates: &[Candidate], amplitudes: &[(usize, f64)]) -> Self {
        let (mut grid, noise) = with_scatter(grid, 31);
        let columns = pool(rig, &grid, candidates);
        add_trace(&mut grid, &columns, amplitudes);
        let pool = pool(rig, &grid, candidates);
        let whitened = noise.whiten(&grid, &pool);
        Self { grid, pool, noise, whitened }
    }

    fn dense(&self) -> Dense {
        Dense::new(covariance(&self.grid, &self.noise, self.noise.run_ratio))
    }

    /// What the evidence of every set lacks: that of the residual alone.
    fn offset(&self) -> f64 {
        let dense = self.dense();
        let y = residual(&self.grid);
        -0.5 * dense.product(&y, &y)[(0, 0)] - 0.5 * dense.log_det()
    }

    /// log p(y | set, scales).
    fn log_density(&self, set: &[usize], scales_rad: &[f64]) -> f64 {
        let v = covariance(&self.grid, &self.noise, self.noise.run_ratio);
        Dense::new(v + spread_of(&self.grid, &self.pool, set, scales_rad)).log_normal_with_zero(&residual(&self.grid))
    }

    fn fit(&self, set: &[usize]) -> Fit {
        fit(&self.pool, &self.whitened, set, &[]).unwrap()
    }
}

/// Nodes and weights of Gauss and Legendre on (−1, 1), five points: exact to order 9.
const LEGENDRE: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// log ∫ exp(−½|r − Uβ|² − ½ Σ β²/v) Π dβ/√(2πv) with r and U whitened, on a lattice; a `positive` amplitude is
/// integrated from 0 with twice the prior.
///
/// The trapezium rule on a normal density at a step of 0.7 of the conditional standard deviation is off by
/// 2 exp(−2π²/(0.7² λ)), λ ≤ 2 the largest eigenvalue of the amplitudes' scaled precision: under 1e-8. Eight standard
/// deviations leave out 1e-15.
fn quadrature(u: &DMatrix<f64>, r: &DMatrix<f64>, variances: &[f64], positive: Option<usize>) -> f64 {
    let d = variances.len();
    // Where the lattice lies; the integral does not depend on it.
    let precision = u.tr_mul(u) + DMatrix::from_diagonal(&DVector::from_fn(d, |n, _| 1.0 / variances[n]));
    let spread = precision.clone().try_inverse().unwrap();
    let centre = &spread * u.tr_mul(r);
    let axes: Vec<Vec<(f64, f64)>> = (0..d)
        .map(|n| {
            let (reach, step) = (8.0 * spread[(n, n)].sqrt(), 0.7 / precision[(n, n)].sqrt());
            if positive == Some(n) {
                // Panels of half a conditional deviation. Far below zero the density falls as exp(−|m|β/σ²): as far
                // as that.
                let end = centre[n].max(0.0) + reach;
                let panels = (2.0 * end / step).ceil().max(64.0);
                let half = 0.5 * end / panels;
                let middles = (0..panels as usize).map(|p| (2.0 * p as f64 + 1.0) * half);
                return middles.flat_map(|m| LEGENDRE.map(|(x, w)| (m + half * x, 2.0 * half * w))).collect();
            }
            let count = (reach / step).ceil() as i32;
            (-count..=count).map(|k| (centre[n] + f64::from(k) * step, step)).collect()
        })
        .collect();
    let count: usize = axes.iter().map(Vec::len).product();
    let mut logs = Vec::with_capacity(count);
    let mut beta = DMatrix::zeros(d, 1);
    for number in 0..count {
        let (mut rest, mut log) = (number, 0.0);
        for (n, axis) in axes.iter().enumerate() {
            let (x, weight) = axis[rest % axis.len()];
            rest /= axis.len();
            beta[n] = x;
            log += weight.ln() - 0.5 * x * x / variances[n] - 0.5 * (std::f64::consts::TAU * variances[n]).ln();
        }
        logs.push(log - 0.5 * (r - u * &beta).norm_squared());
    }
    log_sum(&logs)
}

fn log_sum(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + logs.iter().map(|x| (x - most).exp()).sum::<f64>().ln()
}

/// Two runs of both senses and two loads, whole turns.
fn both_senses(rig: &NominalRig) -> Grid {
    grid(rig, &[full(Ccw, 5.0, 2, 30), full(Cw, 15.0, 2, 30)], 30, uneven)
}

#[test]
fn evidence_of_a_set_at_its_scales_is_the_integral_over_its_amplitudes() {
    let rig = rig();
    let candidates = [
        level(crate::nuisance_patterns::Weight::One, true, 1.0),
        order(11.0, false),
        Candidate::Unknown(Pattern::Tone { frequency_hz: 0.93 }),
    ];
    // Columns 2 | 3, 4 | 5, 6: one block large, the other hardly there.
    let case = Case::new(&rig, both_senses(&rig), &candidates, &[(3, 6e-6), (4, -9e-6)]);
    let dense = case.dense();
    let offset = case.offset();
    let r = dense.whiten(&residual(&case.grid));
    for set in [vec![], vec![0], vec![1], vec![0, 1], vec![2]] {
        let fit = case.fit(&set);
        let u = dense.whiten(&design(&case.grid, &case.pool, &fit.columns));
        let mut variances = vec![1.0];
        for (block, scale) in set.iter().zip(&fit.scales_rad) {
            let d = case.pool.blocks[*block].width();
            variances.extend(vec![scale * scale / d as f64; d]);
        }
        let integral = quadrature(&u, &r, &variances, None) - 0.5 * dense.log_det();
        let found = offset + fit.log_evidence + SCALE_NATS * set.len() as f64;
        assert!((found - integral).abs() < 1e-6, "{set:?}: {found} {integral}");
        // The same integral as a density.
        let density = case.log_density(&set, &fit.scales_rad);
        assert!((density - integral).abs() < 1e-6, "{set:?}: {density} {integral}");
    }
}

/// Φ by its series x − x³/(2·3) + x⁵/(2²·2!·5) …, for what is not far out.
fn normal_cdf(z: f64) -> f64 {
    let (mut term, mut sum) = (z, z);
    for n in 1..200 {
        term *= -z * z / (2.0 * f64::from(n));
        sum += term / (2.0 * f64::from(n) + 1.0);
    }
    0.5 + sum / std::f64::consts::TAU.sqrt()
}

#[test]
fn an_amplitude_of_one_sign_has_half_a_normal_as_prior() {
    let rig = rig();
    let base = both_senses(&rig);
    let candidates = [effect(&rig, &base, "mesh_compliance"), order(11.0, false)];
    let mut seen = [0; 3];
    for amplitude in [40e-6, 5e-6, 0.0, -8e-6, -16e-6, -30e-6, -60e-6] {
        let case = Case::new(&rig, base.clone(), &candidates, &[(2, amplitude)]);
        assert_eq!(case.pool.blocks[0].width(), 1);
        let dense = case.dense();
        let r = dense.whiten(&residual(&case.grid));
        let fit = case.fit(&[0]);
        let u = dense.whiten(&design(&case.grid, &case.pool, &fit.columns));
        let variances = [1.0, fit.scales_rad[0].powi(2)];
        let integral = quadrature(&u, &r, &variances, Some(1)) - 0.5 * dense.log_det();
        let found = case.offset() + fit.log_evidence + SCALE_NATS;
        let precision = u.tr_mul(&u) + DMatrix::from_diagonal(&DVector::from_row_slice(&variances.map(|v| 1.0 / v)));
        let z = fit.mean[1] / precision.try_inverse().unwrap()[(1, 1)].sqrt();
        // Φ is known to 1.5e-7; below −5 by the first term of a series whose next is 1/z² of it.
        let tolerance = if z < -5.0 { 1.0 / (z * z) } else { 1e-6 + 1.5e-7 / normal_cdf(z) };
        assert!((found - integral).abs() < tolerance, "z = {z}: {found} {integral}");
        seen[if z < -5.0 { 0 } else { 1 + usize::from(z > 0.0) }] += 1;
        // Averaged over the scales as a candidate: the same integral at each.
        let gain = scan(&case.pool, &case.whitened, &case.fit(&[]), &[0])[0];
        let none = quadrature(&u.columns(0, 1).into_owned(), &r, &[1.0], None);
        let each: Vec<f64> = scales().iter().map(|s| quadrature(&u, &r, &[1.0, s * s], Some(1)) - none).collect();
        let right = log_sum(&each) - (each.len() as f64).ln();
        // The smallest scales, which weigh most where the sign is wrong, stand near z = 0.
        assert!((gain - right).abs() < tolerance.max(1e-5), "z = {z}: gain {gain} {right}");
    }
    assert!(seen.iter().all(|n| *n > 0), "{seen:?}");
}

/// 1, 2, 4 … 1024 µrad.
fn scales() -> Vec<f64> {
    (0..11).map(|n| 1e-6 * f64::from(1 << n)).collect()
}

#[test]
fn a_candidate_s_gain_is_its_evidence_averaged_over_the_scales() {
    let rig = rig();
    let candidates = [
        order(11.0, false),
        order(1.0, true),
        level(crate::nuisance_patterns::Weight::Load, false, 10.0),
        Candidate::Unknown(Pattern::RunLevels { runs: 2 }),
        Candidate::Unknown(Pattern::RandomWalk { terms: 12, duration_s: 60.0 }),
    ];
    let case = Case::new(&rig, both_senses(&rig), &candidates, &[(2, 6e-6), (4, 20e-6), (5, 5e-6)]);
    for set in [vec![], vec![0], vec![0, 1]] {
        let fit = case.fit(&set);
        let others: Vec<usize> = (0..candidates.len()).filter(|b| !set.contains(b)).collect();
        let base = case.log_density(&set, &fit.scales_rad);
        let with = |block: usize, scale_rad: f64| {
            let (set, scales) = ([&set[..], &[block]].concat(), [&fit.scales_rad[..], &[scale_rad]].concat());
            case.log_density(&set, &scales) - base
        };
        for (block, gain) in others.iter().zip(scan(&case.pool, &case.whitened, &fit, &others)) {
            let each: Vec<f64> = scales().iter().map(|s| with(*block, *s)).collect();
            let right = log_sum(&each) - 11.0_f64.ln();
            assert!((gain - right).abs() < 1e-6, "{block} beside {set:?}: {gain} {right}");
            // And the grid stands for all scales between, alike in their logarithm: its ends count whole instead of
            // half, ln(11/10); a density no narrower in ln s than 1/√(2d) is summed in steps of ln 2 to
            // 2 exp(−2π²/(2d ln²2)).
            let fine: Vec<f64> =
                (0..=200).map(|n| with(*block, 1e-6 * 1024.0_f64.powf(f64::from(n) / 200.0))).collect();
            let d = case.pool.blocks[*block].width() as f64;
            let narrow = 2.0 * (-std::f64::consts::PI.powi(2) / (d * std::f64::consts::LN_2.powi(2))).exp();
            let tolerance = 1.1_f64.ln() + narrow.min(0.7);
            assert!((gain - log_sum(&fine) + 201.0_f64.ln()).abs() < tolerance, "{block} beside {set:?}");
        }
    }
}

/// A block of more than 16 columns is scanned at 2, 8, 32 and 128 µrad, and the best of them taken for all.
#[test]
fn a_wide_candidate_s_gain_is_that_of_the_best_of_four_scales() {
    let rig = rig();
    let walk = Pattern::RandomWalk { terms: 20, duration_s: 60.0 };
    let candidates = [Candidate::Unknown(super::support::smooth(1.0)), order(11.0, false), Candidate::Unknown(walk)];
    let case = Case::new(&rig, two_runs(&rig), &candidates, &[(7, 8e-6), (20, 5e-6)]);
    let fit = case.fit(&[1]);
    let base = case.log_density(&[1], &fit.scales_rad);
    for (block, gain) in [0, 2].into_iter().zip(scan(&case.pool, &case.whitened, &fit, &[0, 2])) {
        assert!(case.pool.blocks[block].width() > 16);
        let each = [2e-6, 8e-6, 32e-6, 128e-6].map(|s| case.log_density(&[1, block], &[fit.scales_rad[0], s]) - base);
        let right = each.into_iter().fold(f64::NEG_INFINITY, f64::max) - 4.0_f64.ln();
        assert!((gain - right).abs() < 1e-6, "{block}: {gain} {right}");
        assert!(gain <= log_sum(&each) - 4.0_f64.ln() + 1e-6, "no more than their mean");
    }
}

/// s moves to where p(y | s) is largest. Its last step is under 5 %, and of blocks that stand out of the noise each
/// step leaves under half of the way: 5 % at most are left. About the maximum log p falls by d (Δ ln s)² a block.
#[test]
fn scales_stand_where_the_evidence_is_largest() {
    let rig = rig();
    let candidates = [level(crate::nuisance_patterns::Weight::One, true, 1.0), order(11.0, false), order(13.0, true)];
    let amplitudes = [(2, 90e-6), (3, 15e-6), (4, 12e-6), (5, 8e-6), (6, -11e-6)];
    let case = Case::new(&rig, both_senses(&rig), &candidates, &amplitudes);
    for set in [vec![1], vec![1, 2], vec![0, 1, 2]] {
        let fit = case.fit(&set);
        let mut scales = fit.scales_rad.clone();
        let mut best = case.log_density(&set, &scales);
        let start = best;
        // Coordinate by coordinate, in steps that halve.
        let mut step: f64 = 0.1;
        while step > 1e-3 {
            let before = best;
            for n in 0..scales.len() {
                for factor in [step.exp(), (-step).exp()] {
                    let mut tried = scales.clone();
                    tried[n] *= factor;
                    let log = case.log_density(&set, &tried);
                    if log > best {
                        (best, scales) = (log, tried);
                    }
                }
            }
            if best == before {
                step *= 0.5;
            }
        }
        let columns: usize = set.iter().map(|b| case.pool.blocks[*b].width()).sum();
        assert!(best - start < 0.05_f64.powi(2) * columns as f64, "{set:?}: {} nats left", best - start);
    }
}

/// The cost of a free scale against the average over the scales: of a block of d columns far above the noise p(y | s)
/// is, about its maximum, exp(−d (ln s − ln ŝ)²), so that the average over ln 1024 lies ln(ln 1024 √(d/π)) nats under
/// it: 1.36 for one column, 1.71 for two.
#[test]
fn a_free_scale_costs_about_what_its_average_takes() {
    let rig = rig();
    let case = Case::new(
        &rig,
        both_senses(&rig),
        &[order(11.0, false), effect(&rig, &both_senses(&rig), "mesh_compliance")],
        &[(2, 25e-6), (3, 20e-6), (4, 120e-6)],
    );
    let empty = case.fit(&[]);
    for (block, d) in [(0, 2.0), (1, 1.0_f64)] {
        let gain = case.fit(&[block]).log_evidence - empty.log_evidence;
        let averaged = scan(&case.pool, &case.whitened, &empty, &[block])[0];
        let law = (1024.0_f64.ln() * (d / std::f64::consts::PI).sqrt()).ln();
        // The grid's ends count whole; the density in ln s is not quite normal: its next term is of order 1/(12 d)·….
        let tolerance = 1.1_f64.ln() + 0.25 / d;
        assert!((gain + SCALE_NATS - averaged - law).abs() < tolerance, "{d} columns: {gain} {averaged}");
        assert!((SCALE_NATS - law).abs() < 0.5);
    }
}

/// Of two sets of which one is true the evidence of the wrong one over that of the right one has a mean of 1 over the
/// data, and is so beyond e⁴ in e⁻⁴ of all draws at most: amplitudes drawn from the prior, differences of log
/// evidence as `fit` gives them.
#[test]
fn the_set_that_data_is_drawn_from_is_the_more_probable_on_average() {
    let rig = rig();
    let base = both_senses(&rig);
    let candidates = [order(11.0, false), order(13.0, false)];
    let (first, noise) = with_scatter(base, 31);
    let columns = pool(&rig, &first, &candidates);
    let mut random = Random::new(77);
    let scale_rad = 4e-6;
    let mut differences = Vec::new();
    for _ in 0..40 {
        let mut grid = first.clone();
        grid.rho_rad = draw(&grid, &TRUTH, &mut random);
        let amplitudes = [2, 3].map(|c| (c, scale_rad * 0.5_f64.sqrt() * random.normal()));
        add_trace(&mut grid, &columns, &amplitudes);
        let pool = pool(&rig, &grid, &candidates);
        let whitened = noise.whiten(&grid, &pool);
        let of = |set: &[usize]| fit(&pool, &whitened, set, &[]).unwrap().log_evidence;
        differences.push(of(&[0]) - of(&[1]));
    }
    // 40 e⁻⁴ = 0.7 expected at most; more than 5 of a binomial of that mean come in 1e-4 of all runs.
    let wrong = differences.iter().filter(|d| **d < -4.0).count();
    assert!(wrong <= 5, "{wrong} of 40 beyond e⁴");
    assert!(differences.iter().sum::<f64>() > 0.0);
}
