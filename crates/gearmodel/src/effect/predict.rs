//! The model found: nominal plus found effects, for conditions that were not measured.

use nalgebra::DMatrix;

use super::{Effect, Estimate, NominalRig, OperatingPoint, RevolutionsByLoad, Shape};
use crate::Direction;

/// A found effect with its amplitudes.
#[derive(Clone)]
pub struct FoundEffect {
    /// The effect.
    pub effect: &'static dyn Effect,
    /// Its shape.
    pub shape: Shape,
    /// Its amplitudes.
    pub estimate: Estimate,
}

impl std::fmt::Debug for FoundEffect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FoundEffect")
            .field("effect", &self.effect.name())
            .field("shape", &self.shape)
            .field("beta", &self.estimate.beta)
            .finish()
    }
}

/// Where a prediction is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Condition {
    /// Sense.
    pub direction: Direction,
    /// Load on the driven shaft, N·m.
    pub load_nm: f64,
    /// Driver speed, rpm.
    pub speed_rpm: f64,
    /// Time since the campaign's start, s: for effects that grow with it.
    pub time_s: f64,
    /// Driver revolutions since then.
    pub revolutions: f64,
}

impl Condition {
    /// Standing still at the campaign's start.
    #[must_use]
    pub fn at_rest(direction: Direction, load_nm: f64) -> Self {
        Self { direction, load_nm, speed_rpm: 0.0, time_s: 0.0, revolutions: 0.0 }
    }

    /// The station at θ1; the revolutions so far were made under this load and in this sense.
    #[must_use]
    pub fn operating_point(&self, rig: &NominalRig, theta1_rad: f64) -> OperatingPoint {
        let sense = self.direction.sign();
        let mut revolutions_by_load = RevolutionsByLoad::default();
        revolutions_by_load.load_nm[0] = self.load_nm;
        revolutions_by_load.signed_rev[0] = sense * self.revolutions;
        revolutions_by_load.way_rev[0] = self.revolutions;
        OperatingPoint {
            load_nm: self.load_nm,
            speed_rad_per_s: sense * self.speed_rpm * std::f64::consts::TAU / 60.0,
            time_s: self.time_s,
            way_rev: self.revolutions,
            revolutions_by_load,
            ..rig.operating_point(theta1_rad, rig.pair().theta2(theta1_rad), self.direction)
        }
    }
}

/// Found effects, ready to predict.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Rig that they were linearised about; `None` where nothing was diagnosed.
    pub rig: Option<NominalRig>,
    /// The effects of the verdict; of a group its most probable member.
    pub effects: Vec<FoundEffect>,
}

impl Found {
    /// TE that the found effects add, rad, and its standard deviation.
    #[must_use]
    pub fn te_rad(&self, theta1_rad: f64, at: &Condition) -> (f64, f64) {
        let Some(rig) = &self.rig else { return (0.0, 0.0) };
        let station = at.operating_point(rig, theta1_rad);
        let (mut te_rad, mut variance) = (0.0, 0.0);
        for found in &self.effects {
            let (te, var) = found.te(rig, &station);
            te_rad += te;
            variance += var;
        }
        (te_rad, variance.sqrt())
    }
}

impl FoundEffect {
    fn te(&self, rig: &NominalRig, station: &OperatingPoint) -> (f64, f64) {
        let mut row = vec![0.0; self.estimate.beta.len()];
        self.effect.row(rig, &self.shape, station, &mut row);
        let te: f64 = row.iter().zip(&self.estimate.beta).map(|(x, b)| x * b).sum();
        let row = DMatrix::from_row_slice(1, row.len(), &row);
        let variance = (&row * &self.estimate.covariance * row.transpose())[(0, 0)];
        (te, variance.max(0.0))
    }
}
