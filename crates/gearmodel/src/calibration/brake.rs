//! The brake's torque over its coil current, both branches, from the servo's torque.
//!
//! Over a whole turn the work put in is the work taken out: ∮T1 dθ1 = ∮T2 dθ2 + friction, whatever the ratio does on the way. At constant
//! current T2 is constant, so the mean of T1 over θ1 is T2 times the mean ratio, plus friction. The same turn without current gives friction
//! and drag; the difference is the brake's own torque, and its drag is stated from its maker or from a turn without the brake.

use super::{COVERAGE, CalibrationError};

/// Mean torque over whole turns at one current.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueReading {
    /// Coil current, A.
    pub current_a: f64,
    /// Mean torque at the driver shaft, N·m.
    pub torque_nm: f64,
    /// Standard deviation of the means of single turns, N·m; of one turn 0.
    pub scatter_nm: f64,
    /// Turns averaged.
    pub turns: u32,
    /// Half of what the torque swings within a turn, N·m: the more steps of its resolution it passes, the better their rounding averages out.
    pub swing_nm: f64,
}

/// One way up and down: currents rise from 0 to the largest and fall back to 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Readings in order; the first and the last without current.
    pub readings: Vec<TorqueReading>,
}

/// What is known from elsewhere, with its expanded uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stated {
    /// Torque without current at the brake's shaft, N·m.
    pub drag_nm: f64,
    /// Its uncertainty, N·m.
    pub drag_uncertainty_nm: f64,
    /// Uncertainty of the servo's torque in parts of it: of the motor's torque constant, mostly.
    pub torque_uncertainty_ratio: f64,
    /// Resolution of the servo's torque at the driver shaft, N·m.
    pub resolution_nm: f64,
    /// Mean turns of the driven gear a turn of the driver.
    pub mean_ratio: f64,
    /// Brake turns a turn of the driven gear.
    pub step_up: f64,
}

/// A point of a branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrakePoint {
    /// Coil current, A.
    pub current_a: f64,
    /// Torque at the brake's shaft, N·m.
    pub torque_nm: f64,
    /// Its expanded uncertainty, N·m.
    pub uncertainty_nm: f64,
}

/// Both branches, by rising current.
#[derive(Debug, Clone, PartialEq)]
pub struct BrakeCurves {
    /// While the current rises from 0.
    pub rising: Vec<BrakePoint>,
    /// While it falls from the largest current of the sweep.
    pub falling: Vec<BrakePoint>,
}

/// The curves from sweeps over the same currents.
///
/// # Errors
/// A sweep lacks its ends, or a branch does not rise with the current.
pub fn brake_curves(sweeps: &[Sweep], stated: &Stated) -> Result<BrakeCurves, CalibrationError> {
    let (mut rising, mut falling): (Vec<Vec<TorqueReading>>, Vec<Vec<TorqueReading>>) = (Vec::new(), Vec::new());
    for sweep in sweeps {
        let [first, .., last] = &sweep.readings[..] else {
            return Err(CalibrationError::Baseline { found: sweep.readings.len() });
        };
        if first.current_a != 0.0 || last.current_a != 0.0 {
            return Err(CalibrationError::Baseline { found: 1 });
        }
        let count = sweep.readings.len() as f64 - 1.0;
        // Friction drifts as the rig warms up: what is taken off lies on the line between both ends.
        let level = |n: usize| first.torque_nm + (last.torque_nm - first.torque_nm) * n as f64 / count;
        let own = |(n, reading): (usize, &TorqueReading)| TorqueReading {
            torque_nm: reading.torque_nm - level(n),
            ..*reading
        };
        let top = sweep
            .readings
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.current_a.total_cmp(&b.1.current_a))
            .map_or(0, |(n, _)| n);
        let all: Vec<TorqueReading> = sweep.readings.iter().enumerate().map(own).collect();
        rising.push(all[..=top].to_vec());
        falling.push(all[top..].iter().rev().copied().collect());
    }
    Ok(BrakeCurves { rising: branch("rising", &rising, stated)?, falling: branch("falling", &falling, stated)? })
}

