//! Errors of an encoder's disc from runs between which it was turned on its shaft.
//!
//! The disc's error turns with it, everything else stays. With the disc at φm, TE in bin b of one sense, load and speed is
//!
//! y = S(b) + c_m [+ d_m i(b)] + g(b) Σ_h [ s_h sin h(θ(b) − φm) + k_h cos h(θ(b) − φm) ],
//!
//! S whatever gears, shafts and the other encoder do; c_m the zero of mounting m; θ = θ2, g = 1 for the output encoder; θ = θ1, g = −i for the
//! input encoder (the ratio i carries its error into f), whose mounting is off by a little, too: d_m. S is eliminated by the mean over the
//! mountings: M equal divisions leave all orders but the multiples of M (equal-division averaging; R. Probst, "Self-calibration of divided
//! circles on the basis of a prime factor algorithm", Meas. Sci. Technol. 19 (2008) 015101, states the principle).

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::{COVERAGE, CalibrationError, grid_of};
use crate::effect::Shaft;
use crate::measure::Curve;
use crate::pair::GearPair;

/// Least part of a turn that all runs share.
const FEWEST_BINS: usize = 90;
/// Eigenvalues below this part of the largest belong to what the mountings cannot tell.
const UNTOLD: f64 = 1e-9;

/// A run with the disc at one place.
#[derive(Debug, Clone, PartialEq)]
pub struct MountedRun {
    /// How far the disc is turned on its shaft against its usual place, in the angle's positive sense, rad.
    pub mounting_rad: f64,
    /// Runs of the same sense, load and speed have the same number.
    pub group: usize,
    /// TE of each revolution over θ1, rad.
    pub revolutions: Vec<Curve>,
}

/// The disc's error of one order: it reads θ + eps sin(hθ − phase).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderError {
    /// h, periods a turn.
    pub order: u32,
    /// Amplitude, rad.
    pub eps_rad: f64,
    /// Phase with the disc in its usual place, rad.
    pub phase_rad: f64,
    /// Expanded uncertainty of the amplitude, and of the error at any angle, rad.
    pub uncertainty_rad: f64,
}

/// What was found of one encoder.
#[derive(Debug, Clone, PartialEq)]
pub struct EncoderErrors {
    /// Orders that the mountings tell.
    pub orders: Vec<OrderError>,
    /// Orders that they do not: multiples of the number of equal divisions.
    pub untold: Vec<u32>,
    /// What is left of the differences between mountings, RMS, rad.
    pub residual_rms_rad: f64,
    /// Different mountings.
    pub mountings: usize,
}

/// The errors of `shaft`'s encoder up to order `highest`.
///
/// # Errors
/// Too few mountings, or no run that was repeated at another one.
pub fn encoder_errors(
    shaft: Shaft,
    pair: &GearPair,
    runs: &[MountedRun],
    highest: u32,
) -> Result<EncoderErrors, CalibrationError> {
    let encoder = if shaft == Shaft::Input { "input" } else { "output" };
    let mountings = distinct(runs.iter().map(|run| run.mounting_rad));
    if mountings < 2 {
        return Err(CalibrationError::Mountings { encoder, found: mountings });
    }
    let compared: Vec<&MountedRun> = runs
        .iter()
        .filter(|run| {
            distinct(runs.iter().filter(|other| other.group == run.group).map(|other| other.mounting_rad)) > 1
        })
        .filter(|run| !run.revolutions.is_empty())
        .collect();
    let revolutions = compared.iter().map(|run| run.revolutions.len()).min().ok_or(CalibrationError::NoGroup)?;
    let design = Design::new(shaft, pair, &compared, highest)?;
    let means: Vec<Vec<f64>> = compared.iter().map(|run| mean(&run.revolutions)).collect();
    let whole = design.fit(&means)?;
    // Each revolution by itself: what it scatters is what does not repeat with the turn.
    let single: Vec<DVector<f64>> = (0..revolutions)
        .map(|n| design.fit(&compared.iter().map(|run| run.revolutions[n].values_rad.clone()).collect::<Vec<_>>()))
        .map(|fit| fit.map(|fit| fit.amplitudes))
        .collect::<Result<_, _>>()?;
    let mut orders = Vec::new();
    let mut untold = Vec::new();
    for order in 1..=highest {
        let at = 2 * (order as usize - 1);
        if whole.untold[at] || whole.untold[at + 1] {
            untold.push(order);
            continue;
        }
        let (sin, cos) = (whole.amplitudes[at], whole.amplitudes[at + 1]);
        let scatter = scatter_of_mean(single.iter().map(|one| (one[at], one[at + 1])));
        // What differs from mounting to mounting and is no error of the disc, by the size that it has at low orders.
        let between = whole.low_order_rad / ((compared.len() as f64 - 1.0).max(1.0)).sqrt();
        orders.push(OrderError {
            order,
            // s sin + k cos = eps sin(hθ − phase): s = eps cos(phase), k = −eps sin(phase).
            eps_rad: sin.hypot(cos),
            phase_rad: (-cos).atan2(sin),
            uncertainty_rad: COVERAGE * scatter.hypot(between),
        });
    }
    Ok(EncoderErrors { orders, untold, residual_rms_rad: whole.residual_rms_rad, mountings })
}

