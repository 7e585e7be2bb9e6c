//! A periodic function as Chebyshev series on panels: value, derivatives and integral to rounding.

use std::f64::consts::{PI, TAU};

/// Nodes a panel. Sixteen settle a panel of a smooth pitch curve in one or two halvings.
const NODES: usize = 16;
/// Halvings of a first panel before it is taken as it is (a kink inside it is then confined to a 65 536th).
const MAX_HALVINGS: u32 = 16;

/// One panel's series in t ∈ [−1, 1].
#[derive(Clone, Debug, PartialEq)]
struct Panel {
    start_rad: f64,
    half_width_rad: f64,
    value: [f64; NODES],
    slope: [f64; NODES],
    curvature: [f64; NODES],
    /// Integral from the panel's start.
    integral: [f64; NODES + 1],
    /// Integral from θ = 0 to the panel's start.
    before: f64,
}

/// A function of period 2π.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PanelSeries {
    starts_rad: Vec<f64>,
    panels: Vec<Panel>,
    /// Integral over a turn.
    total: f64,
}

impl PanelSeries {
    /// Fits `function` on [0, 2π], smooth between the `knots_rad` (inside the turn, any order).
    pub(super) fn fit(knots_rad: &[f64], function: impl Fn(f64) -> f64) -> Self {
        let mut edges: Vec<f64> = (0..=16).map(|n| TAU * f64::from(n) / 16.0).collect();
        edges.extend(knots_rad.iter().map(|knot| knot.rem_euclid(TAU)));
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        if let Some(last) = edges.last_mut() {
            *last = TAU;
        }
        let mut panels = Vec::new();
        for edge in edges.windows(2) {
            fit_panel(&mut panels, edge[0], edge[1], &function, 0);
        }
        let mut total = 0.0;
        for panel in &mut panels {
            panel.before = total;
            total += clenshaw(&panel.integral, 1.0);
        }
        Self { starts_rad: panels.iter().map(|panel| panel.start_rad).collect(), panels, total }
    }

    /// The function multiplied by a constant.
    pub(super) fn scaled(mut self, factor: f64) -> Self {
        for panel in &mut self.panels {
            let all =
                panel.value.iter_mut().chain(&mut panel.slope).chain(&mut panel.curvature).chain(&mut panel.integral);
            all.for_each(|coefficient| *coefficient *= factor);
            panel.before *= factor;
        }
        self.total *= factor;
        self
    }

    /// Integral over a turn.
    pub(super) fn total(&self) -> f64 {
        self.total
    }

    /// Turns before θ, the panel of θ, and t in it.
    #[inline]
    fn locate(&self, theta_rad: f64) -> (f64, &Panel, f64) {
        let turns = (theta_rad / TAU).floor();
        let within = theta_rad - turns * TAU;
        let index = self.starts_rad.partition_point(|start| *start <= within).saturating_sub(1);
        let panel = &self.panels[index];
        (turns, panel, (within - panel.start_rad) / panel.half_width_rad - 1.0)
    }

    /// The function at θ.
    #[inline]
    pub(super) fn value(&self, theta_rad: f64) -> f64 {
        let (_, panel, t) = self.locate(theta_rad);
        clenshaw(&panel.value, t)
    }

    /// Value and first derivative at θ.
    #[inline]
    pub(super) fn value_and_slope(&self, theta_rad: f64) -> (f64, f64) {
        let (_, panel, t) = self.locate(theta_rad);
        (clenshaw(&panel.value, t), clenshaw(&panel.slope, t))
    }

    /// Second derivative at θ.
    #[inline]
    pub(super) fn curvature(&self, theta_rad: f64) -> f64 {
        let (_, panel, t) = self.locate(theta_rad);
        clenshaw(&panel.curvature, t)
    }

    /// Integral from 0 to θ, unwrapped.
    #[inline]
    pub(super) fn integral(&self, theta_rad: f64) -> f64 {
        let (turns, panel, t) = self.locate(theta_rad);
        turns * self.total + (panel.before + clenshaw(&panel.integral, t))
    }

    /// θ at which the integral of this positive function is `target`.
    pub(super) fn integral_inverse(&self, target: f64) -> f64 {
        let turns = (target / self.total).floor();
        let within = target - turns * self.total;
        let index = self.panels.partition_point(|panel| panel.before <= within).saturating_sub(1);
        let panel = &self.panels[index];
        let (mut low, mut high) = (-1.0, 1.0);
        let mut t = 0.0;
        for _ in 0..80 {
            let error = panel.before + clenshaw(&panel.integral, t) - within;
            if error > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let next = t - error / (clenshaw(&panel.value, t) * panel.half_width_rad);
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - t).abs() < 1e-16 {
                break;
            }
            t = next;
        }
        turns * TAU + panel.start_rad + (t + 1.0) * panel.half_width_rad
    }
}

