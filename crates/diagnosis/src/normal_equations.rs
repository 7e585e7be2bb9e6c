//! Normal equations of a set of blocks: amplitudes, their covariance and the evidence under any prior variances.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use super::design_matrix::{Block, RESIDUAL};
use super::noise::Whitened;

/// Blocks of more columns than this are worth turning.
const TURNED: usize = 16;

/// Normal equations of a set, the columns of its widest block turned to where their part is diagonal: they then cost no more than a
/// diagonal does, however often the scales are moved.
pub(super) struct NormalEquations {
    /// Columns of the set that are turned.
    wide: Range<usize>,
    basis: Option<Arc<SymmetricEigen<f64, Dyn>>>,
    /// Their part, turned: the diagonal, the other columns' share, the right side.
    diagonal: DVector<f64>,
    cross: DMatrix<f64>,
    wide_rhs: DVector<f64>,
    /// The other columns of the set, their part and right side.
    pub others: Vec<usize>,
    gram: DMatrix<f64>,
    rhs: DVector<f64>,
}

/// A set's amplitudes at given scales, split as its normal equations are.
pub(super) struct Solved {
    /// Variances of the turned columns, the others given.
    within: DVector<f64>,
    /// Of the others' Schur complement.
    cholesky: Cholesky<f64, Dyn>,
    wide: DVector<f64>,
    others: DVector<f64>,
    /// Log evidence, but for what the residual and the noise add to that of every set.
    pub log_evidence: f64,
}

impl Solved {
    /// L⁻¹ of the others' Schur complement LLᵀ: their covariance is its Gram matrix.
    pub(super) fn half(&self) -> DMatrix<f64> {
        lower_inverse(&self.cholesky)
    }
}

impl NormalEquations {
    /// Without a wide block.
    pub(super) fn dense(gram: DMatrix<f64>, rhs: DVector<f64>) -> Self {
        Self {
            wide: 0..0,
            basis: None,
            diagonal: DVector::zeros(0),
            cross: DMatrix::zeros(0, rhs.len()),
            wide_rhs: DVector::zeros(0),
            others: (0..rhs.len()).collect(),
            gram,
            rhs,
        }
    }

    /// Of a set with these columns.
    pub(super) fn new(blocks: &[Block], whitened: &Whitened, set: &[usize], columns: &[usize]) -> Self {
        let widest = set.iter().map(|b| &blocks[*b]).filter(|b| b.width() > TURNED).max_by_key(|b| b.width());
        let Some(block) = widest else {
            let (gram, rhs) = select(&whitened.gram, columns);
            return Self::dense(gram, rhs);
        };
        let basis = whitened.basis(&block.columns);
        let first = columns.iter().position(|c| *c == block.columns.start).unwrap_or(0);
        let wide = first..first + block.width();
        let others: Vec<usize> = (0..columns.len()).filter(|n| !wide.contains(n)).collect();
        let numbers: Vec<usize> = others.iter().map(|n| columns[*n]).collect();
        let (gram, rhs) = select(&whitened.gram, &numbers);
        let start = block.columns.start;
        let cross = DMatrix::from_fn(block.width(), numbers.len(), |m, n| whitened.gram[(start + m, numbers[n])]);
        let wide_rhs = whitened.gram.view((start, RESIDUAL), (block.width(), 1));
        Self {
            wide,
            diagonal: basis.eigenvalues.map(|value| value.max(0.0)),
            cross: basis.eigenvectors.tr_mul(&cross),
            wide_rhs: basis.eigenvectors.tr_mul(&wide_rhs).column(0).into_owned(),
            basis: Some(basis),
            others,
            gram,
            rhs,
        }
    }