fn distinct(angles_rad: impl Iterator<Item = f64>) -> usize {
    /// A quarter of a degree apart is another mounting.
    const APART_RAD: f64 = 0.004;
    let mut seen: Vec<f64> = Vec::new();
    for angle in angles_rad {
        let apart = |other: &f64| 2.0 * (0.5 * (angle - other)).sin().abs() > APART_RAD;
        if seen.iter().all(apart) {
            seen.push(angle);
        }
    }
    seen.len()
}

fn mean(curves: &[Curve]) -> Vec<f64> {
    let count = curves.len() as f64;
    (0..curves[0].values_rad.len())
        .map(|bin| curves.iter().map(|curve| curve.values_rad[bin]).sum::<f64>() / count)
        .collect()
}

/// Standard deviation of the mean of pairs, of either part.
fn scatter_of_mean(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
    let count = pairs.clone().count() as f64;
    if count < 2.0 {
        return 0.0;
    }
    let (x, y) = pairs.clone().fold((0.0, 0.0), |(x, y), pair| (x + pair.0 / count, y + pair.1 / count));
    let square: f64 = pairs.map(|pair| (pair.0 - x).powi(2) + (pair.1 - y).powi(2)).sum();
    (0.5 * square / (count - 1.0) / count).sqrt()
}

/// The columns of every run in every bin, the mean over its group taken off.
struct Design {
    /// Per run, a row a bin.
    rows: Vec<DMatrix<f64>>,
    groups: Vec<usize>,
    amplitudes: usize,
}

struct Fit {
    amplitudes: DVector<f64>,
    untold: Vec<bool>,
    residual_rms_rad: f64,
    /// Size of what is left at low orders of a turn, one amplitude, RMS over runs and orders.
    low_order_rad: f64,
}

impl Design {
    fn new(shaft: Shaft, pair: &GearPair, runs: &[&MountedRun], highest: u32) -> Result<Self, CalibrationError> {
        let grid = grid_of(&runs[0].revolutions[0])?;
        let amplitudes = 2 * highest as usize;
        let nuisances = if shaft == Shaft::Input { 2 } else { 1 };
        let columns = amplitudes + nuisances * runs.len();
        let rows = runs
            .iter()
            .enumerate()
            .map(|(number, run)| {
                DMatrix::from_fn(grid.bins(), columns, |bin, column| {
                    let theta1 = grid.centre(bin);
                    let ratio = pair.ratio(theta1);
                    let (theta, gain) =
                        if shaft == Shaft::Input { (theta1, -ratio) } else { (pair.theta2(theta1), 1.0) };
                    if column < amplitudes {
                        let angle = (column / 2 + 1) as f64 * (theta - run.mounting_rad);
                        return gain * if column % 2 == 0 { angle.sin() } else { angle.cos() };
                    }
                    match column - amplitudes {
                        n if n == number => 1.0,
                        n if n == runs.len() + number => ratio,
                        _ => 0.0,
                    }
                })
            })
            .collect();
        Ok(Self { rows, groups: runs.iter().map(|run| run.group).collect(), amplitudes })
    }

