//! Tones in time, looked for in what differs between revolutions of one condition, and taken off the points.

use nalgebra::{Cholesky, SMatrix, SVector};
use rayon::prelude::*;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

use super::grid::Grid;
use super::reduce::{Point, ReducedRun};
use super::settings::{Settings, ToneSettings};
use super::waves::{WAVES, waves};
use gearmodel::effect::NominalRig;

/// Frequencies of the search for tones.
const TONE_STEPS: usize = 1 << 17;

/// A tone in time.
#[derive(Clone, Copy, Debug)]
pub struct Tone {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, rad.
    pub amplitude_rad: f64,
}

/// Finds tones in what differs between revolutions of a condition, and takes them off the points. With them the grid of what is
/// left.
pub fn take_off(rig: &NominalRig, runs: &mut [ReducedRun], mut grid: Grid, settings: &Settings) -> (Vec<Tone>, Grid) {
    let own = &settings.tones;
    let mut tones = Vec::new();
    for band in [Band::High, Band::Low] {
        while tones.len() < own.most
            && let Some(frequency_hz) = strongest_tone(&grid, runs, band, own)
            && let Some(tone) = take_off_tone(runs, &grid, frequency_hz, band, own)
        {
            tones.push(tone);
            grid = Grid::new(rig, runs, settings);
        }
    }
    (tones, grid)
}

/// Where tones are looked for. Below a few turns' frequency a tone looks like the waves that scatter from revolution to revolution:
/// there they must not be taken off, and a line must stand the more out of them.
#[derive(Clone, Copy, PartialEq)]
enum Band {
    High,
    Low,
}

impl Band {
    /// Its limits in turns' frequencies.
    fn turns(self, settings: &ToneSettings) -> [f64; 2] {
        match self {
            Self::High => [settings.high_turns, f64::INFINITY],
            Self::Low => [settings.low_turns, settings.high_turns],
        }
    }

    fn least_nats(self, settings: &ToneSettings) -> f64 {
        match self {
            Self::High => settings.high_nats,
            Self::Low => settings.low_nats,
        }
    }
}

/// Values at the points detrended of what goes with the angle and, in the high band, is a slow wave of a revolution.
fn detrended(grid: &Grid, runs: &[ReducedRun], band: Band, value: &dyn Fn(&Point) -> f64) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); grid.places.len()];
    let each = || runs.iter().zip(&grid.place_of_point).flat_map(|(run, places)| run.points.iter().zip(places));
    for (point, place) in each() {
        sums[*place].0 += point.samples * value(point);
        sums[*place].1 += point.samples;
    }
    let means: Vec<f64> = sums.iter().map(|(sum, weight)| sum / weight.max(f64::MIN_POSITIVE)).collect();
    let residual = incoherent(grid, band, &means);
    each().map(|(point, place)| value(point) - means[*place] + residual[*place]).collect()
}

fn strongest_tone(grid: &Grid, runs: &[ReducedRun], band: Band, settings: &ToneSettings) -> Option<f64> {
    let duration_s = grid.plan.duration_s;
    if grid.revolutions.len() < 2 || duration_s <= 0.0 {
        return None;
    }
    let values = detrended(grid, runs, band, &|point| point.rho_rad);
    let points: Vec<&Point> = runs.iter().flat_map(|run| &run.points).collect();
    let start_s = points.iter().map(|p| p.time_s).fold(f64::INFINITY, f64::min);
    let step_s = duration_s / (TONE_STEPS as f64 - 1.0);
    let mut series = vec![Complex::new(0.0, 0.0); 2 * TONE_STEPS];
    let mut power = 0.0;
    for (point, value) in points.iter().zip(&values) {
        series[((point.time_s - start_s) / step_s) as usize].re += point.samples * value;
        power += point.samples * point.samples * value * value;
    }
    FftPlanner::new().plan_fft_forward(series.len()).process(&mut series);
    // Above half the points' rate all is mirrored.
    let turn_hz = grid.plan.speeds_rad_per_s.last().copied().unwrap_or(0.0) / TAU;
    let bins_per_hz = 2.0 * duration_s;
    let [low, high] = band.turns(settings).map(|turns| turns * turn_hz * bins_per_hz);
    let first = low.ceil().max(2.0 * settings.neighbours as f64) as usize;
    let mut gaps_s: Vec<f64> = points.windows(2).map(|w| w[1].time_s - w[0].time_s).collect();
    gaps_s.sort_by(f64::total_cmp);
    let gap_s = gaps_s.get(gaps_s.len() / 2).copied()?;
    let last =
        ((settings.highest_of_rate / gap_s * bins_per_hz).min(high) as usize).min(TONE_STEPS - 2 * settings.neighbours);
    let size: Vec<f64> = series[..TONE_STEPS].iter().map(|x| x.norm_sqr() / power).collect();
    let peak = (first..last).max_by(|a, b| size[*a].total_cmp(&size[*b]))?;
    // A tone is a line: it stands out of its neighbours too, which the broad spectrum of a step or a knock does not.
    let about = size[peak - settings.neighbours..peak - 4].iter().chain(&size[peak + 5..peak + settings.neighbours]);
    let level = about.sum::<f64>() / (2 * settings.neighbours - 9) as f64;
    let level = if band == Band::High { level.max(1.0) } else { level };
    let nats = size[peak] / level - (points.len() as f64).ln();
    (nats > band.least_nats(settings)).then_some(peak as f64 / bins_per_hz)
}

