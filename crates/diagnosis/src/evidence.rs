//! Evidence of a set of blocks: how probable the residual is when just these are there.
//!
//! An amplitude in the design matrix is the RMS of its trace, so a block of d columns has the prior N(0, s²/d) each, s its own scale:
//! one huge effect does not hide small ones. A candidate's scale is averaged over a grid from 1 µrad to 1 mrad; the scales of
//! a set are then moved to where its evidence is largest, each at the cost of having been free.

use gearmodel::effect::Estimate;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::design_matrix::{Block, DesignMatrix, RESIDUAL, ZERO};
use super::noise::Whitened;
use super::normal_equations::{NormalEquations, select};
use super::settings::EvidenceSettings;

/// A set of blocks, fitted.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Blocks.
    pub set: Vec<usize>,
    /// Their scales, rad.
    pub scales_rad: Vec<f64>,
    /// Columns: the zero, then the blocks'.
    pub columns: Vec<usize>,
    /// Amplitudes of the columns.
    pub mean: DVector<f64>,
    /// Log evidence, prior of the set not included.
    pub log_evidence: f64,
}

impl Fit {
    /// (column, amplitude) of all columns, the zero included.
    #[must_use]
    pub fn amplitudes(&self) -> Vec<(usize, f64)> {
        self.columns.iter().copied().zip(self.mean.iter().copied()).collect()
    }

    /// Where block `n` of the set stands among the columns.
    #[must_use]
    pub fn place(&self, design: &DesignMatrix, n: usize) -> std::ops::Range<usize> {
        let first = 1 + self.set[..n].iter().map(|b| design.blocks[*b].width()).sum::<usize>();
        first..first + design.blocks[self.set[n]].width()
    }

    /// RMS of the trace of block `n` of the set, rad.
    #[must_use]
    pub fn rms_rad(&self, design: &DesignMatrix, n: usize) -> f64 {
        let place = self.place(design, n);
        let mut square = 0.0;
        for a in place.clone() {
            for b in place.clone() {
                square += self.mean[a] * self.mean[b] * design.covariance(self.columns[a], self.columns[b]);
            }
        }
        square.max(0.0).sqrt()
    }
}

fn columns(blocks: &[Block], set: &[usize]) -> Vec<usize> {
    std::iter::once(ZERO).chain(set.iter().flat_map(|b| blocks[*b].columns.clone())).collect()
}

/// Prior variances of the columns.
fn prior(design: &DesignMatrix, set: &[usize], scales_rad: &[f64]) -> Vec<f64> {
    let mut variances = vec![design.evidence().zero_rad * design.evidence().zero_rad];
    for (block, scale) in set.iter().zip(scales_rad) {
        let width = design.blocks[*block].width();
        variances.extend(std::iter::repeat_n(scale * scale / width as f64, width));
    }
    variances
}

/// Fits a set, its scales moved to where the evidence is largest. `None` where the columns cannot be told apart at all.
pub fn fit(design: &DesignMatrix, whitened: &Whitened, set: &[usize], start_rad: &[f64]) -> Option<Fit> {
    let (blocks, settings) = (&design.blocks, design.evidence());
    let columns = columns(blocks, set);
    let normal = NormalEquations::new(blocks, whitened, set, &columns);
    let mut scales_rad: Vec<f64> =
        (0..set.len()).map(|n| start_rad.get(n).copied().unwrap_or(settings.first_scale_rad)).collect();
    let mut solved = normal.solve(&prior(design, set, &scales_rad))?;
    for _ in 0..settings.scale_passes {
        let squares = normal.squares(&solved);
        let mut first = 1;
        let mut moved = 0.0_f64;
        for (scale, block) in scales_rad.iter_mut().zip(set) {
            let width = blocks[*block].width();
            // s² is what the amplitudes are expected to sum up to: |m|² + trace of their covariance.
            let square: f64 = squares[first..first + width].iter().sum();
            let next = square.sqrt().clamp(settings.least_scale_rad, settings.largest_scale_rad);
            moved = moved.max((next / *scale).ln().abs());
            *scale = next;
            first += width;
        }
        solved = normal.solve(&prior(design, set, &scales_rad))?;
        if moved < settings.scale_moved {
            break;
        }
    }
    let mean = normal.mean(&solved);
    let cost: f64 = set.iter().map(|block| scale_cost_nats(blocks[*block].width(), settings)).sum();
    let half = solved.half();
    let mut signs = 0.0;
    for block in set.iter().map(|block| &blocks[*block]).filter(|block| one_sided(block)) {
        let is_own = |n: &usize| columns[*n] == block.columns.start;
        if let Some((n, column)) = normal.others.iter().copied().enumerate().find(|(_, n)| is_own(n)) {
            signs += sign_evidence(mean[column], half.column(n).norm_squared());
        }
    }
    Some(Fit { set: set.to_vec(), scales_rad, columns, mean, log_evidence: solved.log_evidence - cost + signs })
}

