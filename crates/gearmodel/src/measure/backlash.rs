//! Backlash over angle from the TE of both senses.

use serde::{Deserialize, Serialize};

use super::MeasureError;
use super::grid::{AngleGrid, Curve};
use crate::NominalModel;
use crate::effect::predict::Condition;

/// Backlash over θ1 at the driven shaft, rad: TE_cw − TE_ccw at equal θ1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BacklashCurve {
    /// Values at the bin centres, rad; NaN where one of the senses was not seen.
    pub curve: Curve,
    /// Smallest value, rad; NaN when there is none.
    pub min_rad: f64,
    /// Mean over the bins, rad; NaN when there is none.
    pub mean_rad: f64,
    /// Largest value, rad; NaN when there is none.
    pub max_rad: f64,
}

impl BacklashCurve {
    /// Measured backlash from the mean curves of both senses, which must share one zero (one homing).
    ///
    /// # Errors
    /// [`MeasureError::GridMismatch`] for curves on different grids.
    pub fn of(ccw: &Curve, cw: &Curve) -> Result<Self, MeasureError> {
        let (bins_ccw, bins_cw) = (ccw.values_rad.len(), cw.values_rad.len());
        if bins_ccw != bins_cw {
            return Err(MeasureError::GridMismatch { ccw: bins_ccw, cw: bins_cw });
        }
        let values_rad = cw.values_rad.iter().zip(&ccw.values_rad).map(|(cw, ccw)| cw - ccw).collect();
        Ok(Self::from_curve(Curve { values_rad }))
    }

    /// Backlash that the model predicts under a load.
    #[must_use]
    pub fn predicted(model: &NominalModel, grid: AngleGrid, load_nm: f64) -> Self {
        Self::from_curve(Curve::from_fn(grid, |theta1_rad| model.backlash_rad(theta1_rad, load_nm)))
    }

    /// The same where speed, time and revolutions matter too.
    #[must_use]
    pub fn predicted_under(model: &NominalModel, grid: AngleGrid, under: &Condition) -> Self {
        Self::from_curve(Curve::from_fn(grid, |theta1_rad| model.backlash_under_rad(theta1_rad, under)))
    }

    fn from_curve(curve: Curve) -> Self {
        Self { min_rad: curve.min_rad(), mean_rad: curve.mean_rad(), max_rad: curve.max_rad(), curve }
    }

    /// Feeds every value in order (NaN as the one canonical NaN): equal sequences mean bit-identical results.
    pub fn for_each_hashed_value(&self, feed: &mut dyn FnMut(f64)) {
        for value in &self.curve.values_rad {
            feed(if value.is_nan() { f64::NAN } else { *value });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn difference_of_the_senses_with_gaps() {
        let ccw = Curve { values_rad: vec![1.0, f64::NAN, 3.0] };
        let cw = Curve { values_rad: vec![2.0, 5.0, 7.0] };
        let backlash = BacklashCurve::of(&ccw, &cw).unwrap();
        assert_eq!((backlash.min_rad, backlash.mean_rad, backlash.max_rad), (1.0, 2.5, 4.0));
        let short = Curve { values_rad: vec![0.0] };
        assert_eq!(BacklashCurve::of(&ccw, &short), Err(MeasureError::GridMismatch { ccw: 3, cw: 1 }));
    }
}
