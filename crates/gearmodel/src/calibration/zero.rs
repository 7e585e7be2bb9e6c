//! The zeros of both angles from TE: how far the indices stand from where the gears have their zero.
//!
//! If θ1 is read too large by z1 and θ2 by z2, TE gains z2 − i(θ1) z1 (theory, pair.i21). Both senses are averaged, so that backlash and
//! friction do not count; what the model knows of TE is taken off first. For elliptic pairs i lies in the span of 1 and cos θ2, so z1 cannot be
//! told from a first-order eccentricity of either encoder in that direction: calibrate the encoders first.

use super::{COVERAGE, CalibrationError, grid_of};
use crate::Direction;
use crate::measure::Curve;
use crate::model::NominalModel;

/// Below this spread of the ratio over a turn the zeros cannot be told apart.
const LEAST_SPREAD: f64 = 1e-3;

/// Zeros that were found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zero {
    /// θ1 as read, less θ1 of the gears, rad.
    pub input_rad: f64,
    /// Its expanded uncertainty, rad.
    pub input_uncertainty_rad: f64,
    /// θ2 as read, less θ2 of the gears, rad.
    pub output_rad: f64,
    /// Its expanded uncertainty, rad.
    pub output_uncertainty_rad: f64,
    /// What is left of TE, RMS, rad.
    pub residual_rms_rad: f64,
}

/// The zeros from the mean TE curves of both senses at one load and speed.
///
/// # Errors
/// The curves have too little in common, or the ratio is constant.
pub fn zero(model: &NominalModel, ccw: &Curve, cw: &Curve, load_nm: f64) -> Result<Zero, CalibrationError> {
    const FEWEST_BINS: usize = 90;
    let grid = grid_of(ccw)?;
    let mut points = Vec::new();
    for bin in 0..grid.bins() {
        let mean = 0.5 * (ccw.values_rad[bin] + cw.values_rad[bin]);
        if mean.is_finite() {
            let theta1 = grid.centre(bin);
            let known = [Direction::Ccw, Direction::Cw].map(|sense| model.te_rad(theta1, sense, load_nm));
            points.push((model.pair.ratio(theta1), mean - 0.5 * (known[0] + known[1])));
        }
    }
    if points.len() < FEWEST_BINS {
        return Err(CalibrationError::Bins { bins: points.len(), needed: FEWEST_BINS });
    }
    let count = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (ratio, value) = (mean(&|p| p.0), mean(&|p| p.1));
    let spread = mean(&|p| (p.0 - ratio).powi(2));
    if spread.sqrt() < LEAST_SPREAD {
        return Err(CalibrationError::ConstantRatio { sum_rad: value });
    }
    // y = z2 − i z1: a straight line over i.
    let slope = mean(&|p| (p.0 - ratio) * (p.1 - value)) / spread;
    let offset = value - slope * ratio;
    let left: Vec<f64> = points.iter().map(|p| p.1 - offset - slope * p.0).collect();
    let square = left.iter().map(|rest| rest * rest).sum::<f64>() / count;
    // Neighbouring bins leave the same: only so many of them are independent.
    let independent = independent_values(&left);
    let of_slope = (square / (spread * independent)).sqrt();
    let of_offset = (square / independent * (1.0 + ratio * ratio / spread)).sqrt();
    Ok(Zero {
        input_rad: -slope,
        input_uncertainty_rad: COVERAGE * of_slope,
        output_rad: offset,
        output_uncertainty_rad: COVERAGE * of_offset,
        residual_rms_rad: square.sqrt(),
    })
}

/// How many values of a curve over a turn are independent: n over 1 + 2 Σ ρ, with the autocorrelation ρ up to its first zero.
fn independent_values(values: &[f64]) -> f64 {
    let n = values.len();
    let at = |lag: usize| (0..n).map(|k| values[k] * values[(k + lag) % n]).sum::<f64>();
    let whole = at(0);
    if whole == 0.0 {
        return n as f64;
    }
    let sum: f64 = (1..n / 2).map(|lag| at(lag) / whole).take_while(|rho| *rho > 0.0).sum();
    (n as f64 / (1.0 + 2.0 * sum)).max(3.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::errors::Errors;
    use crate::measure::AngleGrid;
    use crate::pair::GearPair;
    use crate::spec::{CircularSpec, EllipticalSpec};

    fn elliptic() -> GearPair {
        GearPair::elliptical(&EllipticalSpec::default()).unwrap()
    }

    fn measured(model: &NominalModel, sense: Direction, z1: f64, z2: f64, ripple: f64) -> Curve {
        Curve::from_fn(AngleGrid::default(), |theta1| {
            let backlash = 2e-4 * sense.sign();
            model.te_rad(theta1, sense, 5.0) + z2 - model.pair.ratio(theta1) * z1 + ripple * (5.0 * theta1).sin()
                - backlash
        })
    }

    #[test]
    fn both_zeros_come_out_whatever_backlash_does() {
        let model = NominalModel::new(elliptic(), Errors::default()).unwrap();
        let curve = |sense| measured(&model, sense, 3e-4, -2e-4, 1e-5);
        let found = zero(&model, &curve(Direction::Ccw), &curve(Direction::Cw), 5.0).unwrap();
        assert!((found.input_rad - 3e-4).abs() < found.input_uncertainty_rad, "{found:?}");
        assert!((found.output_rad + 2e-4).abs() < found.output_uncertainty_rad, "{found:?}");
        assert!(found.input_uncertainty_rad < 3e-5, "{found:?}");
    }

    #[test]
    fn a_constant_ratio_is_refused() {
        let pair =
            GearPair::circular(&CircularSpec { module_mm: 3.0, teeth: (40, 40), ..CircularSpec::default() }).unwrap();
        let model = NominalModel::new(pair, Errors::default()).unwrap();
        let curve = Curve::from_fn(AngleGrid::default(), |_| 1e-4);
        assert!(matches!(zero(&model, &curve, &curve, 5.0), Err(CalibrationError::ConstantRatio { .. })));
    }
}
