//! Are all samples there, by their numbers, and all messages, by those of their channels?

use std::path::Path;

use super::{FindingKind, Findings};
use crate::{proto::AngleBatch, topic::Topic};

/// Follows the numbers through all parts of a log.
#[derive(Debug, Default)]
pub(super) struct SequenceAudit {
    /// Number that the next sample shall have; `None` before the first.
    expected: Option<u64>,
    first_sample: u64,
    samples: u64,
    losses: u64,
    repeated: u64,
    /// Number of the last message of each channel.
    last: [Option<u32>; Topic::ALL.len()],
    /// Channels that had a message in this part.
    met: [bool; Topic::ALL.len()],
}

impl SequenceAudit {
    pub(super) fn samples(&self) -> u64 {
        self.samples
    }

    pub(super) fn first_sample(&self) -> u64 {
        self.first_sample
    }

    pub(super) fn losses(&self) -> u64 {
        self.losses
    }

    pub(super) fn repeated(&self) -> u64 {
        self.repeated
    }

    /// The first message of a channel in the next part may repeat the last one before.
    pub(super) fn begin_part(&mut self) {
        self.met = [false; Topic::ALL.len()];
    }

    /// Takes the number of a message; `false` for one that was repeated at a part's beginning.
    pub(super) fn message(&mut self, topic: Topic, number: u32, path: &Path, findings: &mut Findings) -> bool {
        let channel = topic as usize;
        let first = !std::mem::replace(&mut self.met[channel], true);
        let before = self.last[channel].replace(number);
        let expected = before.map_or(0, |before| before.wrapping_add(1));
        if number == expected {
            return true;
        }
        if first && before == Some(number) {
            return false;
        }
        // Programs that do not number their messages write 0 throughout; so does the format allow.
        if number == 0 && before.is_none_or(|before| before == 0) {
            return true;
        }
        let what = format!("{}: message {number} where {expected} was expected", topic.name());
        findings.add(FindingKind::Messages, path, what);
        true
    }

    /// Takes a batch that was validated.
    pub(super) fn batch(&mut self, batch: &AngleBatch, path: &Path, findings: &mut Findings) {
        let (first, count) = (batch.first_sample, batch.len() as u64);
        self.samples += count;
        let expected = match self.expected {
            Some(expected) => expected,
            None => {
                self.first_sample = first;
                first
            }
        };
        if first > expected {
            let missing = first - expected;
            self.losses = self.losses.saturating_add(missing);
            let what = format!("samples {expected} to {} are missing ({missing})", first - 1);
            findings.add(FindingKind::Samples, path, what);
        } else if first < expected {
            let twice = (expected - first).min(count);
            self.repeated += twice;
            let what = format!("{twice} samples from number {first} on stand where {expected} was expected");
            findings.add(FindingKind::Samples, path, what);
        }
        self.expected = Some(expected.max(first.saturating_add(count)));
    }
}
