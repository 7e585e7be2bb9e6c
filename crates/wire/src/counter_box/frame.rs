//! Messages of the counter box.

use crate::samples::Samples;

/// Number by which a host tells answers apart; the box repeats it.
pub type RequestId = u16;

/// Any message, either way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Frame {
    /// Host to box.
    Command(Command),
    /// Box to host: who it is.
    Identity(Identity),
    /// Box to host: a command was taken or refused.
    Ack(Ack),
    /// Box to host: counts.
    Samples(Samples),
}

/// What a host asks of the box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Send an [`Identity`].
    Identify {
        /// Repeated in the answer.
        request_id: RequestId,
    },
    /// Start sampling; answered by an [`Ack`]. Restarts when it is running: sequence and sample number go back to 0.
    Start {
        /// Repeated in the answer.
        request_id: RequestId,
        /// Time between samples, ns.
        sample_period_ns: u32,
        /// Samples in each frame, 1 to [`MAX_SAMPLES_PER_FRAME`](super::MAX_SAMPLES_PER_FRAME).
        samples_per_frame: u16,
    },
    /// Send what is pending and stop; answered by an [`Ack`].
    Stop {
        /// Repeated in the answer.
        request_id: RequestId,
    },
}

impl Command {
    /// Number that the answer repeats.
    pub fn request_id(&self) -> RequestId {
        match *self {
            Self::Identify { request_id } | Self::Start { request_id, .. } | Self::Stop { request_id } => request_id,
        }
    }
}

/// Who the box is and what is connected to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// Of the command.
    pub request_id: RequestId,
    /// Version of the format.
    pub protocol_version: u16,
    /// Input encoder: counts a revolution after interpolation; 0 when unknown.
    pub input_counts_per_rev: u64,
    /// Output encoder: counts a revolution after interpolation; 0 when unknown.
    pub output_counts_per_rev: u64,
    /// Input encoder: lines on the disc; 0 when unknown.
    pub input_lines: u32,
    /// Output encoder: lines on the disc; 0 when unknown.
    pub output_lines: u32,
    /// Highest rate of samples, Hz.
    pub max_sample_rate_hz: u32,
    /// What the box is doing.
    pub status: BoxStatus,
    /// Serial number, at most [`MAX_TEXT`](super::MAX_TEXT) bytes.
    pub serial: String,
    /// Firmware, at most [`MAX_TEXT`](super::MAX_TEXT) bytes.
    pub firmware: String,
}

/// Bits of the box's state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct BoxStatus(pub u16);

impl BoxStatus {
    /// It is sampling.
    pub const RUNNING: u16 = 1 << 0;
    /// The input encoder's signals are bad.
    pub const INPUT_FAULT: u16 = 1 << 1;
    /// The output encoder's signals are bad.
    pub const OUTPUT_FAULT: u16 = 1 << 2;

    /// Whether all of these bits are set.
    pub fn has(self, bits: u16) -> bool {
        self.0 & bits == bits
    }
}

/// Answer to start and stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ack {
    /// Of the command.
    pub request_id: RequestId,
    /// What became of it.
    pub status: AckStatus,
}

/// What became of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AckStatus {
    /// 0: done.
    Done,
    /// 1: the sample period is 0 or shorter than the box can.
    BadPeriod,
    /// 2: the samples per frame are 0 or too many.
    BadFrameSize,
    /// 3: the box does not know the command.
    UnknownCommand,
    /// Any other code.
    Other(u8),
}

impl AckStatus {
    /// The byte on the wire.
    pub fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::BadPeriod => 1,
            Self::BadFrameSize => 2,
            Self::UnknownCommand => 3,
            Self::Other(code) => code,
        }
    }

    /// From the byte on the wire.
    pub fn from_code(code: u8) -> Self {
        match code {
            0 => Self::Done,
            1 => Self::BadPeriod,
            2 => Self::BadFrameSize,
            3 => Self::UnknownCommand,
            other => Self::Other(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ack_codes_round_trip() {
        for code in 0..=255 {
            assert_eq!(AckStatus::from_code(code).code(), code);
        }
    }
}
