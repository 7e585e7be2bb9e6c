//! Shapes of free pitch curves: Fourier series and periodic cubic splines, and the mate that closes.

use std::f64::consts::TAU;

/// 1 + Σ a_n cos nθ + b_n sin nθ and its slope.
pub(crate) fn fourier(cosines: &[f64], sines: &[f64], theta_rad: f64) -> (f64, f64) {
    let (mut value, mut slope) = (1.0, 0.0);
    for n in 1..=cosines.len().max(sines.len()) {
        let order = n as f64;
        let a = cosines.get(n - 1).copied().unwrap_or(0.0);
        let b = sines.get(n - 1).copied().unwrap_or(0.0);
        let (sin, cos) = (order * theta_rad).sin_cos();
        value += a * cos + b * sin;
        slope += order * (b * cos - a * sin);
    }
    (value, slope)
}

/// A cubic spline of period 2π, twice continuously differentiable.
#[derive(Clone, Debug)]
pub(crate) struct Spline {
    knots_rad: Vec<f64>,
    values: Vec<f64>,
    /// Second derivatives at the knots.
    bends: Vec<f64>,
}

impl Spline {
    /// Through `values` at the angles `knots_rad`, strictly increasing within one turn, at least three (checked by the
    /// caller).
    pub(crate) fn new(knots_rad: &[f64], values: &[f64]) -> Self {
        let n = knots_rad.len();
        let next = |j: usize| (j + 1) % n;
        let previous = |j: usize| (j + n - 1) % n;
        let width = |j: usize| (knots_rad[next(j)] - knots_rad[j]).rem_euclid(TAU);
        // h_{j−1} M_{j−1} + 2(h_{j−1} + h_j) M_j + h_j M_{j+1} = 6 (Δ_j − Δ_{j−1}), cyclic
        let slope = |j: usize| (values[next(j)] - values[j]) / width(j);
        let below: Vec<f64> = (0..n).map(|j| width(previous(j))).collect();
        let diagonal: Vec<f64> = (0..n).map(|j| 2.0 * (width(previous(j)) + width(j))).collect();
        let above: Vec<f64> = (0..n).map(width).collect();
        let right: Vec<f64> = (0..n).map(|j| 6.0 * (slope(j) - slope(previous(j)))).collect();
        let bends = solve_cyclic(&below, &diagonal, &above, &right);
        Self { knots_rad: knots_rad.to_vec(), values: values.to_vec(), bends }
    }

    /// Value and slope at an angle.
    pub(crate) fn at(&self, theta_rad: f64) -> (f64, f64) {
        let n = self.knots_rad.len();
        let first = self.knots_rad[0];
        let theta = first + (theta_rad - first).rem_euclid(TAU);
        let j = self.knots_rad.partition_point(|knot| *knot <= theta).saturating_sub(1);
        let next = (j + 1) % n;
        let h = if next == 0 { first + TAU - self.knots_rad[j] } else { self.knots_rad[next] - self.knots_rad[j] };
        let (b, a) = ((theta - self.knots_rad[j]) / h, 1.0 - (theta - self.knots_rad[j]) / h);
        let (m0, m1) = (self.bends[j], self.bends[next]);
        let value =
            a * self.values[j] + b * self.values[next] + h * h / 6.0 * ((a * a * a - a) * m0 + (b * b * b - b) * m1);
        let slope =
            (self.values[next] - self.values[j]) / h + h / 6.0 * ((1.0 - 3.0 * a * a) * m0 + (3.0 * b * b - 1.0) * m1);
        (value, slope)
    }
}

