//! Transmission error and backlash while they are measured: for the eye, for the limit on them, and for the log's readers.

use gearmodel::Direction;
use gearmodel::NominalModel;
use gearmodel::measure::AngleGrid;
use riglog::proto::{self, Phase, Timestamp};

use super::status::{Latest, Status};
use crate::analysis::{Analysis, MeasuredBacklash};

/// TE of the active run, from sample to sample.
#[derive(Debug, Default)]
pub(super) struct LiveTe {
    /// TE less the model's at the run's first value, rad.
    zero_rad: Option<f64>,
}

impl LiveTe {
    /// A run is armed.
    pub fn begin(&mut self, latest: &mut Latest) {
        latest.te_range_rad = [f64::INFINITY, f64::NEG_INFINITY];
        latest.excursion_rad = 0.0;
        self.zero_rad = None;
    }

    /// Feeds a sample of a run to the analysis; the message of a value that came of it.
    pub fn measure(
        &mut self,
        analysis: &mut Analysis,
        status: &Status,
        latest: &mut Latest,
        [theta1, theta2]: [f64; 2],
        time_ns: u64,
    ) -> Option<proto::TransmissionError> {
        let point = analysis.push(theta1, theta2)?;
        let direction = status.direction.unwrap_or(Direction::Ccw);
        let model = analysis.model().te_rad(point.theta1_rad, direction, status.load_setpoint_nm);
        let zero = *self.zero_rad.get_or_insert(point.te_rad - model);
        latest.backlash_rad = analysis.live_backlash_rad(&point);
        latest.te_rad = point.te_rad;
        latest.te_range_rad = [latest.te_range_rad[0].min(point.te_rad), latest.te_range_rad[1].max(point.te_rad)];
        latest.excursion_rad = latest.excursion_rad.max((point.te_rad - model - zero).abs());
        Some(proto::TransmissionError {
            timestamp: Some(Timestamp::from_ns(time_ns)),
            direction: proto::Direction::from(direction).into(),
            revolution: point.revolution,
            theta1_rad: point.theta1_rad,
            theta2_rad: point.theta2_rad,
            te_rad: point.te_rad,
            model_te_rad: model,
            load_nm: status.load_nm,
            speed_rpm: latest.speed_rpm,
        })
    }
}

/// TE less the model's while the rig settles, rad: what settling is judged by. NaN in any other phase.
pub(super) fn residual_rad(model: &NominalModel, status: &Status, [theta1, theta2]: [f64; 2]) -> f64 {
    if status.phase != Phase::Settle {
        return f64::NAN;
    }
    let direction = status.direction.unwrap_or(Direction::Ccw);
    theta2 - model.pair.theta2(theta1) - model.te_rad(theta1, direction, status.load_setpoint_nm)
}

/// The backlash that a run and the one in the other sense gave, a message a bin.
pub(super) fn backlash_messages(
    model: &NominalModel,
    backlash: &MeasuredBacklash,
    load_nm: f64,
    end_ns: u64,
) -> impl Iterator<Item = proto::Backlash> {
    let grid = AngleGrid::default();
    let values = backlash.curve.curve.values_rad.iter().enumerate().filter(|(_, value)| value.is_finite());
    values.map(move |(bin, value)| proto::Backlash {
        timestamp: Some(Timestamp::from_ns(end_ns)),
        theta1_rad: grid.centre(bin),
        backlash_rad: *value,
        model_backlash_rad: model.backlash_rad(grid.centre(bin), backlash.conditions.load_nm),
        load_nm,
    })
}
