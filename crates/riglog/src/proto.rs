//! The messages of the rig log, generated from `proto/rig.proto` and `proto/foxglove/Log.proto` by `just proto`.

/// Text lines as every MCAP viewer knows them.
#[allow(missing_docs, clippy::all, clippy::pedantic, unused_qualifications)]
pub mod foxglove {
    include!("../proto/generated/foxglove.rs");
}

#[allow(missing_docs, clippy::all, clippy::pedantic, unused_qualifications)]
mod rig {
    include!("../proto/generated/rig.rs");
}

// The generated modules refer to each other by `super::google::protobuf`.
#[allow(missing_docs, clippy::all, clippy::pedantic, unused_qualifications, dead_code)]
mod google {
    pub mod protobuf {
        include!("../proto/generated/google.protobuf.rs");
    }
}

pub use foxglove::log::Level;
pub use google::protobuf::Timestamp;
pub use rig::{AngleBatch, Backlash, Direction, Phase, RigState, TransmissionError};

const NS_PER_S: u64 = 1_000_000_000;

impl Timestamp {
    /// The time `ns` nanoseconds after the Unix epoch.
    pub fn from_ns(ns: u64) -> Self {
        // Both parts fit: u64::MAX ns are 1.8e10 s, and the rest is below 1e9.
        Self { seconds: (ns / NS_PER_S) as i64, nanos: (ns % NS_PER_S) as i32 }
    }

    /// Nanoseconds after the Unix epoch; `None` before 1970, after 2554 or with nanoseconds out of range.
    pub fn as_ns(&self) -> Option<u64> {
        let seconds = u64::try_from(self.seconds).ok()?;
        let nanos = u64::try_from(self.nanos).ok().filter(|&nanos| nanos < NS_PER_S)?;
        seconds.checked_mul(NS_PER_S)?.checked_add(nanos)
    }
}

impl Direction {
    /// The model's name of this sense of the driver; `None` where the message leaves it open.
    pub fn sense(self) -> Option<gearmodel::Direction> {
        match self {
            Self::Unspecified => None,
            Self::Ccw => Some(gearmodel::Direction::Ccw),
            Self::Cw => Some(gearmodel::Direction::Cw),
        }
    }
}

impl From<gearmodel::Direction> for Direction {
    fn from(sense: gearmodel::Direction) -> Self {
        match sense {
            gearmodel::Direction::Ccw => Self::Ccw,
            gearmodel::Direction::Cw => Self::Cw,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stamps_keep_every_nanosecond() {
        for ns in [0, 1, NS_PER_S - 1, NS_PER_S, 1_790_000_000_123_456_789, u64::MAX] {
            assert_eq!(Timestamp::from_ns(ns).as_ns(), Some(ns));
        }
    }

    #[test]
    fn foreign_time_stamps_out_of_range_are_refused() {
        for (seconds, nanos) in [(-1, 0), (0, -1), (0, 1_000_000_000), (i64::MAX, 0)] {
            assert_eq!(Timestamp { seconds, nanos }.as_ns(), None);
        }
    }
}