/// Solves a diagonally dominant cyclic tridiagonal system: Thomas' algorithm with the corner entries by Sherman–Morrison.
fn solve_cyclic(below: &[f64], diagonal: &[f64], above: &[f64], right: &[f64]) -> Vec<f64> {
    let n = diagonal.len();
    let gamma = -diagonal[0];
    let (corner_low, corner_high) = (above[n - 1], below[0]);
    let mut main = diagonal.to_vec();
    main[0] -= gamma;
    main[n - 1] -= corner_low * corner_high / gamma;
    let solve = |rhs: &[f64]| {
        let mut upper = vec![0.0; n];
        let mut x = vec![0.0; n];
        upper[0] = above[0] / main[0];
        x[0] = rhs[0] / main[0];
        for j in 1..n {
            let pivot = main[j] - below[j] * upper[j - 1];
            upper[j] = if j + 1 < n { above[j] / pivot } else { 0.0 };
            x[j] = (rhs[j] - below[j] * x[j - 1]) / pivot;
        }
        for j in (0..n - 1).rev() {
            x[j] -= upper[j] * x[j + 1];
        }
        x
    };
    let x = solve(right);
    let mut corner = vec![0.0; n];
    corner[0] = gamma;
    corner[n - 1] = corner_low;
    let z = solve(&corner);
    let factor = (x[0] + corner_high * x[n - 1] / gamma) / (1.0 + z[0] + corner_high * z[n - 1] / gamma);
    x.iter().zip(&z).map(|(x, z)| x - factor * z).collect()
}

/// Centre distance at which a driver of radius r1(θ1) turns its mate `closure` times a turn, in the radius' unit:
/// (1/2π) ∮ r1/(a − r1) dθ1 = closure. The integral falls from large to 0 as a grows from the largest radius on.
pub(crate) fn closing_distance(knots_rad: &[f64], closure: f64, radius: impl Fn(f64) -> f64) -> Option<f64> {
    let samples = quadrature(knots_rad, &radius);
    let largest = samples.iter().fold(0.0_f64, |largest, (_, radius)| largest.max(*radius));
    let turns = |distance: f64| samples.iter().map(|(weight, r)| weight * r / (distance - r)).sum::<f64>() / TAU;
    let mean = samples.iter().map(|(weight, r)| weight * r).sum::<f64>() / TAU;
    // Jensen: at the mean radius' own distance the convex integrand already turns further, so the root lies above.
    let mut low = f64::max(mean * (1.0 + 1.0 / closure), largest * (1.0 + 1e-9)) - 1e-12 * mean;
    let mut high = 2.0 * low;
    if low <= largest || turns(low.max(largest * (1.0 + 1e-9))) < closure * (1.0 - 1e-9) {
        return None;
    }
    while turns(high) > closure {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if turns(middle) > closure {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}

/// Weights (rad) and values of a composite five-point Gauss rule over a turn, its cells ending at the knots.
fn quadrature(knots_rad: &[f64], function: &impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    const NODES: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let mut edges: Vec<f64> = (0..=1024).map(|n| TAU * f64::from(n) / 1024.0).collect();
    edges.extend(knots_rad.iter().map(|knot| knot.rem_euclid(TAU)));
    edges.sort_by(f64::total_cmp);
    edges
        .windows(2)
        .flat_map(|edge| {
            let half = 0.5 * (edge[1] - edge[0]);
            let middle = 0.5 * (edge[0] + edge[1]);
            NODES.map(|(t, weight)| (weight * half, function(middle + t * half)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spline_follows_a_smooth_function_and_passes_its_points() {
        let function = |x: f64| 2.0 + x.sin() + 0.2 * (2.0 * x).cos();
        let knots: Vec<f64> = (0..60).map(|j| 0.2 + TAU * (f64::from(j) + 0.2 * f64::from(j).sin()) / 60.0).collect();
        let values: Vec<f64> = knots.iter().map(|x| function(*x)).collect();
        let spline = Spline::new(&knots, &values);
        for (knot, value) in knots.iter().zip(&values) {
            assert!((spline.at(*knot).0 - value).abs() < 1e-14);
        }
        for step in -50..50 {
            let x = 0.29 * f64::from(step);
            let (value, slope) = spline.at(x);
            assert!((value - function(x)).abs() < 1e-5);
            assert!((slope - (x.cos() - 0.4 * (2.0 * x).sin())).abs() < 1e-3);
        }
    }

    #[test]
    fn closing_distance_of_an_ellipse_is_two_semi_major_axes() {
        let k = 0.5;
        let distance = closing_distance(&[], 1.0, |x| (1.0 - k * k) / (1.0 - k * x.cos())).unwrap();
        assert!((distance - 2.0).abs() < 1e-12, "{distance}");
    }
}
