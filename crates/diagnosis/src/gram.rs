//! AᵀB by panels on all cores: what most of a diagnosis' time would otherwise go to.

use nalgebra::{DMatrix, DMatrixView};
use rayon::prelude::*;

/// Columns of the left factor taken together.
const PANEL: usize = 128;
/// Columns up to which a product is made column by column.
const FEW: usize = 4;
/// Products of fewer columns than this are not worth being shared out.
const SMALL: usize = 32;

/// A panel of a product: the row where it begins, and its rows.
pub(super) type Panel = (usize, DMatrix<f64>);

/// (w·A)ᵀB by panels of A's columns from `first` on. Where `lower` is set A and B are the same and only the columns up to the
/// panel's last are made.
pub(super) fn panels(
    a: DMatrixView<'_, f64>,
    first: usize,
    weight: Option<&[f64]>,
    b: DMatrixView<'_, f64>,
    lower: bool,
) -> Vec<Panel> {
    let starts: Vec<usize> = (first..a.ncols()).step_by(PANEL).collect();
    starts
        .into_par_iter()
        // The last panels are the longest: each is a task of its own.
        .with_max_len(1)
        .map(|start| {
            let width = PANEL.min(a.ncols() - start);
            // The transpose made first: only then is the product blocked for the caches.
            let mut left = a.columns(start, width).transpose();
            if let Some(weight) = weight {
                for (mut column, w) in left.column_iter_mut().zip(weight) {
                    column *= *w;
                }
            }
            let columns = if lower { start + width } else { b.ncols() };
            (start, left * b.columns(0, columns))
        })
        .collect()
}

/// AᵀA.
pub(super) fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    if a.ncols() < SMALL { a.transpose() * a } else { symmetric(a, None) }
}

/// AᵀWA with the weights of A's rows.
pub(super) fn weighted(a: &DMatrix<f64>, weight: &[f64]) -> DMatrix<f64> {
    if a.ncols() > FEW {
        return symmetric(a, Some(weight));
    }
    let columns: Vec<_> = a.column_iter().map(|column| column.into_owned()).collect();
    let sum = |m: usize, n: usize| {
        columns[m].iter().zip(columns[n].iter()).zip(weight).map(|((x, y), w)| w * x * y).sum::<f64>()
    };
    let mut product = DMatrix::zeros(a.ncols(), a.ncols());
    for m in 0..a.ncols() {
        for n in 0..=m {
            product[(m, n)] = sum(m, n);
            product[(n, m)] = product[(m, n)];
        }
    }
    product
}

/// AT of a small T.
pub(super) fn times(a: &DMatrix<f64>, t: &DMatrix<f64>) -> DMatrix<f64> {
    if a.ncols() > FEW {
        return a * t;
    }
    let mut product = DMatrix::zeros(a.nrows(), t.ncols());
    for (mut column, t) in product.column_iter_mut().zip(t.column_iter()) {
        for (x, factor) in a.column_iter().zip(t.iter()) {
            column.axpy(*factor, &x, 1.0);
        }
    }
    product
}

fn symmetric(a: &DMatrix<f64>, weight: Option<&[f64]>) -> DMatrix<f64> {
    let mut product = DMatrix::zeros(a.ncols(), a.ncols());
    for (start, panel) in panels(a.as_view(), 0, weight, a.as_view(), true) {
        product.view_mut((start, 0), panel.shape()).copy_from(&panel);
    }
    product.fill_upper_triangle_with_lower_triangle();
    product
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_give_the_plain_product() {
        for n in [1, SMALL - 1, SMALL, PANEL, 3 * PANEL + 7] {
            let a = DMatrix::from_fn(29, n, |i, j| ((i * 31 + j * 17) % 23) as f64 - 11.0);
            assert_eq!(gram(&a), a.transpose() * &a, "{n} columns");
            let weight: Vec<f64> = (0..29).map(|i| 1.0 + f64::from(i % 3)).collect();
            let b = DMatrix::from_fn(29, 5, |i, j| (i + 2 * j) as f64);
            let mut weighted = a.clone();
            for (mut row, w) in weighted.row_iter_mut().zip(&weight) {
                row *= *w;
            }
            assert_eq!(super::weighted(&a, &weight), weighted.transpose() * &a, "{n} columns");
            let plain = weighted.transpose() * &b;
            for (start, panel) in panels(a.as_view(), 0, Some(&weight), b.as_view(), false) {
                assert_eq!(panel, plain.rows(start, panel.nrows()));
            }
        }
    }
}