/// What the freedom of a block's scale costs, nats.
fn scale_cost_nats(width: usize, settings: &EvidenceSettings) -> f64 {
    let wide = settings.wide_scale_cost_nats + 2.0 / width as f64;
    settings.scale_cost_nats.min(wide).max(settings.least_scale_cost_nats)
}

/// Covariance of a fit's amplitudes under the noise that it was made with.
#[must_use]
pub fn covariance(design: &DesignMatrix, whitened: &Whitened, fit: &Fit) -> DMatrix<f64> {
    let normal = NormalEquations::new(&design.blocks, whitened, &fit.set, &fit.columns);
    let width = fit.columns.len();
    // What could be fitted can be solved.
    let solved = normal.solve(&prior(design, &fit.set, &fit.scales_rad));
    solved.map_or_else(|| DMatrix::zeros(width, width), |solved| normal.covariance(&solved))
}

/// Amplitudes of block `n` of a fit in the effect's own units.
#[must_use]
pub(super) fn estimate(design: &DesignMatrix, whitened: &Whitened, fit: &Fit, n: usize) -> Estimate {
    let block = &design.blocks[fit.set[n]];
    let place = fit.place(design, n);
    let mean = fit.mean.rows(place.start, place.len());
    let covariance = covariance(design, whitened, fit);
    let covariance = covariance.view((place.start, place.start), (place.len(), place.len()));
    Estimate {
        beta: (&block.transform * mean).iter().copied().collect(),
        covariance: &block.transform * covariance * block.transform.transpose(),
    }
}

/// Log evidence of a fit's set at its scales under another noise, whose matrix holds the residual and the fit's columns only.
#[must_use]
pub(super) fn at_scales(design: &DesignMatrix, whitened: &Whitened, fit: &Fit) -> f64 {
    let columns: Vec<usize> = (1..=fit.columns.len()).collect();
    let (g, b) = select(&whitened.gram, &columns);
    let evidence = log_evidence(g, b, &prior(design, &fit.set, &fit.scales_rad));
    evidence - 0.5 * whitened.log_det - 0.5 * whitened.gram[(RESIDUAL, RESIDUAL)]
}

fn log_evidence(gram: DMatrix<f64>, rhs: DVector<f64>, variances: &[f64]) -> f64 {
    NormalEquations::dense(gram, rhs).solve(variances).map_or(f64::NEG_INFINITY, |solved| solved.log_evidence)
}

fn one_sided(block: &Block) -> bool {
    matches!(block.candidate, super::design_matrix::Candidate::Effect { effect, .. } if effect.one_sided())
        && block.width() == 1
}

/// Log of how much more probable a half-line prior makes it: log 2 Φ(m/σ).
fn sign_evidence(mean: f64, variance: f64) -> f64 {
    let z = mean / variance.sqrt();
    if z < -5.0 {
        // log Φ(z) ≈ −z²/2 − log(−z √2π)
        return std::f64::consts::LN_2 - 0.5 * z * z - (-z * (2.0 * std::f64::consts::PI).sqrt()).ln();
    }
    (2.0 * normal_cdf(z)).ln()
}

