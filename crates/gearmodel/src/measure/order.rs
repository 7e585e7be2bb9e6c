//! Orders of a curve over one turn of θ1.

use nalgebra::{DMatrix, DVector};

use serde::{Deserialize, Serialize};

use super::grid::{AngleGrid, Curve};

/// One order of a curve over θ1: amplitude·cos(order·θ1 − phase).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// Periods a turn of the driver.
    pub order: u32,
    /// Amplitude, rad, ≥ 0.
    pub amplitude_rad: f64,
    /// Phase, rad, in (−π, π].
    pub phase_rad: f64,
}

impl Order {
    /// Orders 1 to `highest` of a curve by least squares over the bins that were seen, which is the Fourier series where
    /// all were. Empty where fewer bins were seen than the fit has unknowns, or where they do not fix it.
    #[must_use]
    pub fn of(grid: AngleGrid, curve: &Curve, highest: u32) -> Vec<Self> {
        let unknowns = 1 + 2 * highest as usize;
        let seen: Vec<(f64, f64)> =
            grid.centres().zip(curve.values_rad.iter().copied()).filter(|(_, value)| value.is_finite()).collect();
        if seen.len() < unknowns {
            return Vec::new();
        }
        // Normal equations: the basis is orthogonal on a full turn, so they are as good as it gets there.
        let mut normal = DMatrix::<f64>::zeros(unknowns, unknowns);
        let mut right = DVector::<f64>::zeros(unknowns);
        for (theta1_rad, value) in &seen {
            let mut row = DVector::<f64>::zeros(unknowns);
            row[0] = 1.0;
            for order in 1..=highest {
                let (sin, cos) = (f64::from(order) * theta1_rad).sin_cos();
                let column = 2 * order as usize - 1;
                row[column] = cos;
                row[column + 1] = sin;
            }
            normal.ger(1.0, &row, &row, 1.0);
            right.axpy(*value, &row, 1.0);
        }
        let Some(solution) = normal.cholesky().map(|factors| factors.solve(&right)) else {
            return Vec::new();
        };
        (1..=highest)
            .map(|order| {
                let column = 2 * order as usize - 1;
                let (cos, sin) = (solution[column], solution[column + 1]);
                Self { order, amplitude_rad: cos.hypot(sin), phase_rad: sin.atan2(cos) }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_of_a_known_curve_with_and_without_gaps() {
        let grid = AngleGrid::default();
        let mut curve = Curve::from_fn(grid, |theta| 5.0 + 3.0 * (theta - 0.4).cos() + 0.5 * (3.0 * theta + 1.0).cos());
        for gap in [0, 100] {
            curve.values_rad[..gap].fill(f64::NAN);
            let orders = Order::of(grid, &curve, 4);
            assert_eq!(orders.len(), 4);
            let expected = [(3.0, 0.4), (0.0, 0.0), (0.5, -1.0), (0.0, 0.0)];
            for (order, (amplitude, phase)) in orders.iter().zip(expected) {
                assert!((order.amplitude_rad - amplitude).abs() < 1e-9);
                assert!(amplitude == 0.0 || (order.phase_rad - phase).abs() < 1e-9);
            }
        }
        curve.values_rad[8..].fill(f64::NAN);
        assert!(Order::of(grid, &curve, 4).is_empty());
    }
}
