//! Why a run ends before its time.

use thiserror::Error;

use super::admission::Refusal;
use super::limits::Exceeded;
use super::supervisor::{Event, State};
use crate::device::drivers::UnknownDriver;
use crate::device::{BusError, DeviceError, DeviceKind};
use crate::link::LinkError;

/// Why a run ends before its time.
#[derive(Debug, Error)]
pub enum StopReason {
    /// Ctrl-C, SIGTERM or `rigd stop`.
    #[error("stopped by the operator")]
    Operator,
    /// A limit of the profile.
    #[error(transparent)]
    Limit(#[from] Exceeded),
    /// The run was never within the profile's limits.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// A device failed or is lost.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// A port could not be opened.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The profile names a driver that there is not.
    #[error(transparent)]
    Driver(#[from] UnknownDriver),
    /// The drive says that it has a fault.
    #[error("servo alarm {alarm:#06x}; look it up in the drive's manual, remove the cause, reset the drive")]
    Alarm {
        /// The drive's code.
        alarm: u16,
    },
    /// A pause was asked for and is due.
    #[error("paused at the end of a revolution, as asked for")]
    Paused,
    /// The emergency stop was pressed.
    #[error(
        "the emergency stop was pressed (servo alarm {alarm:#06x}): remove the cause, release the button, then start or go on"
    )]
    EmergencyStop {
        /// The drive's code.
        alarm: u16,
    },
    /// No command reached the servo for longer than the lease.
    #[error(
        "no command reached the servo for {silent_s:.1} s, longer than the lease of {lease_s} s (sequence.lease_s): this program was suspended, or the computer is overloaded; the drive's watchdog has stopped the motor"
    )]
    LeaseExpired {
        /// How long.
        silent_s: f64,
        /// The lease.
        lease_s: f64,
    },
    /// Motion was asked for in a state that forbids it.
    #[error("speed {speed_rpm} rpm was refused: the supervisor is in state {state:?}, in which nothing may turn")]
    NotPermitted {
        /// The speed that was asked for, rpm of the driver.
        speed_rpm: f64,
        /// The supervisor's state.
        state: State,
    },
    /// A lost device did not come back.
    #[error("{device} did not come back within {patience_s} s: {last}")]
    NotBack {
        /// Which.
        device: DeviceKind,
        /// How long was waited.
        patience_s: f64,
        /// What it said last.
        last: String,
    },
    /// One run fails again and again.
    #[error("run {run} was begun {attempts} times and never finished, last: {last}")]
    Flapping {
        /// Which run, from 1.
        run: usize,
        /// How often it was begun.
        attempts: u32,
        /// Why it ended last.
        last: String,
    },
    /// The brake's driver has switched itself off.
    #[error(
        "brake driver: its protection has tripped (over-voltage or over-current); check the coil and its cable, then reset it at the panel"
    )]
    BrakeTripped,
    /// The encoders fell silent.
    #[error(
        "counter on {port}: no encoder sample for {silent_ms:.0} ms (limit {limit_ms:.0} ms, limits.encoder_silence_ms); check its cable and power"
    )]
    EncodersSilent {
        /// The counter's port.
        port: String,
        /// How long.
        silent_ms: f64,
        /// The limit.
        limit_ms: f64,
    },
    /// The index was not found.
    #[error(
        "the index of the {which} encoder was not seen in {turns:.1} turns of the driver; check its index line and that its shaft turns"
    )]
    NoIndex {
        /// Which encoder.
        which: &'static str,
        /// How far the driver turned.
        turns: f64,
    },
    /// Readers without an index were lost, and with them the zero.
    #[error(
        "counter on {port}: its readers have no index, and since the zero was taken their stream was lost, so that the angles cannot be found again: put the pair at its zero (or measure counter.qsb.zero_counts anew) and begin a new run"
    )]
    ZeroLost {
        /// The counter's port.
        port: String,
    },
    /// Something took too long.
    #[error(
        "{what} took longer than {seconds:.0} s (now {now}); is the shaft blocked, or a limit of the drive too low?"
    )]
    TooLong {
        /// What.
        what: &'static str,
        /// How long was waited.
        seconds: f64,
        /// Where it stands.
        now: String,
    },
    /// A defect of this program.
    #[error("this program failed: {what}; the rig was switched off in order; please report it with the log")]
    Panic {
        /// The panic's message.
        what: String,
    },
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] riglog::LogError),
    /// The campaign's journal cannot be written.
    #[error(transparent)]
    Journal(#[from] crate::campaign::CampaignError),
}

impl StopReason {
    /// What it means to the supervisor.
    #[must_use]
    pub fn event(&self) -> Event {
        match self {
            Self::Operator => Event::OperatorStop,
            Self::Paused => Event::Finished,
            Self::Limit(_) => Event::Limit,
            Self::EmergencyStop { .. } => Event::EmergencyStop,
            Self::LeaseExpired { .. } => Event::LeaseExpired,
            _ => match self.lost_device() {
                Some(DeviceKind::Servo) => Event::ServoLost,
                Some(DeviceKind::Brake) => Event::BrakeLost,
                Some(DeviceKind::Counter) => Event::EncodersLost,
                None => Event::Fault,
            },
        }
    }

    /// The device that does not answer any more, where that is the reason: it may come back.
    #[must_use]
    pub fn lost_device(&self) -> Option<DeviceKind> {
        match self {
            Self::Device(error) => lost_device(error),
            Self::EncodersSilent { .. } => Some(DeviceKind::Counter),
            Self::NotBack { device, .. } => Some(*device),
            _ => None,
        }
    }
}

/// The device that an error says is gone; `None` for one that answers, but not as it should.
#[must_use]
pub fn lost_device(error: &DeviceError) -> Option<DeviceKind> {
    match error {
        DeviceError::Bus(
            BusError::Silent { device, .. } | BusError::Damaged { device, .. } | BusError::HungUp { device, .. },
        ) => Some(*device),
        DeviceError::Counter { .. } => Some(DeviceKind::Counter),
        _ => None,
    }
}
