//! Events against brute force: a step stands where Σ w (y − c − Δ·[t ≥ t₀])² with c and Δ free is least over all t₀;
//! a tone where the periodogram of what differs between revolutions is largest. Taking the mean over R turns off the
//! residual leaves 1 − |D|² of a tone of φ cycles beyond a whole number a turn, D the Dirichlet kernel of R; where φ
//! is a multiple of 1/R that is flat, and the periodogram's maximum is the least-squares frequency.

use std::f64::consts::TAU;

use gearmodel::Direction::Ccw;

use super::support::{Random, binned, estimate, full, grid, pool, rig};
use crate::reduce::{Point, ReducedRun};
use crate::settings::Settings;
use crate::{steps, tones};

#[test]
fn a_step_stands_where_it_takes_most_off_the_squares() {
    let rig = rig();
    let bins = 120;
    let mut random = Random::new(71);
    for (place, size_rad) in [(307, 20e-6), (514, -35e-6), (640, 60e-6)] {
        let mut grid = grid(&rig, &[full(Ccw, 5.0, 8, bins)], bins, |_| 2.0);
        for (n, rho) in grid.rho_rad.iter_mut().enumerate() {
            *rho = 1e-6 * random.normal() + if n >= place { size_rad } else { 0.0 };
        }
        // A step of 20 of its own standard deviations a place: no other edge comes near.
        let y = &grid.rho_rad;
        let squares = |from: usize| {
            [&y[..from], &y[from..]]
                .iter()
                .map(|part| {
                    let mean = part.iter().sum::<f64>() / part.len() as f64;
                    part.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
                })
                .sum::<f64>()
        };
        let best = (1..y.len()).min_by(|a, b| squares(*a).total_cmp(&squares(*b))).unwrap();
        let right_s = 0.5 * (grid.places[best - 1].time_s + grid.places[best].time_s);
        let pool = pool(&rig, &grid, &[]);
        let noise = estimate(&grid);
        let settings = Settings::default();
        let found = steps::find(&grid, &pool, &noise, &[], &[], &settings.steps);
        let single = found.times_s.iter().find(|times| times.len() == 1);
        assert!(single.is_some_and(|times| (times[0] - right_s).abs() < 1e-9), "{right_s}: {:?}", found.times_s);
        // Moved from elsewhere it comes back.
        let settled = steps::settle(&grid, &noise, &grid.rho_rad, &[right_s - 7.0], Some(size_rad), &settings.steps);
        assert!((settled[0] - right_s).abs() < 1e-9, "{right_s}: {settled:?}");
    }
}

#[test]
fn a_tone_has_the_frequency_of_the_periodogram_s_maximum() {
    let rig = rig();
    let (turns, points_per_turn, turn_s) = (6, 720, 10.0);
    let mut random = Random::new(72);
    // 27 3/6 and 51 2/6 cycles a turn.
    for frequency_hz in [2.75, 5.133_333_333] {
        let (amplitude_rad, white_rad) = (8e-6, 2e-6);
        let points: Vec<Point> = (0..turns * points_per_turn)
            .map(|n| {
                let turn = (n as f64 + 0.5) / points_per_turn as f64;
                let theta1_rad = TAU * turn;
                let time_s = turn_s * turn;
                let repeats = 50e-6 * (3.0 * theta1_rad).cos();
                Point {
                    time_s,
                    theta1_rad,
                    theta2_rad: rig.pair().theta2(theta1_rad),
                    rho_rad: repeats
                        + amplitude_rad * (TAU * frequency_hz * time_s).sin()
                        + white_rad * random.normal(),
                    load_nm: 5.0,
                    samples: 1.0,
                    ..Point::default()
                }
            })
            .collect();
        // The periodogram of what is left of the mean over the turns, in steps of a five-hundredth of what the
        // duration tells apart.
        let left: Vec<f64> = (0..points.len())
            .map(|n| {
                let same = (0..turns).map(|turn| points[turn * points_per_turn + n % points_per_turn].rho_rad);
                points[n].rho_rad - same.sum::<f64>() / turns as f64
            })
            .collect();
        let power = |f: f64| {
            let (sin, cos) = points.iter().zip(&left).fold((0.0, 0.0), |(s, c), (p, y)| {
                let (sin, cos) = (TAU * f * p.time_s).sin_cos();
                (s + y * sin, c + y * cos)
            });
            sin * sin + cos * cos
        };
        let duration_s = turn_s * turns as f64;
        let step_hz = 0.002 / duration_s;
        let coarse = (0..600).map(|n| 2.0 + f64::from(n) * 0.4 / duration_s);
        let peak = coarse.max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap();
        let fine = (-250..=250).map(|n| peak + f64::from(n) * step_hz);
        let right_hz = fine.max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap();
        let mut runs =
            [ReducedRun { direction: Ccw, speed_rpm: 6.0, samples: points.len() as f64, points, within_rad2: 0.0 }];
        let grid = binned(&rig, &runs);
        let (tones, _) = tones::take_off(&rig, &mut runs, grid, &Settings::default());
        assert_eq!(tones.len(), 1, "{tones:?}");
        // Halved seven times from half a resolution, it stands within 1/256 of one; the waves of each revolution
        // taken off before move the maximum by less than the bound of Cramér and Rao, √(6/N) σ/(π T A), of which five
        // are allowed.
        let n = (turns * points_per_turn) as f64;
        let bound_hz = (6.0 / n).sqrt() * white_rad / (std::f64::consts::PI * duration_s * amplitude_rad);
        let tolerance = 1.0 / 256.0 / duration_s + step_hz + 5.0 * bound_hz;
        assert!(
            (tones[0].frequency_hz - right_hz).abs() < tolerance,
            "{} {right_hz} ± {tolerance}",
            tones[0].frequency_hz
        );
        assert!((tones[0].frequency_hz - frequency_hz).abs() < tolerance);
        // √(2/N) σ is the amplitude's own error.
        assert!((tones[0].amplitude_rad - amplitude_rad).abs() < 5.0 * (2.0 / n).sqrt() * white_rad * 1.3);
    }
}