/// Fits one panel, or its halves where the series has not settled.
fn fit_panel(panels: &mut Vec<Panel>, start: f64, end: f64, function: &impl Fn(f64) -> f64, halvings: u32) {
    let half_width_rad = 0.5 * (end - start);
    let values: [f64; NODES] = std::array::from_fn(|j| {
        let t = -(PI * (j as f64 + 0.5) / NODES as f64).cos();
        function(start + (t + 1.0) * half_width_rad)
    });
    // t_j = −cos(π(j + ½)/N), so T_k(t_j) = (−1)^k cos(kπ(j + ½)/N)
    let value: [f64; NODES] = std::array::from_fn(|k| {
        let sum: f64 = values
            .iter()
            .enumerate()
            .map(|(j, value)| value * (PI * k as f64 * (j as f64 + 0.5) / NODES as f64).cos())
            .sum();
        let weight = if k == 0 { 1.0 } else { 2.0 };
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        sign * weight * sum / NODES as f64
    });
    let size = values.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    let tail = value[NODES - 3..].iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    if tail > 4e-16 * size && halvings < MAX_HALVINGS && half_width_rad > 1e-5 {
        let middle = start + half_width_rad;
        fit_panel(panels, start, middle, function, halvings + 1);
        fit_panel(panels, middle, end, function, halvings + 1);
        return;
    }
    let slope = derivative(&value, half_width_rad);
    let curvature = derivative(&slope, half_width_rad);
    // ∫ T_k: C_k = (c_{k−1} − c_{k+1})/(2k) with c_0 counted twice
    let at = |k: usize| if k == 0 { 2.0 * value[0] } else { value.get(k).copied().unwrap_or(0.0) };
    let mut integral: [f64; NODES + 1] =
        std::array::from_fn(|k| if k == 0 { 0.0 } else { half_width_rad * (at(k - 1) - at(k + 1)) / (2.0 * k as f64) });
    integral[0] = -clenshaw(&integral, -1.0);
    panels.push(Panel { start_rad: start, half_width_rad, value, slope, curvature, integral, before: 0.0 });
}

/// Coefficients of the derivative: d_{k−1} = d_{k+1} + 2k c_k.
fn derivative(coefficients: &[f64; NODES], half_width_rad: f64) -> [f64; NODES] {
    let mut result = [0.0; NODES];
    for k in (1..NODES).rev() {
        let above = result.get(k + 1).copied().unwrap_or(0.0);
        result[k - 1] = above + 2.0 * k as f64 * coefficients[k];
    }
    result[0] *= 0.5;
    result.map(|coefficient| coefficient / half_width_rad)
}

/// Σ c_k T_k(t).
#[inline]
fn clenshaw(coefficients: &[f64], t: f64) -> f64 {
    let (mut b1, mut b2) = (0.0, 0.0);
    for &coefficient in coefficients.iter().skip(1).rev() {
        (b1, b2) = (coefficient + 2.0 * t * b1 - b2, b1);
    }
    coefficients[0] + t * b1 - b2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_function_with_its_derivatives_and_integral() {
        let series = PanelSeries::fit(&[0.3, 5.0], |x| 2.0 + (3.0 * x).sin() + 0.3 * (x - 1.0).cos());
        for step in -40..40 {
            let x = 0.31 * f64::from(step);
            let (value, slope) = series.value_and_slope(x);
            assert!((value - (2.0 + (3.0 * x).sin() + 0.3 * (x - 1.0).cos())).abs() < 1e-13);
            assert!((slope - (3.0 * (3.0 * x).cos() - 0.3 * (x - 1.0).sin())).abs() < 1e-11);
            assert!((series.curvature(x) + 9.0 * (3.0 * x).sin() + 0.3 * (x - 1.0).cos()).abs() < 1e-8);
            let integral = 2.0 * x + (1.0 - (3.0 * x).cos()) / 3.0 + 0.3 * ((x - 1.0).sin() + 1.0_f64.sin());
            assert!((series.integral(x) - integral).abs() < 3e-14 * (1.0 + x.abs()), "{x}");
            assert!((series.integral_inverse(integral) - x).abs() < 1e-13 * (1.0 + x.abs()), "{x}");
        }
    }
}
