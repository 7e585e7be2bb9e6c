//! Estimates of the noise against draws of known variance. With u_n the waves fitted to a revolution of N bins,
//!
//! ```text
//! σ² from places of neighbouring revolutions, freed of waves:  E = σ² (1 − 17/N), for 17 are fitted
//! λ_n = ½ ⟨(u_n,r+1 − u_n,r)²⟩ − σ²/W:                         E = λ_n
//! κ where the evidence is largest:                             ⟨log p(y | κ)⟩ ≤ ⟨log p(y | κ true)⟩
//! floor = Σ_n m_n λ_n (1 + κ_n),  m_n waves of order n:        ⟨w y²⟩/⟨w⟩ = floor + σ² places/W
//! ```
//!
//! Means of draws are compared to five of their standard errors.

use super::support::{
    Dense, ORDERS, Random, STEADY, TRUTH, Truth, covariance, draw, estimate, full, grid, kind_of_wave, mean_and_error,
    pool, rig, two_runs, uneven, waves_at_places, with_scatter,
};
use crate::cross_validation::HeldOut;
use crate::evidence;
use crate::grid::Grid;
use crate::noise::Noise;
use gearmodel::Direction::{Ccw, Cw};
use nalgebra::DVector;

/// Standard errors that a mean may be off.
const SIGMAS: f64 = 5.0;

fn estimates(grid: &Grid, truth: &Truth, draws: usize, seed: u64) -> Vec<Noise> {
    let mut random = Random::new(seed);
    (0..draws)
        .map(|_| {
            let mut grid = grid.clone();
            grid.rho_rad = draw(&grid, truth, &mut random);
            estimate(&grid)
        })
        .collect()
}

fn mean_of(noises: &[Noise], of: impl Fn(&Noise) -> f64) -> (f64, f64) {
    mean_and_error(&noises.iter().map(of).collect::<Vec<_>>())
}

#[test]
fn white_noise_and_the_orders_scatter_come_out_as_drawn() {
    let bins = 60;
    let rig = rig();
    for (turns, draws, seed) in [(4, 600, 1), (10, 300, 13)] {
        let grid = grid(&rig, &[full(Ccw, 5.0, turns, bins), full(Cw, 5.0, turns, bins)], bins, |_| 3.0);
        let noises = estimates(&grid, &TRUTH, draws, seed);
        let (white, error) = mean_of(&noises, |noise| noise.white_rad2);
        // Every place counts alike, and of N values a fit of 17 waves leaves N − 17 free.
        let left = 1.0 - STEADY as f64 / bins as f64;
        let right = TRUTH.white_rad2 * left;
        assert!((white - right).abs() < SIGMAS * error, "σ²: {white:e} {right:e} ± {error:e}");
        let differences = turns - 1;
        for n in 0..=ORDERS {
            let (found, error) = mean_of(&noises, |noise| noise.order_rad2[n]);
            // The mean of the level's differences is taken off. Of d differences of d + 1 levels, each of which
            // stands in two of them, that leaves 1 − 1/d² of their square; of independent ones it would leave 1 −
            // 1/d. What is divided by lies between the two.
            let most = if n == 0 { 1.0 + 1.0 / differences as f64 } else { 1.0 };
            // And the part of σ²/W that the fits took, as above.
            let of_white = TRUTH.white_rad2 / (3.0 * bins as f64) * (1.0 - left);
            let right = TRUTH.order_rad2[n];
            let range = right - SIGMAS * error..right * most + of_white + SIGMAS * error;
            assert!(range.contains(&found), "order {n}: {found:e} of {right:e} ± {error:e}");
            assert!(error < 0.07 * right, "order {n}: ± {error:e} proves nothing");
        }
        assert!(noises.iter().all(|noise| noise.freedom == (2 * differences * STEADY) as f64));
    }
}

/// What a run adds to all of its revolutions is none of their scatter, nor is what the condition does.
#[test]
fn levels_of_runs_are_not_taken_for_scatter_between_revolutions() {
    let bins = 60;
    let grid = grid(&rig(), &[full(Ccw, 5.0, 4, bins), full(Cw, 15.0, 4, bins)], bins, |_| 3.0);
    let quiet = estimates(&grid, &Truth { run_ratio: [0.0, 0.0], ..TRUTH }, 150, 2);
    let loud = estimates(&grid, &Truth { run_ratio: [1e4, 1e4], ..TRUTH }, 150, 3);
    for n in 0..=ORDERS {
        let ((a, da), (b, db)) =
            (mean_of(&quiet, |noise| noise.order_rad2[n]), mean_of(&loud, |noise| noise.order_rad2[n]));
        assert!((a - b).abs() < SIGMAS * da.hypot(db), "order {n}: {a:e} {b:e}");
    }
}

