//! The encoders' own grain: counts a revolution from the angles' steps.

use std::f64::consts::TAU;

/// Angles looked at.
const LOOKED_AT: usize = 4000;

/// Counts a revolution of an angle that is read in whole counts; `None` where its steps have no common measure.
#[must_use]
pub fn counts_per_rev(theta_rad: &[f64]) -> Option<f64> {
    let steps: Vec<f64> = theta_rad
        .windows(2)
        .take(LOOKED_AT)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|step| step.is_finite() && *step > 1e-10)
        .collect();
    if steps.len() < 20 {
        return None;
    }
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    // Differences between neighbouring sizes of steps are multiples of a count too, and smaller.
    let gap = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|d| *d > 1e-9).fold(sorted[0], f64::min);
    let mut count_rad = gap;
    for _ in 0..4 {
        let (mut top, mut bottom) = (0.0, 0.0);
        for step in &steps {
            let n = (step / count_rad).round();
            top += step * n;
            bottom += n * n;
        }
        count_rad = top / bottom;
    }
    let off = steps.iter().map(|step| (step / count_rad - (step / count_rad).round()).abs()).fold(0.0, f64::max);
    let counts = (TAU / count_rad).round();
    // A measure that nearly every step misses is none; a count under 1e-8 rad is rounding.
    (off < 0.1 && count_rad > 1e-8 && counts > 10.0).then_some(counts)
}
