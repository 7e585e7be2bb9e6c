//! Why a run ends before its time.

use thiserror::Error;

use crate::device::{DeviceError, UnknownDriver};
use crate::link::LinkError;

/// Why a run ends before its time.
#[derive(Debug, Error)]
pub enum Halt {
    /// Ctrl-C, SIGTERM or `rigd stop`.
    #[error("stopped by the operator")]
    Operator,
    /// A limit of the profile.
    #[error("{quantity} {value:.4} {unit} is over the limit {limit} {unit} of the profile ({key}); {advice}")]
    Limit {
        /// What went over.
        quantity: &'static str,
        /// How far.
        value: f64,
        /// The limit.
        limit: f64,
        /// Unit of both.
        unit: &'static str,
        /// The profile's key.
        key: &'static str,
        /// What to do next.
        advice: &'static str,
    },
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
}