/// Φ(z) by the error function's rational form (Abramowitz & Stegun 7.1.26, 1.5e-7).
fn normal_cdf(z: f64) -> f64 {
    let x = z.abs() / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let poly =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let upper = 0.5 * poly * (-x * x).exp();
    (if z > 0.0 { 1.0 - upper } else { upper }).max(1e-300)
}

/// How much each candidate's addition to a fitted set would raise the log evidence, its scale averaged over the grid.
pub fn scan(design: &DesignMatrix, whitened: &Whitened, fit: &Fit, candidates: &[usize]) -> Vec<f64> {
    use rayon::prelude::*;
    let blocks = &design.blocks;
    let gram = &whitened.gram;
    let (mut a, b) = select(gram, &fit.columns);
    for (n, variance) in prior(design, &fit.set, &fit.scales_rad).iter().enumerate() {
        a[(n, n)] += 1.0 / variance;
    }
    let Some(cholesky) = Cholesky::new(a) else { return vec![f64::NEG_INFINITY; candidates.len()] };
    let l = cholesky.l();
    let Some(half_b) = l.solve_lower_triangular(&b) else { return vec![f64::NEG_INFINITY; candidates.len()] };
    candidates
        .par_iter()
        .map(|candidate| {
            let block = &blocks[*candidate];
            let own: Vec<usize> = block.columns.clone().collect();
            let d = own.len();
            let cross = DMatrix::from_fn(fit.columns.len(), d, |n, m| gram[(fit.columns[n], own[m])]);
            let Some(half) = l.solve_lower_triangular(&cross) else { return f64::NEG_INFINITY };
            let (g, mut rhs) = select(gram, &own);
            let schur = g - half.tr_mul(&half);
            rhs -= half.tr_mul(&half_b);
            gain(&schur, &rhs, d, one_sided(block), design.evidence())
        })
        .collect()
}

/// [`gain`] of a wide block on a coarser grid of scales: a factorisation each is cheaper than one eigendecomposition.
fn gain_of_wide(schur: &DMatrix<f64>, rhs: &DVector<f64>, d: usize, settings: &EvidenceSettings) -> f64 {
    let logs: Vec<f64> = (0..settings.wide_scales)
        .map(|n| {
            let scale = 2.0 * settings.smallest_scale_rad * 4.0_f64.powi(n);
            log_evidence(schur.clone(), rhs.clone(), &vec![scale * scale / d as f64; d])
        })
        .collect();
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most - f64::from(settings.wide_scales).ln()
}

/// Log evidence gained by a block with Schur complement `schur` and right side `rhs`, mean over the scales.
pub(super) fn gain(
    schur: &DMatrix<f64>,
    rhs: &DVector<f64>,
    d: usize,
    one_sided: bool,
    settings: &EvidenceSettings,
) -> f64 {
    if d > settings.wide_columns {
        return gain_of_wide(schur, rhs, d, settings);
    }
    let (values, projected): (Vec<f64>, Vec<f64>) = if d == 1 {
        (vec![schur[(0, 0)]], vec![rhs[0]])
    } else {
        let eigen = SymmetricEigen::new(schur.clone());
        let projected = eigen.eigenvectors.tr_mul(rhs);
        (eigen.eigenvalues.iter().copied().collect(), projected.iter().copied().collect())
    };
    let logs: Vec<f64> = (0..settings.scales)
        .map(|n| {
            let scale = settings.smallest_scale_rad * 2.0_f64.powi(n as i32);
            let variance = scale * scale / d as f64;
            let mut sum = 0.0;
            for (value, r) in values.iter().zip(&projected) {
                let precision = value.max(0.0) + 1.0 / variance;
                sum += 0.5 * r * r / precision - 0.5 * (precision * variance).ln();
            }
            if one_sided && d == 1 {
                let precision = values[0].max(0.0) + 1.0 / variance;
                sum += sign_evidence(projected[0] / precision, 1.0 / precision);
            }
            sum
        })
        .collect();
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + (logs.iter().map(|x| (x - most).exp()).sum::<f64>() / settings.scales as f64).ln()
}
