//! Measured backlash of two runs, with its interval.

use serde::{Deserialize, Serialize};

use super::MeasureError;
use super::backlash::BacklashCurve;
use super::figures::floor_rms;
use super::grid::Curve;
use super::run_te::RunTe;
use crate::Direction;

/// Backlash over θ1 from a run of each sense, and how far it can be trusted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredBacklash {
    /// TE_cw − TE_ccw at equal θ1.
    pub backlash: BacklashCurve,
    /// Half of the interval at a bin, rad; NaN with one revolution in either sense.
    pub half_width_rad: f64,
}

impl MeasuredBacklash {
    /// Confidence of the interval.
    pub const CONFIDENCE: f64 = 0.9;

    /// Backlash of two runs that share one zero (one homing) and one grid.
    ///
    /// # Errors
    /// [`MeasureError`] for senses exchanged, different grids, and runs that share no angle.
    pub fn of(ccw: &RunTe, cw: &RunTe) -> Result<Self, MeasureError> {
        for (place, run, needed) in [("ccw", ccw, Direction::Ccw), ("cw", cw, Direction::Cw)] {
            let found = run.conditions().direction;
            if found != needed {
                return Err(MeasureError::Sense { place, found });
            }
        }
        let backlash = BacklashCurve::of(&ccw.mean_curve(), &cw.mean_curve())?;
        if backlash.curve.coverage() == 0.0 {
            return Err(MeasureError::NoCommonAngle);
        }
        Ok(Self { backlash, half_width_rad: half_width(ccw, cw) })
    }
}

/// Half of the 90 % interval at a bin, rad: t₀.₉₅ · √(Σ over both senses of floor² + s²(means)/R).
///
/// The floor is the repeatability of a mean curve at a bin, pooled over the bins, each revolution less its own mean; the
/// means' own scatter adds to it. The degrees of freedom are those of the means, the fewer.
fn half_width(ccw: &RunTe, cw: &RunTe) -> f64 {
    let (mut variance, mut freedom) = (0.0, 0.0);
    for run in [ccw, cw] {
        let revolutions: Vec<(usize, Curve)> = run.whole_revolutions().collect();
        let floor_rad = floor_rms(&revolutions);
        let means: Vec<f64> = revolutions.iter().map(|(_, curve)| curve.mean_rad()).collect();
        let count = means.len() as f64;
        let mean = means.iter().sum::<f64>() / count;
        let scatter = means.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
        variance += floor_rad * floor_rad + scatter / count;
        freedom += count - 1.0;
    }
    student_95(freedom) * variance.sqrt()
}

/// The 95 % quantile of Student's t: tabulated to 2 degrees of freedom, then Fisher's expansion about the normal quantile
/// z (Abramowitz and Stegun 26.7.5), good to 0.3 %. NaN below 1.
fn student_95(freedom: f64) -> f64 {
    const Z: f64 = 1.644_853_6;
    if freedom.is_nan() || freedom < 1.0 {
        return f64::NAN;
    }
    if freedom < 2.0 {
        return 6.313_752;
    }
    if freedom < 3.0 {
        return 2.919_986;
    }
    let (z3, z5, z7) = (Z.powi(3), Z.powi(5), Z.powi(7));
    let g1 = (z3 + Z) / 4.0;
    let g2 = (5.0 * z5 + 16.0 * z3 + 3.0 * Z) / 96.0;
    let g3 = (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * Z) / 384.0;
    Z + g1 / freedom + g2 / freedom.powi(2) + g3 / freedom.powi(3)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::GearPair;
    use crate::measure::{AngleGrid, RunConditions};

    /// A run whose revolution r has the constant TE `te_rad(r)`, one sample a bin.
    fn run(direction: Direction, revolutions: usize, bins: usize, mut te_rad: impl FnMut(usize) -> f64) -> RunTe {
        let pair = GearPair::constant(1.0).unwrap();
        let grid = AngleGrid::new(bins).unwrap();
        let mut run = RunTe::new(grid, RunConditions { direction, load_nm: 0.0, speed_rpm: 1.0 });
        for sample in 0..revolutions * bins {
            let theta1_rad = direction.sign() * (sample as f64 + 0.5) * TAU / bins as f64;
            run.push(&pair, theta1_rad, theta1_rad + te_rad(sample / bins));
        }
        run
    }

    #[test]
    fn quantiles_are_those_of_the_table() {
        for (freedom, expected) in [(1.0, 6.314), (2.0, 2.920), (3.0, 2.353), (5.0, 2.015), (10.0, 1.812), (1e9, 1.645)]
        {
            let quantile = student_95(freedom);
            assert!((quantile / expected - 1.0).abs() < 3e-3, "{freedom}: {quantile}");
        }
        assert!(student_95(0.0).is_nan() && student_95(f64::NAN).is_nan());
    }

    #[test]
    fn the_interval_holds_the_truth_in_nine_cases_of_ten() {
        let mut random = Pcg64::new(5, 3);
        let (trials, truth_rad) = (800, 1e-3);
        let held = (0..trials)
            .filter(|_| {
                let mut scatter = || -> f64 { StandardNormal.sample(&mut random) };
                let ccw: Vec<f64> = (0..4).map(|_| 1e-5 * scatter()).collect();
                let cw: Vec<f64> = (0..4).map(|_| truth_rad + 1e-5 * scatter()).collect();
                let measured =
                    MeasuredBacklash::of(&run(Direction::Ccw, 4, 8, |r| ccw[r]), &run(Direction::Cw, 4, 8, |r| cw[r]))
                        .unwrap();
                (measured.backlash.mean_rad - truth_rad).abs() <= measured.half_width_rad
            })
            .count();
        let share = held as f64 / f64::from(trials);
        // Three standard deviations of the count.
        assert!((share - MeasuredBacklash::CONFIDENCE).abs() < 0.032, "{share}");
    }

    #[test]
    fn what_cannot_be_subtracted_is_refused_and_one_revolution_has_no_interval() {
        let (ccw, cw) = (run(Direction::Ccw, 1, 8, |_| 0.0), run(Direction::Cw, 1, 8, |_| 1e-3));
        let measured = MeasuredBacklash::of(&ccw, &cw).unwrap();
        assert!((measured.backlash.mean_rad - 1e-3).abs() < 1e-12 && measured.half_width_rad.is_nan());
        assert!(matches!(MeasuredBacklash::of(&cw, &ccw), Err(MeasureError::Sense { place: "ccw", .. })));
        let fine = run(Direction::Cw, 1, 16, |_| 0.0);
        assert_eq!(MeasuredBacklash::of(&ccw, &fine), Err(MeasureError::GridMismatch { ccw: 8, cw: 16 }));
        let blind = RunTe::new(ccw.grid(), cw.conditions());
        assert_eq!(MeasuredBacklash::of(&ccw, &blind), Err(MeasureError::NoCommonAngle));
    }
}