fn branch(
    name: &'static str,
    sweeps: &[Vec<TorqueReading>],
    stated: &Stated,
) -> Result<Vec<BrakePoint>, CalibrationError> {
    let length = sweeps.iter().map(Vec::len).min().unwrap_or(0);
    let points: Vec<BrakePoint> = (0..length).map(|n| point(sweeps, n, stated)).collect();
    for pair in points.windows(2) {
        if pair[1].torque_nm <= pair[0].torque_nm || pair[1].current_a <= pair[0].current_a {
            return Err(CalibrationError::NotRising {
                branch: name,
                from_a: pair[0].current_a,
                to_a: pair[1].current_a,
                from_nm: pair[0].torque_nm,
                to_nm: pair[1].torque_nm,
            });
        }
    }
    Ok(points)
}

fn point(sweeps: &[Vec<TorqueReading>], n: usize, stated: &Stated) -> BrakePoint {
    let readings: Vec<TorqueReading> = sweeps.iter().map(|sweep| sweep[n]).collect();
    let count = readings.len() as f64;
    let mean = |of: fn(&TorqueReading) -> f64| readings.iter().map(of).sum::<f64>() / count;
    let driver_nm = mean(|reading| reading.torque_nm);
    let per_driver = 1.0 / (stated.mean_ratio * stated.step_up);
    let own_nm = driver_nm * per_driver;
    // Scatter of turns within a reading, and of the readings of several sweeps; of either, the larger tells more.
    let within =
        readings.iter().map(|r| r.scatter_nm.powi(2) / f64::from(r.turns.max(1))).sum::<f64>() / (count * count);
    let between = if readings.len() > 1 {
        readings.iter().map(|r| (r.torque_nm - driver_nm).powi(2)).sum::<f64>() / (count - 1.0) / count
    } else {
        0.0
    };
    // The difference of two readings: the point's own and the level without current.
    let scatter_nm = (2.0 * within.max(between)).sqrt() * per_driver.abs();
    // What rounding leaves in the mean of a torque that swings: see `rounding_nm`. The level without current has its own, common to all.
    let rounded = |pick: fn(&[TorqueReading], usize) -> TorqueReading| {
        let worst = sweeps.iter().map(|sweep| pick(sweep, n).swing_nm).fold(f64::INFINITY, f64::min);
        rounding_nm(stated.resolution_nm, worst)
    };
    let rounding_nm =
        if n == 0 { 0.0 } else { rounded(|sweep, n| sweep[n]).hypot(rounded(|sweep, _| sweep[0])) * per_driver.abs() };
    let scale_nm = stated.torque_uncertainty_ratio / COVERAGE * own_nm;
    let drag_nm = stated.drag_uncertainty_nm / COVERAGE;
    let standard = (scatter_nm.powi(2) + rounding_nm.powi(2) + scale_nm.powi(2) + drag_nm.powi(2)).sqrt();
    BrakePoint {
        current_a: mean(|reading| reading.current_a),
        torque_nm: stated.drag_nm + own_nm,
        uncertainty_nm: COVERAGE * standard,
    }
}

