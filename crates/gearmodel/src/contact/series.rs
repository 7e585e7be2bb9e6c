//! Polynomials through Chebyshev nodes: how a curve of solved contacts is carried between its nodes.

use std::f64::consts::PI;
use std::sync::LazyLock;

/// Nodes of a panel.
pub(super) const NODES: usize = 14;

/// Coefficients of 1, t, t², … on t ∈ [−1, 1].
///
/// Powers, not Chebyshev polynomials: Horner is half the work of Clenshaw, and the coefficients of a settled series fall
/// faster than the powers' condition grows.
pub(super) type Polynomial = [f64; NODES];

type Matrix = [[f64; NODES]; NODES];

/// Every second node: enough for what is small.
pub(super) const COARSE: usize = NODES / 2;

/// Nodes from which the next is foretold.
pub(super) const TRAIL: usize = 6;

/// From values at the nodes to coefficients.
struct Fit {
    nodes: [f64; NODES],
    /// Weights of the values at the [`TRAIL`] nodes before a node, those of the panel before included.
    foretold: [[f64; TRAIL]; NODES],
    /// Weights of the values at every second node that give those at all.
    filled: [[f64; COARSE]; NODES],
    /// Values to Chebyshev coefficients.
    chebyshev: Matrix,
    /// Values to coefficients of powers.
    powers: Matrix,
}

static FIT: LazyLock<Fit> = LazyLock::new(|| {
    let angle = |j: usize| PI * (j as f64 + 0.5) / NODES as f64;
    // t_j = −cos(π(j + ½)/N), ascending; c_k = (2 − δ_k0)/N Σ_j T_k(t_j) f_j
    let chebyshev: Matrix = std::array::from_fn(|k| {
        let weight = if k == 0 { 1.0 } else { 2.0 } / NODES as f64;
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        std::array::from_fn(|j| sign * weight * (k as f64 * angle(j)).cos())
    });
    // T_{k+1} = 2t T_k − T_{k−1} on coefficients of powers
    let mut basis: Matrix = [[0.0; NODES]; NODES];
    basis[0][0] = 1.0;
    basis[1][1] = 1.0;
    for k in 2..NODES {
        for n in 0..NODES {
            let raised = if n > 0 { 2.0 * basis[k - 1][n - 1] } else { 0.0 };
            basis[k][n] = raised - basis[k - 2][n];
        }
    }
    let powers: Matrix =
        std::array::from_fn(|n| std::array::from_fn(|j| (0..NODES).map(|k| basis[k][n] * chebyshev[k][j]).sum()));
    let nodes: [f64; NODES] = std::array::from_fn(|j| -angle(j).cos());
    // Lagrange through the nodes before, the panel before being 2 back.
    let before = |node: usize, n: usize| match (node + n).checked_sub(TRAIL) {
        Some(index) => nodes[index],
        None => nodes[node + n + NODES - TRAIL] - 2.0,
    };
    let foretold = std::array::from_fn(|node| lagrange(&std::array::from_fn(|n| before(node, n)), nodes[node]));
    let filled = std::array::from_fn(|node| lagrange(&std::array::from_fn(|n| nodes[2 * n]), nodes[node]));
    Fit { nodes, foretold, filled, chebyshev, powers }
});

/// Weights of the values at points that give the value at t of the polynomial through them.
fn lagrange<const N: usize>(points: &[f64; N], t: f64) -> [f64; N] {
    std::array::from_fn(|n| {
        let others = points.iter().enumerate().filter(|(other, _)| *other != n);
        others.map(|(_, other)| (t - other) / (points[n] - other)).product()
    })
}

/// Values at all nodes from those at every second.
pub(super) fn filled(coarse: &[f64; COARSE]) -> [f64; NODES] {
    FIT.filled.map(|row| row.iter().zip(coarse).map(|(weight, value)| weight * value).sum())
}

/// The nodes, ascending in [−1, 1].
pub(super) fn nodes() -> &'static [f64; NODES] {
    &FIT.nodes
}

/// The weights of the values at the [`TRAIL`] nodes before a node which foretell the value there.
pub(super) fn foretold(node: usize) -> &'static [f64; TRAIL] {
    &FIT.foretold[node]
}

/// The polynomial through values at the nodes, and the size of its last two Chebyshev coefficients: what a smooth function
/// leaves out is smaller.
pub(super) fn fit(values: &[f64; NODES]) -> (Polynomial, f64) {
    let row = |row: &[f64; NODES]| row.iter().zip(values).map(|(weight, value)| weight * value).sum::<f64>();
    let tail = row(&FIT.chebyshev[NODES - 1]).abs().max(row(&FIT.chebyshev[NODES - 2]).abs());
    (std::array::from_fn(|n| row(&FIT.powers[n])), tail)
}

/// The polynomial at t.
#[inline]
pub(super) fn evaluate(polynomial: &Polynomial, t: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, coefficient| sum * t + coefficient)
}

/// Where in [−1, 1] an increasing polynomial takes a value between those at the ends: Newton within the bracket.
pub(super) fn inverse(polynomial: &Polynomial, (first, last): (f64, f64), target: f64) -> f64 {
    let (mut low, mut high) = (-1.0, 1.0);
    let mut t = (2.0 * target - first - last) / (last - first);
    for _ in 0..60 {
        let (mut value, mut slope) = (0.0, 0.0);
        for coefficient in polynomial.iter().rev() {
            slope = slope * t + value;
            value = value * t + coefficient;
        }
        let error = value - target;
        if error > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let next = t - error / slope;
        let next = if next >= low && next <= high { next } else { 0.5 * (low + high) };
        // What Newton's last step misses is of its square.
        if (next - t).abs() < 1e-6 {
            return next;
        }
        t = next;
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_function_is_carried_between_the_nodes() {
        let function = |t: f64| (0.7 * t).exp() + (1.1 * t - 0.2).sin();
        let (polynomial, tail) = fit(&nodes().map(function));
        assert!(tail < 1e-9, "{tail:e}");
        for step in -50..=50 {
            let t = 0.02 * f64::from(step);
            assert!((evaluate(&polynomial, t) - function(t)).abs() < 10.0 * tail);
            assert!(
                (inverse(&polynomial, (function(-1.0), function(1.0)), evaluate(&polynomial, t)) - t).abs() < 1e-11
            );
        }
    }

    #[test]
    fn nodes_follow_from_those_before_and_beside_them() {
        let cubic = |t: f64| 1.0 + t * (0.3 - t * (0.2 + 0.7 * t));
        for node in 0..NODES {
            let known = |n: usize| {
                let index = node + NODES + n - TRAIL;
                cubic(nodes()[index % NODES] - if index < NODES { 2.0 } else { 0.0 })
            };
            let found: f64 = foretold(node).iter().enumerate().map(|(n, weight)| weight * known(n)).sum();
            assert!((found - cubic(nodes()[node])).abs() < 1e-9, "{node}: {found}");
            let coarse = std::array::from_fn(|n| cubic(nodes()[2 * n]));
            assert!((filled(&coarse)[node] - cubic(nodes()[node])).abs() < 1e-13, "{node}");
        }
    }

    #[test]
    fn a_kink_shows_in_the_tail() {
        let (_, tail) = fit(&nodes().map(f64::abs));
        assert!(tail > 1e-3, "{tail:e}");
    }
}
