//! The encoders' own grain: counts a revolution from the angles' steps, lines from the residual's spectrum over the angle.

use std::f64::consts::TAU;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::nominal::Nominal;
use gearmodel::Direction;
use gearmodel::recording::Recording;

/// Cells a turn of the search for lines: lines up to half of that are seen.
const CELLS: usize = 1 << 18;
/// Fewest and most lines looked for; teeth and their harmonics lie below.
const LINES: std::ops::Range<usize> = 700..CELLS / 3;
/// Log odds, over all lines looked for, from which a peak is taken for a disc's lines.
const FOUND_NATS: f64 = 7.0;
/// Samples are in step with the angle where their own spectrum has a line of this part of its sum.
const IN_STEP: f64 = 0.15;
/// A line stands alone where no other is more than this part of its power, its harmonics and its foot left out.
const ALONE: f64 = 0.1;
const BESIDE: usize = 20;
/// The residual is freed of its mean over this part of a turn, or over so many samples where they are sparse.
const WINDOW_RAD: f64 = TAU / 360.0;
const WINDOW_SAMPLES: usize = 4;

/// Lines of the input and output encoder where the samples show a wave of their period; `known` are left as they are.
#[must_use]
pub fn search_lines(parts: &[Recording<'_>], nominal: &Nominal, known: [Option<f64>; 2]) -> [Option<f64>; 2] {
    if known.iter().all(Option::is_some) {
        return known;
    }
    let mut series = [vec![Complex::new(0.0, 0.0); CELLS], vec![Complex::new(0.0, 0.0); CELLS]];
    let mut seen_at = series.clone();
    let mut power = [0.0; 2];
    for part in parts {
        let columns = part.columns();
        let load_nm = columns.load_nm.mean();
        let direction = columns.direction.unwrap_or(Direction::Ccw);
        let pair = nominal.rig().pair();
        let seen: Vec<usize> = (0..part.samples())
            .filter(|n| columns.theta1_rad[*n].is_finite() && columns.theta2_rad[*n].is_finite())
            .collect();
        let mut sums = vec![0.0];
        let mut rho = Vec::with_capacity(seen.len());
        for n in &seen {
            let theta1_rad = columns.theta1_rad[*n];
            let te_rad =
                columns.theta2_rad[*n] - pair.theta2(theta1_rad) - nominal.te_rad(theta1_rad, direction, load_nm);
            rho.push(te_rad);
            sums.push(sums[rho.len() - 1] + te_rad);
        }
        let (mut low, mut high) = (0, 0);
        for (at, n) in seen.iter().enumerate() {
            let theta1_rad = columns.theta1_rad[*n];
            while (theta1_rad - columns.theta1_rad[seen[low]]).abs() > WINDOW_RAD && low + WINDOW_SAMPLES < at {
                low += 1;
            }
            while high + 1 < seen.len()
                && ((columns.theta1_rad[seen[high]] - theta1_rad).abs() < WINDOW_RAD || high < at + WINDOW_SAMPLES)
            {
                high += 1;
            }
            let deviation = rho[at] - (sums[high + 1] - sums[low]) / (high + 1 - low) as f64;
            for (encoder, (angle_rad, gain)) in
                [(theta1_rad, -pair.ratio(theta1_rad)), (columns.theta2_rad[*n], 1.0)].into_iter().enumerate()
            {
                let cell = ((angle_rad / TAU).rem_euclid(1.0) * CELLS as f64) as usize % CELLS;
                series[encoder][cell].re += gain * deviation;
                seen_at[encoder][cell].re += 1.0;
                power[encoder] += gain * gain * deviation * deviation;
            }
        }
    }
    let transform = FftPlanner::new().plan_fft_forward(CELLS);
    // Samples in step with one of the angles show every low order again at high ones: only what stands alone is a disc's line then.
    let in_step = seen_at.into_iter().any(|mut places| {
        let samples: f64 = places.iter().map(|x| x.re).sum();
        transform.process(&mut places);
        let line = places[LINES.start / 4..CELLS / 2].iter().map(|x| x.norm()).fold(0.0, f64::max);
        line > IN_STEP * samples
    });
    let mut lines = known;
    for (encoder, mut values) in series.into_iter().enumerate() {
        if known[encoder].is_some() || power[encoder] <= 0.0 {
            continue;
        }
        transform.process(&mut values);
        let nats = |order: usize| values[order].norm_sqr() / power[encoder] - (LINES.len() as f64).ln();
        let strongest = LINES.max_by(|a, b| nats(*a).total_cmp(&nats(*b))).unwrap_or(LINES.start);
        let harmonic = |order: usize| order.is_multiple_of(strongest) || strongest.is_multiple_of(order);
        let apart = |order: &usize| order.abs_diff(strongest) > BESIDE && !harmonic(*order);
        let alone = || LINES.filter(apart).all(|order| values[order].norm_sqr() < ALONE * values[strongest].norm_sqr());
        if nats(strongest) > FOUND_NATS && (!in_step || alone()) {
            // A wave of order 2 of the line may be the stronger one.
            let half = strongest / 2;
            let of_half = strongest % 2 == 0 && half >= LINES.start && nats(half) > 0.0;
            lines[encoder] = Some(if of_half { half } else { strongest } as f64);
        }
    }
    lines
}

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
