//! The encoders' own grain: counts a revolution from the angles' steps, lines from the residual's spectrum over the angle.

use std::f64::consts::TAU;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::nominal::Nominal;
use super::settings::LineSettings;
use gearmodel::Direction;
use gearmodel::recording::Recording;

/// Cells a turn of the search for lines: lines up to half of that are seen.
const CELLS: usize = 1 << 18;
/// Most lines that are looked for: above, a wave is seen too badly.
const MOST_LINES: usize = CELLS / 3;

/// The detrended residual by the angle of each encoder.
struct Folded {
    /// Sums of what the encoder would have to read wrongly, by cell of its turn.
    series: [Vec<Complex<f64>>; 2],
    /// Samples by cell.
    seen_at: [Vec<Complex<f64>>; 2],
    /// Sums of squares.
    power: [f64; 2],
}

impl Folded {
    fn add(&mut self, part: &Recording<'_>, nominal: &Nominal, settings: &LineSettings) {
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
            let off = |other: usize| (theta1_rad - columns.theta1_rad[seen[other]]).abs();
            while off(low) > settings.window_rad && low + settings.window_samples < at {
                low += 1;
            }
            while high + 1 < seen.len() && (off(high) < settings.window_rad || high < at + settings.window_samples) {
                high += 1;
            }
            let deviation = rho[at] - (sums[high + 1] - sums[low]) / (high + 1 - low) as f64;
            for (encoder, (angle_rad, gain)) in
                [(theta1_rad, -pair.ratio(theta1_rad)), (columns.theta2_rad[*n], 1.0)].into_iter().enumerate()
            {
                let cell = ((angle_rad / TAU).rem_euclid(1.0) * CELLS as f64) as usize % CELLS;
                self.series[encoder][cell].re += gain * deviation;
                self.seen_at[encoder][cell].re += 1.0;
                self.power[encoder] += gain * gain * deviation * deviation;
            }
        }
    }
}

/// Lines of the input and output encoder where the samples show a wave of their period; `known` are left as they are.
#[must_use]
pub fn search_lines(
    parts: &[Recording<'_>],
    nominal: &Nominal,
    known: [Option<f64>; 2],
    settings: &LineSettings,
) -> [Option<f64>; 2] {
    let lines_looked_for = settings.fewest..MOST_LINES;
    if known.iter().all(Option::is_some) {
        return known;
    }
    let mut folded = Folded {
        series: [vec![Complex::new(0.0, 0.0); CELLS], vec![Complex::new(0.0, 0.0); CELLS]],
        seen_at: [vec![Complex::new(0.0, 0.0); CELLS], vec![Complex::new(0.0, 0.0); CELLS]],
        power: [0.0; 2],
    };
    parts.iter().for_each(|part| folded.add(part, nominal, settings));
    let Folded { series, seen_at, power } = folded;
    let transform = FftPlanner::new().plan_fft_forward(CELLS);
    // Samples in step with one of the angles show every low order again at high ones: only what stands alone is a disc's line then.
    let in_step = seen_at.into_iter().any(|mut places| {
        let samples: f64 = places.iter().map(|x| x.re).sum();
        transform.process(&mut places);
        let line = places[lines_looked_for.start / 4..CELLS / 2].iter().map(|x| x.norm()).fold(0.0, f64::max);
        line > settings.in_step * samples
    });
    let mut lines = known;
    for (encoder, mut values) in series.into_iter().enumerate() {
        if known[encoder].is_some() || power[encoder] <= 0.0 {
            continue;
        }
        transform.process(&mut values);
        let nats = |order: usize| values[order].norm_sqr() / power[encoder] - (lines_looked_for.len() as f64).ln();
        let strongest =
            lines_looked_for.clone().max_by(|a, b| nats(*a).total_cmp(&nats(*b))).unwrap_or(lines_looked_for.start);
        let harmonic = |order: usize| order.is_multiple_of(strongest) || strongest.is_multiple_of(order);
        let apart = |order: &usize| order.abs_diff(strongest) > settings.beside && !harmonic(*order);
        let alone = || {
            lines_looked_for
                .clone()
                .filter(apart)
                .all(|order| values[order].norm_sqr() < settings.alone * values[strongest].norm_sqr())
        };
        if nats(strongest) > settings.found_nats && (!in_step || alone()) {
            // A wave of order 2 of the line may be the stronger one.
            let half = strongest / 2;
            let of_half = strongest % 2 == 0 && half >= lines_looked_for.start && nats(half) > 0.0;
            lines[encoder] = Some(if of_half { half } else { strongest } as f64);
        }
    }
    lines
}

/// Counts a revolution of an angle that is read in whole counts; `None` where its steps have no common measure.
#[must_use]
pub fn counts_per_rev(theta_rad: &[f64], settings: &LineSettings) -> Option<f64> {
    let steps: Vec<f64> = theta_rad
        .windows(2)
        .take(settings.counts_looked_at)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|step| step.is_finite() && *step > 1e-10)
        .collect();
    if steps.len() < settings.counts_fewest {
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
    (off < settings.counts_off && count_rad > 1e-8 && counts > 10.0).then_some(counts)
}
