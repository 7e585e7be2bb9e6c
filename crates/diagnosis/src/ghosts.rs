//! Ghost orders: lines in the spectrum over a shaft's angle above the orders that every fit tries, as a grinding wheel, a coupling's
//! screws or a converter's bit leave them.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

use super::grid::Grid;
use super::noise::Noise;
use super::nuisance_patterns::{Pattern, Weight};
use super::settings::{GhostSettings, Settings};
use gearmodel::effect::{OperatingPoint, Shaft};

/// Bins of a turn, over which the residual is transformed.
const BINS: usize = 1024;

/// Patterns of the lines that stand out of a residual.
#[must_use]
pub fn find(grid: &Grid, noise: &Noise, rest: &[f64], settings: &Settings) -> Vec<Pattern> {
    let own = &settings.ghosts;
    let mut patterns = Vec::new();
    for (shaft, turns) in [Shaft::Input, Shaft::Output].into_iter().zip(grid.plan.turns) {
        if turns < 1.0 {
            continue;
        }
        let spectra: Vec<Spectrum> = [1.0, -1.0]
            .into_iter()
            .filter_map(|sense| Spectrum::new(grid, rest, shaft, &|at| at.sense * sense > 0.0, own.highest))
            .collect();
        let mut lines: Vec<(usize, f64)> =
            spectra.iter().flat_map(|s| s.lines(noise.white_rad2, settings.nuisance.highest_order, own)).collect();
        lines.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut orders: Vec<usize> = Vec::new();
        let mut sizes: Vec<f64> = Vec::new();
        for (order, nats) in lines {
            // The samples are not spread evenly over the turn: a strong line leaks into others.
            let leaks = orders.first().zip(sizes.first()).is_some_and(|(strongest, size): (&usize, &f64)| {
                !order.is_multiple_of(*strongest) && nats.sqrt() < own.leaks * size
            });
            if !leaks && !orders.contains(&order) && orders.len() < own.most {
                orders.push(order);
                sizes.push(nats.sqrt());
            }
        }
        let parities: &[bool] = if grid.plan.senses == [true, true] { &[false, true] } else { &[false] };
        if orders.len() > 1 {
            patterns.extend(parities.iter().map(|&odd| Pattern::Comb {
                shaft,
                orders: orders.clone(),
                sizes: sizes.clone(),
                odd,
            }));
        }
        for order in orders {
            patterns.extend(parities.iter().map(|&odd| Pattern::Order {
                shaft,
                order: order as f64,
                odd,
                weight: Weight::One,
                mean: 1.0,
            }));
        }
    }
    patterns
}

/// Spectrum over a turn of a shaft.
struct Spectrum {
    amplitudes: Vec<f64>,
    samples: f64,
}

impl Spectrum {
    /// Of the places that count; `None` where they leave much of the turn out.
    fn new(
        grid: &Grid,
        rest: &[f64],
        shaft: Shaft,
        counts: &dyn Fn(&OperatingPoint) -> bool,
        highest: usize,
    ) -> Option<Self> {
        let mut sums = vec![(0.0, 0.0); BINS];
        for ((at, y), w) in grid.places.iter().zip(rest).zip(&grid.weight).filter(|((at, _), _)| counts(at)) {
            let bin = ((at.angle_rad(shaft) / TAU).rem_euclid(1.0) * BINS as f64) as usize;
            let sum = &mut sums[bin.min(BINS - 1)];
            sum.0 += w * y;
            sum.1 += w;
        }
        let samples: f64 = sums.iter().map(|s| s.1).sum();
        let empty = sums.iter().filter(|s| s.1 == 0.0).count();
        if samples == 0.0 || empty * 2 > BINS {
            return None;
        }
        // An empty bin reads as the last one that is not.
        let mut last = sums.iter().rev().find(|s| s.1 > 0.0).map_or(0.0, |s| s.0 / s.1);
        let mut turn: Vec<Complex<f64>> = sums
            .iter()
            .map(|(sum, weight)| {
                if *weight > 0.0 {
                    last = sum / weight;
                }
                Complex::new(last, 0.0)
            })
            .collect();
        FftPlanner::new().plan_fft_forward(BINS).process(&mut turn);
        Some(Self { amplitudes: turn[..=highest].iter().map(|x| 2.0 * x.norm() / BINS as f64).collect(), samples })
    }

    /// Orders that stand out, with their evidence in nats.
    fn lines(&self, white_rad2: f64, above: usize, own: &GhostSettings) -> Vec<(usize, f64)> {
        (above + 1..=own.highest - own.neighbours)
            .filter_map(|order| {
                let mut about: Vec<f64> = (order - own.neighbours..=order + own.neighbours)
                    .filter(|n| n.abs_diff(order) > 1)
                    .map(|n| self.amplitudes[n])
                    .collect();
                about.sort_by(f64::total_cmp);
                let amplitude = self.amplitudes[order];
                let nats = amplitude * amplitude * self.samples / (4.0 * white_rad2);
                (nats > own.least_nats && amplitude > own.outstanding * about[about.len() / 2]).then_some((order, nats))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spectrum(line: f64, scatter: f64) -> Vec<usize> {
        let own = GhostSettings::default();
        let mut amplitudes: Vec<f64> =
            (0..=own.highest).map(|n| scatter * (1.0 + 0.5 * (1.3 * n as f64).sin())).collect();
        amplitudes[60] = line;
        Spectrum { amplitudes, samples: 1e5 }.lines(1e-10, 8, &own).into_iter().map(|(order, _)| order).collect()
    }

    #[test]
    fn a_line_stands_out_of_its_neighbours_and_of_the_noise() {
        assert_eq!(spectrum(3e-6, 1e-7), [60]);
        // As broad as displaced teeth make it.
        assert!(spectrum(3e-6, 2e-6).is_empty());
        // Under the white noise: 1e5 samples of 10 urad.
        assert!(spectrum(1e-7, 1e-9).is_empty());
    }
}
