//! The figures of a run: measured against predicted.

use serde::{Deserialize, Serialize};

use super::grid::{AngleGrid, Curve, mean};
use super::order::Order;
use super::run_te::RunTe;
use crate::effect::predict::Condition;
use crate::{GearPair, NominalModel};

/// Highest order of θ1 that the figures state.
const HIGHEST_ORDER: u32 = 4;

/// The figures of one run. Definitions follow the usual single-flank values in spirit; no conformance is claimed.
///
/// NaN stands where the run cannot tell: no sample, one revolution only, no teeth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFigures {
    /// Mean of the mean curve, rad.
    pub mean_rad: f64,
    /// Peak-to-peak of the mean curve, rad.
    pub pp_rad: f64,
    /// √(mean of squares) of the mean curve, rad, about its own zero (the index counts').
    pub rms_rad: f64,
    /// Peak-to-peak of the predicted curve over the whole turn, rad.
    pub predicted_pp_rad: f64,
    /// Mean of the predicted curve over the whole turn, rad.
    pub predicted_mean_rad: f64,
    /// The zero removed before the residual, rad: measured − predicted on average.
    pub zero_rad: f64,
    /// RMS over the bins of measured − predicted − zero, rad.
    pub residual_rms_rad: f64,
    /// Repeatability of the mean curve, rad RMS: the scatter between the revolutions at a bin, after removing each
    /// revolution's own mean, over √revolutions. NaN for one revolution.
    pub floor_rms_rad: f64,
    /// Slope of the revolutions' means, rad a revolution, by least squares; counted along the run in both senses. NaN for
    /// one revolution.
    pub offset_per_rev_rad: f64,
    /// Total deviation over a turn, F'is-like: peak-to-peak of the mean curve, rad.
    pub f_is_total_rad: f64,
    /// Tooth-to-tooth deviation, f'is-like: largest peak-to-peak of the mean curve within one pitch of arc length, rad. NaN
    /// without teeth.
    pub f_is_tooth_rad: f64,
    /// Orders 1 to 4 of θ1, measured.
    pub orders: Vec<Order>,
    /// Orders 1 to 4 of θ1, predicted, on the bins that were measured.
    pub predicted_orders: Vec<Order>,
    /// Whole revolutions behind the mean curve; 0 for a run of less than one.
    pub revolutions: usize,
    /// Share of the bins seen, 0 to 1.
    pub coverage: f64,
}

/// The one free zero that runs of one homing share, rad: mean of measured − predicted over all bins and runs, each run
/// with equal weight. NaN where nothing was measured.
#[must_use]
pub fn common_zero(runs: &[&RunTe], model: &NominalModel) -> f64 {
    mean(runs.iter().map(|run| difference(run, &run.mean_curve(), model).mean_rad()).filter(|zero| zero.is_finite()))
}

/// Measured − predicted at the bin centres, rad.
fn difference(run: &RunTe, measured: &Curve, model: &NominalModel) -> Curve {
    let predicted = predicted_curve(run, model);
    let values_rad = measured.values_rad.iter().zip(&predicted.values_rad).map(|(m, p)| m - p).collect();
    Curve { values_rad }
}

fn predicted_curve(run: &RunTe, model: &NominalModel) -> Curve {
    let conditions = run.conditions();
    let under =
        Condition { speed_rpm: conditions.speed_rpm, ..Condition::at_rest(conditions.direction, conditions.load_nm) };
    Curve::from_fn(run.grid(), |theta1_rad| model.te_under_rad(theta1_rad, &under))
}

