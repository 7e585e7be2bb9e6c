//! A log against a model, without looking for causes: how much of the residual repeatability does not explain.

use std::f64::consts::TAU;

use serde::Serialize;

use super::nominal::Nominal;
use super::reduce::ReducedRun;
use super::settings::ReductionSettings;

/// Angle bins a turn, in which revolutions are compared.
const BINS: usize = 360;

/// A run, or all runs of a sense, against the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerifiedRow {
    /// `ccw` or `cw`.
    pub direction: String,
    /// Load, N·m; `None` for several.
    pub load_nm: Option<f64>,
    /// Driver speed, rpm; `None` for several.
    pub speed_rpm: Option<f64>,
    /// Revolutions of the driver.
    pub revolutions: f64,
    /// Mean of measured − model, the common zero removed, rad.
    pub mean_rad: f64,
    /// RMS of measured − model, the common zero removed, rad.
    pub residual_rms_rad: f64,
    /// Repeatability: RMS of the scatter between revolutions at an angle, each revolution's mean included, rad; `None` for a
    /// single revolution.
    pub floor_rms_rad: Option<f64>,
    /// Residual over floor.
    pub ratio: Option<f64>,
}

/// A log against a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verified {
    /// The one free zero that was removed, rad.
    pub zero_rad: f64,
    /// Run by run, in order of time.
    pub runs: Vec<VerifiedRow>,
    /// Sense by sense.
    pub directions: Vec<VerifiedRow>,
    /// RMS over all runs, rad.
    pub residual_rms_rad: f64,
    /// Repeatability over all runs, rad.
    pub floor_rms_rad: Option<f64>,
}

/// Sums of squares over cells: angle bins, revolution by revolution. Residual and scatter are of the same cells, so that a model
/// without error has a ratio of 1.
#[derive(Clone, Copy, Default)]
struct Sums {
    cells: f64,
    sum: f64,
    squares: f64,
    /// Squared deviations between revolutions, and their degrees of freedom.
    scatter: f64,
    freedom: f64,
    revolutions: f64,
}

impl Sums {
    fn of(run: &ReducedRun, zero_rad: f64) -> Self {
        let Some(first) = run.points.first() else { return Self::default() };
        let mut sums = Self::default();
        let mut bins = vec![(0.0, 0.0, 0.0); BINS];
        let mut turn = (0, vec![(0.0, 0.0); BINS]);
        let mut close = |turn: &mut Vec<(f64, f64)>, sums: &mut Self| {
            for (bin, cell) in bins.iter_mut().zip(turn) {
                if cell.0 > 0.0 {
                    let mean: f64 = cell.1 / cell.0;
                    sums.cells += 1.0;
                    sums.sum += mean;
                    sums.squares += mean * mean;
                    bin.0 += 1.0;
                    bin.1 += mean;
                    bin.2 += mean * mean;
                }
                *cell = (0.0, 0.0);
            }
        };
        for point in &run.points {
            let rho = point.rho_rad - zero_rad;
            let way_rev = (point.theta1_rad - first.theta1_rad).abs() / TAU;
            sums.revolutions = way_rev;
            if way_rev as usize != turn.0 {
                close(&mut turn.1, &mut sums);
                turn.0 = way_rev as usize;
            }
            let cell = &mut turn.1[((way_rev.fract() * BINS as f64) as usize).min(BINS - 1)];
            *cell = (cell.0 + 1.0, cell.1 + rho);
        }
        close(&mut turn.1, &mut sums);
        for (n, sum, squares) in bins {
            if n > 1.0 {
                sums.scatter += (squares - sum * sum / n).max(0.0);
                sums.freedom += n - 1.0;
            }
        }
        sums
    }

    fn add(&mut self, other: &Self) {
        self.cells += other.cells;
        self.sum += other.sum;
        self.squares += other.squares;
        self.scatter += other.scatter;
        self.freedom += other.freedom;
        self.revolutions += other.revolutions;
    }

    fn floor_rms_rad(&self) -> Option<f64> {
        (self.freedom > 0.0).then(|| (self.scatter / self.freedom).sqrt())
    }

    fn residual_rms_rad(&self) -> f64 {
        (self.squares / self.cells.max(1.0)).sqrt()
    }

    fn row(&self, direction: String, load_nm: Option<f64>, speed_rpm: Option<f64>) -> VerifiedRow {
        let floor_rms_rad = self.floor_rms_rad();
        VerifiedRow {
            direction,
            load_nm,
            speed_rpm,
            revolutions: self.revolutions,
            mean_rad: self.sum / self.cells.max(1.0),
            residual_rms_rad: self.residual_rms_rad(),
            floor_rms_rad,
            ratio: floor_rms_rad.filter(|floor| *floor > 0.0).map(|floor| self.residual_rms_rad() / floor),
        }
    }
}

