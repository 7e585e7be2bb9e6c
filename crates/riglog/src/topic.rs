//! The channels of a rig log: topic, message type and self-describing schema.

/// A channel of the rig log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Topic {
    /// `/rig/angles`: raw counts of both encoders at the full rate.
    Angles,
    /// `/rig/state`: phase, set-points and readings of the drives.
    State,
    /// `/rig/te`: transmission error, one raw sample an angle bin and sense.
    Te,
    /// `/rig/backlash`: difference of both senses, one an angle bin.
    Backlash,
    /// `/rig/events`: text lines.
    Events,
}

/// Schema of the messages of package `rig`, with everything that it imports.
const RIG_DESCRIPTORS: &[u8] = include_bytes!("../proto/generated/rig.fds");
/// Schema of `foxglove.Log`, with everything that it imports.
const LOG_DESCRIPTORS: &[u8] = include_bytes!("../proto/generated/foxglove_log.fds");

/// Encoding of messages and schemas, as the MCAP registry names it.
pub(crate) const ENCODING: &str = "protobuf";

impl Topic {
    /// Every topic, in the order of the channel numbers.
    pub const ALL: [Self; 5] = [Self::Angles, Self::State, Self::Te, Self::Backlash, Self::Events];

    /// The topic's name in the file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Angles => "/rig/angles",
            Self::State => "/rig/state",
            Self::Te => "/rig/te",
            Self::Backlash => "/rig/backlash",
            Self::Events => "/rig/events",
        }
    }

    /// The full name of the message type.
    pub const fn schema(self) -> &'static str {
        match self {
            Self::Angles => "rig.AngleBatch",
            Self::State => "rig.RigState",
            Self::Te => "rig.TransmissionError",
            Self::Backlash => "rig.Backlash",
            Self::Events => "foxglove.Log",
        }
    }

    /// The encoded `FileDescriptorSet` that describes the message type.
    pub const fn descriptors(self) -> &'static [u8] {
        match self {
            Self::Events => LOG_DESCRIPTORS,
            _ => RIG_DESCRIPTORS,
        }
    }

    /// The number of channel and schema in files written here; the format leaves 0 to "no schema".
    pub(crate) const fn id(self) -> u16 {
        self as u16 + 1
    }

    /// The topic that a foreign file's channel carries; the name alone does not make it ours.
    pub(crate) fn of_channel(topic: &str, schema: &str, encoding: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == topic && t.schema() == schema && encoding == ENCODING)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_is_known_by_name_type_and_encoding_together() {
        for topic in Topic::ALL {
            assert_eq!(Topic::of_channel(topic.name(), topic.schema(), ENCODING), Some(topic));
            assert_eq!(Topic::of_channel(topic.name(), "std_msgs/String", ENCODING), None);
            assert_eq!(Topic::of_channel(topic.name(), topic.schema(), "json"), None);
        }
    }

    #[test]
    fn schemas_carry_their_imports() {
        let timestamp = b"google/protobuf/timestamp.proto";
        for topic in Topic::ALL {
            let found = topic.descriptors().windows(timestamp.len()).filter(|w| w == timestamp).count();
            assert!(found >= 2, "{}: import and definition", topic.name());
        }
    }
}