impl RunFigures {
    /// Figures of a run against a model. `zero_rad` is the zero to remove, as from [`common_zero`], so that both senses keep
    /// their distance; `None` takes this run's own.
    #[must_use]
    pub fn of(run: &RunTe, model: &NominalModel, zero_rad: Option<f64>) -> Self {
        let grid = run.grid();
        let curve = run.mean_curve();
        let predicted = predicted_curve(run, model);
        let difference = difference(run, &curve, model);
        let zero_rad = zero_rad.unwrap_or_else(|| difference.mean_rad());
        let residual_rms_rad = mean(difference.finite().map(|value| (value - zero_rad).powi(2))).sqrt();
        let predicted_where_seen = Curve {
            values_rad: predicted
                .values_rad
                .iter()
                .zip(&curve.values_rad)
                .map(|(value, seen)| if seen.is_finite() { *value } else { f64::NAN })
                .collect(),
        };
        let revolutions: Vec<(usize, Curve)> = run.whole_revolutions().collect();
        Self {
            mean_rad: curve.mean_rad(),
            pp_rad: curve.pp_rad(),
            rms_rad: curve.rms_rad(),
            predicted_pp_rad: predicted.pp_rad(),
            predicted_mean_rad: predicted.mean_rad(),
            zero_rad,
            residual_rms_rad,
            floor_rms_rad: floor_rms(&revolutions),
            offset_per_rev_rad: slope(&revolutions),
            f_is_total_rad: curve.pp_rad(),
            f_is_tooth_rad: tooth_to_tooth(grid, &curve, &model.pair),
            orders: Order::of(grid, &curve, HIGHEST_ORDER),
            predicted_orders: Order::of(grid, &predicted_where_seen, HIGHEST_ORDER),
            revolutions: revolutions.len(),
            coverage: curve.coverage(),
        }
    }
}

/// √(mean over the bins of s²/R), s² the variance between the R revolutions that saw the bin, each less its own mean: an
/// offset that accumulates is no scatter and has a figure of its own.
pub(super) fn floor_rms(revolutions: &[(usize, Curve)]) -> f64 {
    let Some((_, first)) = revolutions.first() else {
        return f64::NAN;
    };
    let means: Vec<f64> = revolutions.iter().map(|(_, curve)| curve.mean_rad()).collect();
    let variance_of_mean = |bin: usize| {
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for ((_, curve), mean_rad) in revolutions.iter().zip(&means) {
            let value = curve.values_rad[bin] - mean_rad;
            if value.is_finite() {
                count += 1.0;
                sum += value;
                squares += value * value;
            }
        }
        (squares - sum * sum / count).max(0.0) / ((count - 1.0) * count)
    };
    mean((0..first.values_rad.len()).map(variance_of_mean).filter(|value| value.is_finite())).sqrt()
}

/// Least-squares slope of the revolutions' means over their number, rad a revolution.
fn slope(revolutions: &[(usize, Curve)]) -> f64 {
    let points: Vec<(f64, f64)> = revolutions
        .iter()
        .map(|(number, curve)| (*number as f64, curve.mean_rad()))
        .filter(|(_, value)| value.is_finite())
        .collect();
    if points.len() < 2 {
        return f64::NAN;
    }
    let (mean_x, mean_y) = (mean(points.iter().map(|p| p.0)), mean(points.iter().map(|p| p.1)));
    let (mut xy, mut xx) = (0.0, 0.0);
    for (x, y) in points {
        xy += (x - mean_x) * (y - mean_y);
        xx += (x - mean_x) * (x - mean_x);
    }
    xy / xx
}

/// Largest peak-to-peak within any window of one pitch of arc length, rad. Bins that no sample saw are stepped over.
pub(super) fn tooth_to_tooth(grid: AngleGrid, curve: &Curve, pair: &GearPair) -> f64 {
    let Some(pitch_mm) = pair.pitch_mm() else {
        return f64::NAN;
    };
    let bins = grid.bins();
    let perimeter_mm = pair.perimeter_mm();
    let arcs_mm: Vec<f64> = grid.centres().map(|theta1_rad| pair.arc_length_mm(theta1_rad)).collect();
    let mut largest = f64::NAN;
    for start in 0..bins {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut previous: Option<(f64, f64)> = None;
        for step in 0..bins {
            let bin = start + step;
            let turn_mm = if bin < bins { 0.0 } else { perimeter_mm };
            let arc_mm = arcs_mm[bin % bins] + turn_mm - arcs_mm[start];
            let value = curve.values_rad[bin % bins];
            if !value.is_finite() {
                continue;
            }
            if arc_mm > pitch_mm {
                // The window ends between two bins: interpolate, so that coarse grids lose nothing.
                if let Some((arc_before, value_before)) = previous {
                    let at_end =
                        value_before + (value - value_before) * (pitch_mm - arc_before) / (arc_mm - arc_before);
                    low = low.min(at_end);
                    high = high.max(at_end);
                }
                break;
            }
            low = low.min(value);
            high = high.max(value);
            previous = Some((arc_mm, value));
        }
        if high >= low {
            largest = f64::max(largest, high - low);
        }
    }
    largest
}