/// A level that drifts evenly is no scatter.
#[test]
fn an_even_drift_is_taken_off_the_level() {
    let bins = 60;
    let mut grid = grid(&rig(), &[full(Ccw, 5.0, 8, bins)], bins, |_| 3.0);
    grid.rho_rad = draw(&grid, &TRUTH, &mut Random::new(4));
    let of = |grid: &Grid| estimate(grid).order_rad2[0];
    let still = of(&grid);
    let revolutions = super::support::revolution_of_place(&grid);
    grid.rho_rad.iter_mut().zip(revolutions).for_each(|(rho, revolution)| *rho += 3e-4 * revolution as f64);
    // The fits of a revolution lose ε of 2e-3 rad; the squares of the differences about 1e-5 rad.
    assert!((of(&grid) / still - 1.0).abs() < 1e-9);
}

/// One large step among many differences: twice the square by the median bounds what it makes of the scatter.
#[test]
fn one_jump_does_not_make_the_scatter() {
    let bins = 60;
    let grid = grid(&rig(), &[full(Ccw, 5.0, 20, bins)], bins, |_| 3.0);
    let mut random = Random::new(5);
    let mut ratios = Vec::new();
    for _ in 0..50 {
        let mut grid = grid.clone();
        grid.rho_rad = draw(&grid, &TRUTH, &mut random);
        let later = grid.revolutions[10].places.start;
        grid.rho_rad[later..].iter_mut().for_each(|rho| *rho += 1e-3);
        ratios.push(estimate(&grid).order_rad2[0] / TRUTH.order_rad2[0]);
    }
    let (mean, error) = mean_and_error(&ratios);
    // The mean of the 19 differences, 1e-3/19, is taken off all: (53 µrad)² beside 2 · (10 µrad)² moves the median to
    // about (53 µrad)²/0.4549, and twice that, halved, is what is left: 62 λ. Unguarded it would be 1e-6/(2 · 19) =
    // 263 λ.
    assert!(mean + SIGMAS * error < 90.0, "{mean} ± {error}");
}

#[test]
fn without_scatter_or_with_one_revolution_something_is_assumed() {
    let rig = rig();
    let bins = 120;
    // Nothing at all.
    let still = grid(&rig, &[full(Ccw, 5.0, 3, bins)], bins, |_| 2.0);
    let noise = estimate(&still);
    assert!(noise.white_rad2 > 0.0 && noise.white_rad2 <= 1e-18, "{:e}", noise.white_rad2);
    assert!(noise.order_rad2.iter().take(ORDERS + 1).all(|v| *v > 0.0 && *v <= 1e-15), "{:?}", noise.order_rad2);
    // White alone: a mean over draws at or above nothing, and no more than what its own error makes of it.
    let only_white = Truth { order_rad2: [0.0; ORDERS + 1], ..TRUTH };
    let noises = estimates(&still, &only_white, 100, 6);
    let of_white = TRUTH.white_rad2 / (2.0 * bins as f64);
    for n in 0..=ORDERS {
        // ½d² has mean and deviation of about σ²/W; what is left of it above nothing is less than that.
        let (found, error) = mean_of(&noises, |noise| noise.order_rad2[n]);
        assert!(found < of_white + SIGMAS * error + 1e-15, "order {n}: {found:e} {of_white:e}");
    }
    // One revolution: white noise from neighbouring places, the scatter assumed as white noise in a tenth of a turn.
    let once = grid(&rig, &[full(Ccw, 5.0, 1, 720)], 720, |_| 2.0);
    let noises = estimates(&once, &only_white, 100, 7);
    let (white, error) = mean_of(&noises, |noise| noise.white_rad2);
    assert!((white - TRUTH.white_rad2).abs() < SIGMAS * error, "{white:e} ± {error:e}");
    for noise in &noises {
        assert_eq!(noise.freedom, 0.0);
        for n in 0..=ORDERS {
            let right = 10.0 * noise.white_rad2 / 1440.0 / (1.0 + n as f64);
            assert!((noise.order_rad2[n] / right - 1.0).abs() < 1e-12);
        }
    }
    // Low orders are smooth over three of 720 bins: e − ½(e₋ + e₊) of order n is 1 − cos 2πn/720 of its size.
    let (white, error) = mean_of(&estimates(&once, &TRUTH, 100, 8), |noise| noise.white_rad2);
    let seen: f64 = (1..=ORDERS)
        .map(|n| 2.0 * TRUTH.order_rad2[n] * 1.3 * (1.0 - (std::f64::consts::TAU * n as f64 / 720.0).cos()).powi(2))
        .sum();
    let right = TRUTH.white_rad2 + seen * 2.0 / 1.5;
    assert!((white - right).abs() < SIGMAS * error, "{white:e} {right:e} ± {error:e}");
}