    /// The amplitudes under prior variances of the set's columns.
    pub(super) fn solve(&self, variances: &[f64]) -> Option<Solved> {
        let of_wide = &variances[self.wide.clone()];
        let within = DVector::from_fn(of_wide.len(), |n, _| 1.0 / (self.diagonal[n] + 1.0 / of_wide[n]));
        let mut schur = self.gram.clone();
        for (n, column) in self.others.iter().enumerate() {
            schur[(n, n)] += 1.0 / variances[*column];
        }
        let mut weighted = self.cross.clone();
        weighted.column_iter_mut().for_each(|mut column| column.component_mul_assign(&within));
        schur -= self.cross.tr_mul(&weighted);
        let cholesky = Cholesky::new(schur)?;
        let rhs = &self.rhs - weighted.tr_mul(&self.wide_rhs);
        let others = cholesky.solve(&rhs);
        let wide = (&self.wide_rhs - &self.cross * &others).component_mul(&within);
        let log_det = 2.0 * cholesky.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>()
            - within.iter().map(|v| v.ln()).sum::<f64>()
            + variances.iter().map(|v| v.ln()).sum::<f64>();
        let log_evidence = 0.5 * (self.rhs.dot(&others) + self.wide_rhs.dot(&wide)) - 0.5 * log_det;
        Some(Solved { within, cholesky, wide, others, log_evidence })
    }

    /// What the squares of the set's columns are expected to be; of the turned ones only the sum has a meaning.
    pub(super) fn squares(&self, solved: &Solved) -> Vec<f64> {
        let half = solved.half();
        let mut squares = vec![0.0; self.wide.len() + self.others.len()];
        for (n, column) in self.others.iter().enumerate() {
            squares[*column] = solved.others[n].powi(2) + half.column(n).norm_squared();
        }
        let shared = half * self.cross.transpose();
        for (n, column) in self.wide.clone().enumerate() {
            let within = solved.within[n];
            squares[column] = solved.wide[n].powi(2) + within + within * within * shared.column(n).norm_squared();
        }
        squares
    }

    /// The amplitudes in the order of the set's columns.
    pub(super) fn mean(&self, solved: &Solved) -> DVector<f64> {
        let mut mean = DVector::zeros(self.wide.len() + self.others.len());
        for (n, column) in self.others.iter().enumerate() {
            mean[*column] = solved.others[n];
        }
        if let Some(basis) = &self.basis {
            mean.rows_mut(self.wide.start, self.wide.len()).copy_from(&(&basis.eigenvectors * &solved.wide));
        }
        mean
    }

    /// Their covariance in that order.
    pub(super) fn covariance(&self, solved: &Solved) -> DMatrix<f64> {
        let width = self.wide.len() + self.others.len();
        let mut covariance = DMatrix::zeros(width, width);
        let half = solved.half();
        let of_others = half.tr_mul(&half);
        for (m, row) in self.others.iter().enumerate() {
            for (n, column) in self.others.iter().enumerate() {
                covariance[(*row, *column)] = of_others[(m, n)];
            }
        }
        let Some(basis) = &self.basis else { return covariance };
        // How the turned columns follow the others, turned back.
        let mut follow = self.cross.clone();
        follow.column_iter_mut().for_each(|mut column| column.component_mul_assign(&solved.within));
        let follow = &basis.eigenvectors * follow;
        let shared = &follow * &of_others;
        let own = &basis.eigenvectors * DMatrix::from_diagonal(&solved.within) * basis.eigenvectors.transpose()
            + &shared * follow.transpose();
        let (first, wide) = (self.wide.start, self.wide.len());
        covariance.view_mut((first, first), (wide, wide)).copy_from(&own);
        for (n, column) in self.others.iter().enumerate() {
            for m in 0..wide {
                covariance[(first + m, *column)] = -shared[(m, n)];
                covariance[(*column, first + m)] = -shared[(m, n)];
            }
        }
        covariance
    }
}

/// L⁻¹ of A = LLᵀ: A⁻¹ is its Gram matrix. Half the work of solving for the identity, most of which is zeros.
fn lower_inverse(cholesky: &Cholesky<f64, Dyn>) -> DMatrix<f64> {
    let l = cholesky.l_dirty();
    let n = l.nrows();
    let mut inverse = DMatrix::zeros(n, n);
    for (j, mut column) in inverse.column_iter_mut().enumerate() {
        column[j] = 1.0;
        for k in j..n {
            let value = column[k] / l[(k, k)];
            column[k] = value;
            column.rows_mut(k + 1, n - k - 1).axpy(-value, &l.column(k).rows(k + 1, n - k - 1), 1.0);
        }
    }
    inverse
}

/// Part and right side of some columns.
pub(super) fn select(gram: &DMatrix<f64>, columns: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
    let p = columns.len();
    (
        DMatrix::from_fn(p, p, |a, b| gram[(columns[a], columns[b])]),
        DVector::from_fn(p, |a, _| gram[(columns[a], RESIDUAL)]),
    )
}