/// Standard deviation of what rounding to steps leaves in the mean of a torque that swings by ±A. For a sine the mean of the rounded value is off by a
/// series whose first term is (step/π) J0(2πA/step) at most, and J0(x) < √(2/(πx)) for large x. The torque of a non-circular pair dwells longer at
/// its ends than a sine, so that the amplitude of this term is taken as the deviation, not its part by √2.
fn rounding_nm(step_nm: f64, swing_nm: f64) -> f64 {
    use std::f64::consts::PI;
    if step_nm <= 0.0 {
        return 0.0;
    }
    let bessel = (step_nm / (PI * PI * swing_nm.max(f64::MIN_POSITIVE))).sqrt().min(1.0);
    step_nm / PI * bessel
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATED: Stated = Stated {
        drag_nm: 0.3,
        drag_uncertainty_nm: 0.05,
        torque_uncertainty_ratio: 0.0,
        resolution_nm: 0.0,
        mean_ratio: 1.0,
        step_up: 1.0,
    };

    /// Up and down over 0, 0.5 and 1 A with 10 N·m/A, 1 N·m more on the way down, on friction of 2 N·m that grows.
    fn sweep(noise_nm: f64) -> Sweep {
        let torque = [0.0, 5.0, 10.0, 6.0, 0.0];
        let readings =
            [0.0, 0.5, 1.0, 0.5, 0.0].into_iter().zip(torque).enumerate().map(|(n, (current_a, torque_nm))| {
                let noise = if n % 2 == 0 { 0.0 } else { noise_nm };
                TorqueReading {
                    current_a,
                    torque_nm: torque_nm + 2.0 + 0.1 * n as f64 + noise,
                    scatter_nm: 0.02,
                    turns: 4,
                    swing_nm: 1.0,
                }
            });
        Sweep { readings: readings.collect() }
    }

    #[test]
    fn both_branches_come_out_above_drag_and_beside_friction() {
        let curves = brake_curves(&[sweep(0.0)], &STATED).unwrap();
        for (points, expected) in [(&curves.rising, [0.3, 5.3, 10.3]), (&curves.falling, [0.3, 6.3, 10.3])] {
            assert_eq!(points.len(), 3);
            let near = points.iter().zip(expected).all(|(point, torque)| (point.torque_nm - torque).abs() < 1e-9);
            assert!(near, "{points:?}");
        }
        assert!((curves.rising[1].uncertainty_nm - 0.0574).abs() < 1e-3, "{}", curves.rising[1].uncertainty_nm);
        // A brake behind a step-up turns faster and has less torque.
        let geared = brake_curves(&[sweep(0.0)], &Stated { step_up: 2.0, ..STATED }).unwrap();
        assert!((geared.rising[2].torque_nm - 5.3).abs() < 1e-9);
    }

    #[test]
    fn what_scatters_between_sweeps_and_what_is_not_known_widen_the_uncertainty() {
        let one = brake_curves(&[sweep(0.0), sweep(0.0)], &STATED).unwrap().rising[1].uncertainty_nm;
        let scattered = brake_curves(&[sweep(0.0), sweep(0.5)], &STATED).unwrap().rising[1].uncertainty_nm;
        assert!(scattered > 5.0 * one, "{one} {scattered}");
        let vague = Stated { torque_uncertainty_ratio: 0.05, ..STATED };
        let top = brake_curves(&[sweep(0.0)], &vague).unwrap().rising[2].uncertainty_nm;
        assert!((top - (0.5f64.powi(2) + 0.0574f64.powi(2)).sqrt()).abs() < 1e-2, "{top}");
    }

    #[test]
    fn rounding_counts_for_less_the_more_steps_the_torque_passes() {
        // A torque that stands still may be off by half a step, and no better is promised.
        assert!(rounding_nm(0.5, 0.0) > 0.2 * 0.5);
        assert!(rounding_nm(0.5, 10.0) < 0.1 * rounding_nm(0.5, 0.0));
        assert_eq!(rounding_nm(0.0, 1.0), 0.0);
        // Against rounded sines themselves: never beyond two standard deviations by more than a little.
        for (number, swing) in [0.1f64, 0.3, 0.7, 1.3, 2.9].into_iter().enumerate() {
            let worst = (0..50)
                .map(|n| {
                    let level = 0.01 * f64::from(n) + 0.001 * number as f64;
                    let sine = |k: u32| level + swing * (f64::from(k) * 0.001 * std::f64::consts::TAU).sin();
                    let mean: f64 = (0..1000).map(|k| (sine(k) / 0.5).round() * 0.5).sum::<f64>() / 1000.0;
                    (mean - level).abs()
                })
                .fold(0.0, f64::max);
            assert!(worst < 2.0 * rounding_nm(0.5, swing), "{swing}: {worst}");
        }
    }

    #[test]
    fn sweeps_without_ends_and_branches_that_fall_are_refused() {
        let mut cut = sweep(0.0);
        cut.readings.pop();
        assert!(matches!(brake_curves(&[cut], &STATED), Err(CalibrationError::Baseline { .. })));
        let mut falling = sweep(0.0);
        falling.readings[1].torque_nm = 30.0;
        let said = brake_curves(&[falling], &STATED).unwrap_err().to_string();
        assert!(said.contains("rising") && said.contains("0.5 A"), "{said}");
    }
}
