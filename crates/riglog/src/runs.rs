//! Runs: stretches of recording at one direction, load and speed.

use std::path::Path;

use gearmodel::Direction;

use crate::{
    error::LogError,
    proto::{Phase, RigState},
};

/// A run as `/rig/state` states it: a sample belongs to it if `start_ns <= t < end_ns`, in device time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSpan {
    /// The driver's sense.
    pub direction: Direction,
    /// Load set-point.
    pub load_nm: f64,
    /// Speed set-point.
    pub speed_rpm: f64,
    /// Device time of the first sample.
    pub start_ns: u64,
    /// Device time of the first sample after it; `None` where the log breaks off inside.
    pub end_ns: Option<u64>,
}

impl RunSpan {
    /// Whether the sample taken at `time_ns` belongs to the run.
    pub fn contains(&self, time_ns: u64) -> bool {
        time_ns >= self.start_ns && self.end_ns.is_none_or(|end_ns| time_ns < end_ns)
    }
}

/// What was counted in a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RunTotals {
    /// Samples read.
    pub samples: u64,
    /// Samples that the running number says are missing.
    pub losses: u64,
    /// Turns of the driver between the first and the last sample.
    pub revolutions: f64,
}

/// The runs that a sequence of states with their device times describes.
pub(crate) fn spans(mut states: Vec<(u64, RigState)>, path: &Path) -> Result<Vec<RunSpan>, LogError> {
    // States of one instant keep their order in the file: the last one holds.
    states.sort_by_key(|&(at_ns, _)| at_ns);
    let mut spans: Vec<RunSpan> = Vec::new();
    let mut recording = false;
    for (at_ns, state) in states {
        let set_points = (state.load_setpoint_nm, state.speed_setpoint_rpm);
        let direction = match state.phase() {
            Phase::Record => {
                Some(state.direction().sense().ok_or_else(|| LogError::NoDirection { path: path.to_owned(), at_ns })?)
            }
            _ => None,
        };
        if recording && let Some(run) = spans.last_mut() {
            if direction == Some(run.direction) && set_points == (run.load_nm, run.speed_rpm) {
                continue;
            }
            run.end_ns = Some(at_ns);
        }
        recording = direction.is_some();
        if let Some(direction) = direction {
            let (load_nm, speed_rpm) = set_points;
            spans.push(RunSpan { direction, load_nm, speed_rpm, start_ns: at_ns, end_ns: None });
        }
    }
    // States that replace each other within one instant leave runs that hold no time.
    spans.retain(|span| span.end_ns.is_none_or(|end_ns| end_ns > span.start_ns));
    Ok(spans)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::proto;

    fn state(phase: Phase, direction: proto::Direction, load_nm: f64) -> RigState {
        RigState {
            phase: phase.into(),
            direction: direction.into(),
            load_setpoint_nm: load_nm,
            speed_setpoint_rpm: 5.0,
            ..Default::default()
        }
    }

    #[test]
    fn runs_begin_and_end_where_phase_direction_or_load_change() {
        use Phase::*;
        use proto::Direction::{Ccw, Cw};
        let states = vec![
            (10, state(Settle, Ccw, 10.0)),
            (20, state(Record, Ccw, 10.0)),
            (30, state(Record, Ccw, 10.0)),
            (40, state(Record, Ccw, 15.0)),
            (50, state(Stopping, Ccw, 15.0)),
            (60, state(Record, Cw, 15.0)),
        ];
        let runs = spans(states, Path::new("x")).unwrap();
        let seen: Vec<_> = runs.iter().map(|r| (r.direction, r.load_nm, r.start_ns, r.end_ns)).collect();
        assert_eq!(
            seen,
            [
                (Direction::Ccw, 10.0, 20, Some(40)),
                (Direction::Ccw, 15.0, 40, Some(50)),
                (Direction::Cw, 15.0, 60, None),
            ]
        );
        assert!(runs[0].contains(20) && runs[0].contains(39) && !runs[0].contains(40));
        assert!(runs[2].contains(u64::MAX));
    }

    #[test]
    fn a_pause_makes_two_runs() {
        use proto::Direction::Ccw;
        let states = vec![
            (1, state(Phase::Record, Ccw, 5.0)),
            (2, state(Phase::Settle, Ccw, 5.0)),
            (3, state(Phase::Record, Ccw, 5.0)),
            (4, state(Phase::Idle, Ccw, 5.0)),
        ];
        assert_eq!(spans(states, Path::new("x")).unwrap().len(), 2);
    }

    #[test]
    fn recording_without_a_direction_is_an_error_with_its_time() {
        let states = vec![(7, state(Phase::Record, proto::Direction::Unspecified, 5.0))];
        let text = spans(states, Path::new("a.mcap")).unwrap_err().to_string();
        assert!(text.contains("7 ns") && text.contains("a.mcap"), "{text}");
    }
}