/// Compares reduced runs with the model that they were reduced against; `None` where no driver turned.
#[must_use]
pub fn verify(nominal: &Nominal, mut runs: Vec<ReducedRun>) -> Option<Verified> {
    runs.retain(|run| !run.points.is_empty());
    runs.sort_by(|a, b| a.points[0].time_s.total_cmp(&b.points[0].time_s));
    nominal.take_off_effects(&mut runs, &ReductionSettings::default());
    // Every run counts alike in the zero, however long it is.
    let means = runs.iter().map(|run| run.points.iter().map(|p| p.rho_rad).sum::<f64>() / run.points.len() as f64);
    let zero_rad = means.sum::<f64>() / runs.len() as f64;
    if !zero_rad.is_finite() {
        return None;
    }
    let sums: Vec<Sums> = runs.iter().map(|run| Sums::of(run, zero_rad)).collect();
    let mut all = Sums::default();
    sums.iter().for_each(|s| all.add(s));
    let directions = gearmodel::Direction::BOTH
        .into_iter()
        .filter(|direction| runs.iter().any(|run| run.direction == *direction))
        .map(|direction| {
            let mut total = Sums::default();
            runs.iter().zip(&sums).filter(|(run, _)| run.direction == direction).for_each(|(_, s)| total.add(s));
            total.row(direction.to_string(), None, None)
        })
        .collect();
    let rows = runs.iter().zip(&sums).map(|(run, sums)| {
        let load_nm = run.points.iter().map(|p| p.load_nm).sum::<f64>() / run.points.len() as f64;
        sums.row(run.direction.to_string(), Some(load_nm), Some(run.speed_rpm))
    });
    Some(Verified {
        zero_rad,
        runs: rows.collect(),
        directions,
        residual_rms_rad: all.residual_rms_rad(),
        floor_rms_rad: all.floor_rms_rad(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reduce::{Reducer, Sample};
    use gearmodel::{Direction, PairFile};

    const PAIR: &str = "kind = \"elliptical\"\nmodule_mm = 3.0\nteeth = [47, 47]\neccentricity = 0.3287\n";

    /// Four revolutions each way with an output reading error, per sample, as a function of θ2, time and revolutions.
    fn against(model: &str, extra: impl Fn(f64, f64, f64) -> f64) -> Verified {
        let model = PairFile::parse(&format!("{PAIR}{model}")).unwrap().model().unwrap();
        let nominal = Nominal::new(model, [None, None], None);
        let mut runs = Vec::new();
        let (mut time_s, mut way_rev) = (0.0, 0.0);
        for direction in Direction::BOTH {
            let mut reducer = Reducer::new(&nominal, direction, 6.0, &crate::Settings::default());
            for n in 0..4 * 3600 {
                let theta1_rad = direction.sign() * f64::from(n) * TAU / 3600.0;
                let theta2 = nominal.rig().pair().theta2(theta1_rad);
                // Revolutions differ a little, or there is no floor.
                let noise = 1e-6 * (f64::from(n) * 0.7391).sin();
                let theta2_rad = theta2 + extra(theta2, time_s, way_rev) + noise;
                reducer.push(Sample { time_s, theta1_rad, theta2_rad, load_nm: 5.0 });
                time_s += 10.0 / 3600.0;
                way_rev += 1.0 / 3600.0;
            }
            runs.push(reducer.finish().0);
        }
        verify(&nominal, runs).unwrap()
    }

    #[test]
    fn what_the_model_lacks_stands_out_and_what_it_has_does_not() {
        let eccentric = |theta2: f64, _: f64, _: f64| 4e-5 * (theta2 - 0.7).sin() + 3e-4;
        let found = against("", eccentric);
        // Mean and scatter of the error over the driver's turn, which the driven gear does not turn evenly through.
        let pair = PairFile::parse(PAIR).unwrap().model().unwrap().pair;
        let errors_rad: Vec<f64> =
            (0..3600).map(|n| eccentric(pair.theta2(f64::from(n) * TAU / 3600.0), 0.0, 0.0)).collect();
        let mean_rad = errors_rad.iter().sum::<f64>() / 3600.0;
        let rms_rad = (errors_rad.iter().map(|x| (x - mean_rad).powi(2)).sum::<f64>() / 3600.0).sqrt();
        assert!((found.residual_rms_rad / rms_rad - 1.0).abs() < 0.01, "{} {rms_rad}", found.residual_rms_rad);
        assert!((found.zero_rad - mean_rad).abs() < 5e-7, "{} {mean_rad}", found.zero_rad);
        assert!(found.runs.len() == 2 && found.runs.iter().all(|row| row.ratio.unwrap() > 10.0));
        let known = against("[documented.encoder2_eccentricity]\neps = 4e-5\nphase_rad = 0.7\n", eccentric);
        assert!(known.residual_rms_rad < 1.5e-6, "{}", known.residual_rms_rad);
        assert!((known.zero_rad - 3e-4).abs() < 1e-6);
    }

    #[test]
    fn what_grows_with_way_and_time_is_carried_on_from_run_to_run() {
        let slipping = |_: f64, time_s: f64, way_rev: f64| {
            let signed = if time_s < 40.0 { way_rev } else { 8.0 - way_rev };
            -1e-6 * 5.0 * signed
        };
        let stuck = against("", slipping);
        let known = against("[documented.slip]\nk_rad_per_rev_nm = 1e-6\nt0_nm = 0.0\n", slipping);
        assert!(stuck.residual_rms_rad > 4.0 * known.residual_rms_rad && known.residual_rms_rad < 1.5e-6);
    }
}
