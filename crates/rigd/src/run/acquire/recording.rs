//! Which samples are a run's: it begins at a bin edge and ends whole turns later, at exact samples.

use std::f64::consts::TAU;

use gearmodel::Direction;
use gearmodel::measure::{AngleGrid, RunConditions};

/// The state of recording a run.
#[derive(Debug, Clone, Copy)]
pub(super) enum RunState {
    Idle,
    /// Begins at the next bin edge.
    Armed {
        conditions: RunConditions,
        revolutions: f64,
    },
    /// Ends when θ1 has gone `extent_rad` from the edge where it began.
    Active {
        edge_rad: f64,
        extent_rad: f64,
        sense: f64,
        first_sample: u64,
        began_ns: u64,
        lost_before: u64,
    },
    Done {
        revolutions: f64,
    },
}

impl RunState {
    /// A run is armed or active: its samples have to be looked at one by one.
    pub fn is_on(&self) -> bool {
        matches!(self, Self::Armed { .. } | Self::Active { .. })
    }

    /// A run is active.
    pub fn is_active(&self) -> bool {
        matches!(self, Self::Active { .. })
    }

    /// The armed run is over.
    pub fn is_done(&self) -> bool {
        matches!(self, Self::Done { .. })
    }

    /// Revolutions of the run that is over.
    pub fn revolutions(&self) -> f64 {
        match self {
            Self::Done { revolutions } => *revolutions,
            _ => 0.0,
        }
    }

    /// Ends the active run at the end of the revolution that it is in, `gone` revolutions from its start; one that has not begun does
    /// not begin.
    pub fn end_with_revolution(&mut self, gone: f64) {
        let under_way = (gone + 1e-9).ceil().max(1.0) * TAU;
        match self {
            Self::Active { extent_rad, .. } => *extent_rad = extent_rad.min(under_way),
            Self::Armed { .. } => *self = Self::Done { revolutions: 0.0 },
            Self::Idle | Self::Done { .. } => {}
        }
    }

    /// The edge at which an armed run begins, where θ1 has gone from `previous` to `theta1`, rad.
    pub fn begins_at(&self, previous: Option<f64>, theta1: f64) -> Option<f64> {
        let Self::Armed { conditions, .. } = self else { return None };
        edge_between(AngleGrid::default(), previous?, theta1, conditions.direction)
    }

    /// An active run is over at θ1, rad.
    pub fn ends_at(&self, theta1: f64) -> bool {
        match self {
            Self::Active { edge_rad, extent_rad, sense, .. } => (theta1 - edge_rad) * sense >= *extent_rad,
            _ => false,
        }
    }
}

/// The bin edge that θ1 passed from `previous` to `theta1` in the sense of `direction`, rad; `None` if it passed none.
fn edge_between(grid: AngleGrid, previous: f64, theta1: f64, direction: Direction) -> Option<f64> {
    let width = TAU / grid.bins() as f64;
    let edge = match direction {
        Direction::Ccw => (theta1 / width).floor() * width,
        Direction::Cw => (theta1 / width).ceil() * width,
    };
    ((edge - previous) * direction.sign() > 0.0).then_some(edge)
}
