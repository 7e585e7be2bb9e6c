//! AᵀB by panels on all cores: what most of a diagnosis' time would otherwise go to.

use nalgebra::{DMatrix, DMatrixView};
use rayon::prelude::*;

/// Columns of the left factor taken together.
const PANEL: usize = 64;
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
    symmetric(a, Some(weight))
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