/// Refines the frequency, fits the tone and subtracts it; `None` where it is too small to matter.
fn take_off_tone(
    runs: &mut [ReducedRun],
    grid: &Grid,
    frequency_hz: f64,
    band: Band,
    settings: &ToneSettings,
) -> Option<Tone> {
    let values = detrended(grid, runs, band, &|point| point.rho_rad);
    let points: Vec<Point> = runs.iter().flat_map(|run| &run.points).copied().collect();
    let start_s = points.first()?.time_s;
    let explained = |frequency_hz: f64| {
        let (mut of_sin, mut of_cos) = (0.0, 0.0);
        for (point, value) in points.iter().zip(&values) {
            let (sin, cos) = (TAU * frequency_hz * (point.time_s - start_s)).sin_cos();
            of_sin += point.samples * value * sin;
            of_cos += point.samples * value * cos;
        }
        of_sin * of_sin + of_cos * of_cos
    };
    let mut centre_hz = frequency_hz;
    let mut width_hz = 0.5 / grid.plan.duration_s;
    for _ in 0..7 {
        centre_hz = [-1.0, -0.5, 0.0, 0.5, 1.0]
            .into_iter()
            .map(|part| (centre_hz + part * width_hz, explained(centre_hz + part * width_hz)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?
            .0;
        width_hz *= 0.5;
    }
    // The tone's own waves lose to the angle what the residual lost: both are detrended alike before the fit.
    let phase = |point: &Point| TAU * centre_hz * (point.time_s - start_s);
    let sines = detrended(grid, runs, band, &|point| phase(point).sin());
    let cosines = detrended(grid, runs, band, &|point| phase(point).cos());
    let mut normal = nalgebra::Matrix2::zeros();
    let mut right = nalgebra::Vector2::zeros();
    let mut square = 0.0;
    for ((point, value), (sin, cos)) in points.iter().zip(&values).zip(sines.iter().zip(&cosines)) {
        let x = nalgebra::Vector2::new(*sin, *cos);
        normal += point.samples * x * x.transpose();
        right += point.samples * *value * x;
        square += point.samples * value * value;
    }
    let beta = normal.try_inverse()? * right;
    if right.dot(&beta) < settings.least_share * square {
        return None;
    }
    for point in runs.iter_mut().flat_map(|run| &mut run.points) {
        let (sin, cos) = phase(point).sin_cos();
        point.rho_rad -= beta[0] * sin + beta[1] * cos;
    }
    Some(Tone { frequency_hz: centre_hz, amplitude_rad: beta.norm() })
}

/// Values of every place less their cell's mean over the revolutions and, in the high band, the revolution's own waves.
fn incoherent(grid: &Grid, band: Band, values: &[f64]) -> Vec<f64> {
    let mut means = vec![(0.0, 0.0); grid.cells.len()];
    for (place, cell) in grid.cell_of.iter().enumerate() {
        means[*cell].0 += grid.weight[place] * values[place];
        means[*cell].1 += grid.weight[place];
    }
    let several = grid.cells.len() < grid.places.len();
    let mut rest: Vec<f64> = (0..grid.places.len())
        .map(|place| {
            let (sum, weight) = means[grid.cell_of[place]];
            values[place] - if several { sum / weight } else { 0.0 }
        })
        .collect();
    if band == Band::Low {
        return rest;
    }
    let detrended: Vec<Vec<f64>> = grid
        .revolutions
        .par_iter()
        .map(|revolution| {
            let places = revolution.places.clone();
            let at: Vec<_> = places
                .clone()
                .map(|place| {
                    let part = grid.part_of_cell[grid.cell_of[place]];
                    SVector::<f64, WAVES>::from(waves(grid.places[place].theta1_rad, part))
                })
                .collect();
            let mut normal = SMatrix::<f64, WAVES, WAVES>::zeros();
            let mut right = SVector::<f64, WAVES>::zeros();
            for (z, place) in at.iter().zip(places.clone()) {
                normal.ger(grid.weight[place], z, z, 1.0);
                right.axpy(grid.weight[place] * rest[place], z, 1.0);
            }
            // A short segment does not fix its waves: a little of nothing is added.
            let ridge = 1e-6 * normal.diagonal().max();
            for k in 0..WAVES {
                normal[(k, k)] += ridge;
            }
            let u = Cholesky::new(normal).map_or_else(SVector::zeros, |cholesky| cholesky.solve(&right));
            at.iter().zip(&rest[places]).map(|(z, rest)| rest - z.dot(&u)).collect()
        })
        .collect();
    // Revolutions stand one after the other.
    rest.splice(.., detrended.into_iter().flatten());
    rest
}