    fn fit(&self, curves_rad: &[Vec<f64>]) -> Result<Fit, CalibrationError> {
        let bins: Vec<usize> =
            (0..curves_rad[0].len()).filter(|bin| curves_rad.iter().all(|curve| curve[*bin].is_finite())).collect();
        if bins.len() < FEWEST_BINS {
            return Err(CalibrationError::Bins { bins: bins.len(), needed: FEWEST_BINS });
        }
        let columns = self.rows[0].ncols();
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(columns, columns), DVector::<f64>::zeros(columns));
        let mut taken = Vec::new();
        for &bin in &bins {
            for (row, value) in self.without_group_means(bin, curves_rad) {
                normal.ger(1.0, &row, &row, 1.0);
                right.axpy(value, &row, 1.0);
                taken.push((row, value));
            }
        }
        // Zeros of the mountings are told up to a common one, and some orders not at all: the solution of least norm, and what it lacks.
        let eigen = SymmetricEigen::new(normal);
        let floor = UNTOLD * eigen.eigenvalues.max();
        let mut solution = DVector::zeros(columns);
        let mut lacking = vec![0.0; columns];
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > floor {
                solution.axpy(vector.dot(&right) / value, &vector, 1.0);
            } else {
                lacking.iter_mut().zip(vector.iter()).for_each(|(sum, part)| *sum += part * part);
            }
        }
        let left: Vec<f64> = taken.iter().map(|(row, value)| value - row.dot(&solution)).collect();
        let runs = self.rows.len();
        Ok(Fit {
            amplitudes: solution.rows(0, self.amplitudes).into_owned(),
            untold: lacking[..self.amplitudes].iter().map(|part| *part > 1e-6).collect(),
            residual_rms_rad: (left.iter().map(|rest| rest * rest).sum::<f64>() / left.len() as f64).sqrt(),
            low_order_rad: low_order_rad(&left, &bins, runs, curves_rad[0].len(), self.amplitudes as u32),
        })
    }

    /// Rows and values of one bin, less their means over each group: what stays from mounting to mounting is gone.
    fn without_group_means(&self, bin: usize, curves_rad: &[Vec<f64>]) -> Vec<(DVector<f64>, f64)> {
        (0..self.rows.len())
            .map(|run| {
                let own: Vec<usize> =
                    (0..self.rows.len()).filter(|other| self.groups[*other] == self.groups[run]).collect();
                let share = 1.0 / own.len() as f64;
                let mut row = self.rows[run].row(bin).transpose();
                let mut value = curves_rad[run][bin];
                for other in own {
                    row.axpy(-share, &self.rows[other].row(bin).transpose(), 1.0);
                    value -= share * curves_rad[other][bin];
                }
                (row, value)
            })
            .collect()
    }
}