/// Scatter between runs is weighed by the evidence, the noise of revolutions given: summed over draws it is largest
/// at the truth, and every one of them is a normal density.
#[test]
fn the_ratio_of_runs_to_revolutions_is_the_likeliest_where_it_was_drawn() {
    let bins = 24;
    let rig = rig();
    let runs: Vec<_> = (0..8).map(|n| full([Ccw, Cw][n % 2], 5.0, 2, bins)).collect();
    let (mut grid, mut noise) = with_scatter(grid(&rig, &runs, bins, uneven), 9);
    let mut random = Random::new(10);
    let ratios = [0.02, 0.3, 3.0];
    for (level, waves) in [(0.02, 0.3), (3.0, 0.3), (0.3, 3.0)] {
        // Draws of V itself: L times white noise.
        let l = Dense::new(covariance(&grid, &noise, [level, waves])).cholesky.l();
        let mut sums = vec![0.0; 9];
        for _ in 0..60 {
            let white = DVector::from_fn(grid.places.len(), |_, _| random.normal());
            grid.rho_rad = (&l * white).iter().copied().collect();
            let pool = pool(&rig, &grid, &[]);
            let within = noise.within_runs(&grid, &pool, Some(&[0, 1]));
            let fit = evidence::fit(&pool, &within.between_runs([1.0, 0.3]), &[], &[]).unwrap();
            for (n, sum) in sums.iter_mut().enumerate() {
                *sum += evidence::at_scales(&pool, &within.between_runs([ratios[n / 3], ratios[n % 3]]), &fit);
            }
        }
        let best = (0..9).max_by(|a, b| sums[*a].total_cmp(&sums[*b])).unwrap();
        assert_eq!((ratios[best / 3], ratios[best % 3]), (level, waves), "{sums:?}");
    }
    // One draw against the dense matrix at every ratio.
    let pool = pool(&rig, &grid, &[]);
    let y = super::support::residual(&grid);
    let fit = evidence::fit(&pool, &noise.whiten(&grid, &pool), &[], &[]).unwrap();
    for level in ratios {
        for waves in ratios {
            noise.run_ratio = [level, waves];
            let right = Dense::new(covariance(&grid, &noise, [level, waves])).log_normal_with_zero(&y);
            let found = evidence::at_scales(&pool, &noise.whiten(&grid, &pool), &fit);
            assert!((found - right).abs() < 1e-6, "{level} {waves}: {found} {right}");
        }
    }
}

/// The floor is the mean square of what does not repeat: the trace of V over the samples, without the ramps, which
/// tell how levels pass on and not how much there is of them.
#[test]
fn the_floor_is_the_trace_of_the_covariance() {
    let rig = rig();
    let bins = 48;
    let even = grid(&rig, &[full(Ccw, 5.0, 3, bins), full(Cw, 5.0, 2, bins)], bins, |_| 3.0);
    // Waves have unit RMS over whole turns of even weight only; elsewhere the floor is that of whole turns.
    for (grid, tolerance) in [(even, 1e-9), (two_runs(&rig), 0.2)] {
        let (grid, mut noise) = with_scatter(grid, 12);
        noise.run_ratio = [2.0, 0.4];
        let z = waves_at_places(&grid);
        let total: f64 = grid.weight.iter().sum();
        let trace: f64 = (0..grid.places.len())
            .map(|n| {
                let low: f64 = (0..STEADY)
                    .map(|w| {
                        let ratio = noise.run_ratio[usize::from(w > 0)];
                        (1.0 + ratio) * noise.order_rad2[kind_of_wave(w)] * z[n][w].powi(2)
                    })
                    .sum();
                noise.white_rad2 + grid.weight[n] * low
            })
            .sum();
        let pool = pool(&rig, &grid, &[]);
        let found = HeldOut::new(&grid, &pool, &noise, &[1]).floor_rad2(&grid, &noise);
        assert!((found * total / trace - 1.0).abs() < tolerance, "{found:e} {:e}", trace / total);
        let waves_only = noise.floor_rad2();
        let white = noise.white_rad2 * grid.places.len() as f64 / total;
        assert!((waves_only + white - found).abs() < 1e-12 * found);
    }
}
