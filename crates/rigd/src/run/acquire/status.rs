//! What the sequencer knows of the rig, and what the encoders said last.

use gearmodel::Direction;
use riglog::proto::{self, Phase, RigState, Timestamp};

/// What the sequencer knows of the rig; written to `/rig/state`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Status {
    /// Where the run is.
    pub phase: Phase,
    /// Sense of the run.
    pub direction: Option<Direction>,
    /// Speed that was asked for, rpm of the driver.
    pub speed_setpoint_rpm: f64,
    /// Load that was asked for, N·m at the driven gear.
    pub load_setpoint_nm: f64,
    /// Load by the brake's calibrated curve, N·m.
    pub load_nm: f64,
    /// Coil current, A.
    pub brake_current_a: f64,
    /// Temperature, °C.
    pub brake_temperature_c: f64,
    /// The drive's alarm.
    pub servo_alarm: u16,
}

impl Status {
    /// As `/rig/state` has it, dated `time_ns`.
    pub(super) fn message(&self, speed_rpm: f64, time_ns: u64, samples: u64, samples_lost: u64) -> RigState {
        RigState {
            timestamp: Some(Timestamp::from_ns(time_ns)),
            phase: self.phase.into(),
            direction: self.direction.map_or(proto::Direction::Unspecified, proto::Direction::from).into(),
            speed_setpoint_rpm: self.speed_setpoint_rpm,
            speed_rpm,
            load_setpoint_nm: self.load_setpoint_nm,
            load_nm: self.load_nm,
            brake_current_a: self.brake_current_a,
            brake_temperature_c: self.brake_temperature_c,
            servo_alarm: u32::from(self.servo_alarm),
            samples,
            samples_lost,
        }
    }
}

/// Latest values, for the progress line and the supervisor.
#[derive(Debug, Clone, Copy, Default)]
pub struct Latest {
    /// Host time of the last batch, ns since the Unix epoch.
    pub arrived_ns: u64,
    /// Device time of the last sample, ns since the Unix epoch.
    pub sample_ns: u64,
    /// Driver speed from the encoder over the last batch, rpm, + = ccw.
    pub speed_rpm: f64,
    /// θ1, rad, from the index once homed, else from the start.
    pub theta1_rad: f64,
    /// Latest TE, rad.
    pub te_rad: f64,
    /// Smallest and largest TE of the active run, rad.
    pub te_range_rad: [f64; 2],
    /// Latest backlash, rad; once the other sense has been recorded at this load.
    pub backlash_rad: Option<f64>,
    /// Revolutions of the active run.
    pub revolutions: f64,
    /// TE less the model's at the last sample, rad; NaN unless the rig settles.
    pub residual_rad: f64,
    /// Largest |TE − model − zero| of the active run, rad: polls are rarer than batches, and none may be missed.
    pub excursion_rad: f64,
}