/// RMS amplitude of what is left at orders 1 to `highest` of the driver, over all runs; `left` has a value a run and bin.
fn low_order_rad(left: &[f64], bins: &[usize], runs: usize, bins_a_turn: usize, highest: u32) -> f64 {
    let mut square = 0.0;
    for run in 0..runs {
        for order in 1..=highest {
            let (mut sin, mut cos) = (0.0, 0.0);
            for (n, bin) in bins.iter().enumerate() {
                let angle = f64::from(order) * std::f64::consts::TAU * (*bin as f64 + 0.5) / bins_a_turn as f64;
                let value = left[n * runs + run] * 2.0 / bins.len() as f64;
                sin += value * angle.sin();
                cos += value * angle.cos();
            }
            square += 0.5 * (sin * sin + cos * cos);
        }
    }
    (square / (runs as f64 * f64::from(highest))).sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::measure::AngleGrid;
    use crate::spec::EllipticalSpec;

    fn pair() -> GearPair {
        GearPair::elliptical(&EllipticalSpec::default()).unwrap()
    }

    /// TE of runs at these mountings: gears, a zero of each mounting, and the disc's errors by order.
    fn runs(shaft: Shaft, mountings_deg: &[f64], errors: &[(u32, f64, f64)]) -> Vec<MountedRun> {
        let pair = pair();
        let grid = AngleGrid::default();
        mountings_deg
            .iter()
            .enumerate()
            .flat_map(|(number, degrees)| {
                let mounting_rad = degrees.to_radians();
                let (pair, errors) = (&pair, errors);
                (0..2).map(move |group| {
                    let curve = |revolution: usize| {
                        Curve::from_fn(grid, |theta1| {
                            let theta2 = pair.theta2(theta1);
                            let gears = 3e-4 * (theta1 + 0.3).sin() + 1e-4 * (theta2 * (1.0 + group as f64)).cos();
                            let (angle, gain) =
                                if shaft == Shaft::Input { (theta1, -pair.ratio(theta1)) } else { (theta2, 1.0) };
                            let disc: f64 = errors
                                .iter()
                                .map(|(order, eps, phase)| {
                                    eps * (f64::from(*order) * (angle - mounting_rad) - phase).sin()
                                })
                                .sum();
                            let slip =
                                if shaft == Shaft::Input { 2e-5 * number as f64 * pair.ratio(theta1) } else { 0.0 };
                            let noise = 1e-7 * ((bin(theta1) * 7919 + revolution * 104_729 + number * 31) as f64).sin();
                            gears + gain * disc + 1e-3 * number as f64 + slip + noise
                        })
                    };
                    MountedRun { mounting_rad, group, revolutions: (0..3).map(curve).collect() }
                })
            })
            .collect()
    }

    fn bin(theta1: f64) -> usize {
        (theta1 * 720.0 / TAU) as usize
    }

    #[test]
    fn three_divisions_tell_all_orders_but_the_multiples_of_three() {
        for shaft in [Shaft::Input, Shaft::Output] {
            let errors = [(1, 4e-5, 1.2), (2, 1e-5, -0.4), (4, 3e-6, 2.0)];
            let found = encoder_errors(shaft, &pair(), &runs(shaft, &[0.0, 120.0, 240.0], &errors), 4).unwrap();
            assert_eq!((found.untold.as_slice(), found.mountings), (&[3][..], 3), "{shaft:?}");
            for (order, eps, phase) in errors {
                let this = found.orders.iter().find(|one| one.order == order).unwrap();
                // As vectors: a small amplitude has no sharp phase.
                let (dx, dy) = (
                    this.eps_rad * this.phase_rad.cos() - eps * phase.cos(),
                    this.eps_rad * this.phase_rad.sin() - eps * phase.sin(),
                );
                assert!(dx.hypot(dy) < 3e-8, "{shaft:?} {this:?}");
                assert!(this.uncertainty_rad < 1e-7 && this.uncertainty_rad > 1e-13, "{this:?}");
            }
            assert!(found.residual_rms_rad < 2e-7);
        }
    }

    #[test]
    fn two_opposite_mountings_tell_odd_orders_alone() {
        let found =
            encoder_errors(Shaft::Output, &pair(), &runs(Shaft::Output, &[0.0, 180.0], &[(1, 4e-5, 0.5)]), 4).unwrap();
        assert_eq!(found.untold, [2, 4]);
        assert!((found.orders[0].eps_rad - 4e-5).abs() < 5e-8);
    }

    #[test]
    fn a_difference_between_runs_that_no_disc_makes_widens_the_uncertainty() {
        let mut disturbed = runs(Shaft::Output, &[0.0, 120.0, 240.0], &[(1, 4e-5, 0.5)]);
        let quiet = encoder_errors(Shaft::Output, &pair(), &disturbed, 2).unwrap().orders[0];
        for curve in &mut disturbed[0].revolutions {
            let grid = AngleGrid::default();
            for (bin, value) in curve.values_rad.iter_mut().enumerate() {
                *value += 5e-6 * (2.0 * grid.centre(bin) + 1.0).cos();
            }
        }
        let found = encoder_errors(Shaft::Output, &pair(), &disturbed, 2).unwrap().orders[0];
        assert!(found.uncertainty_rad > 10.0 * quiet.uncertainty_rad, "{quiet:?} {found:?}");
        assert!((found.eps_rad - 4e-5).abs() < found.uncertainty_rad, "{found:?}");
    }

    #[test]
    fn one_mounting_is_refused_with_what_to_do() {
        let said =
            encoder_errors(Shaft::Input, &pair(), &runs(Shaft::Input, &[30.0, 30.0], &[]), 2).unwrap_err().to_string();
        assert!(said.contains("input_mounted_deg") && said.contains("120"), "{said}");
        let mut apart = runs(Shaft::Output, &[0.0, 90.0], &[]);
        for (n, run) in apart.iter_mut().enumerate() {
            run.group = n;
        }
        assert_eq!(encoder_errors(Shaft::Output, &pair(), &apart, 2), Err(CalibrationError::NoGroup));
    }
}
