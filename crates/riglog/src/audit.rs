//! The audit of a log: checksums, sequence and clock. It trusts no counter that the recorder kept; where the recorder's own count of
//! losses differs from what the numbers say, that is a finding, too.

mod clock;
mod sequence;

use std::path::{Path, PathBuf};

use prost::Message as _;

use self::{clock::ClockAudit, sequence::SequenceAudit};
use crate::{
    completeness::Completeness,
    error::LogError,
    parts::{LogParts, PartMetadata},
    proto::{AngleBatch, RigState},
    reader::{bad_message, check_channels, open},
    topic::Topic,
    walk::{Event, Walk},
};

/// What kind of fault a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FindingKind {
    /// A checksum does not match, or bytes are no record.
    Damage,
    /// The file stops short, or a part is missing.
    Truncation,
    /// Samples are missing, stand twice or out of order.
    Samples,
    /// Messages are missing, by the numbers of their channel.
    Messages,
    /// Time runs back, or host and device disagree by more than a cable's delay.
    Clock,
    /// The recorder's own count of losses is not what the numbers say.
    Account,
}

impl FindingKind {
    /// The kind as scripts read it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Damage => "damage",
            Self::Truncation => "truncation",
            Self::Samples => "samples",
            Self::Messages => "messages",
            Self::Clock => "clock",
            Self::Account => "account",
        }
    }
}

/// One fault and where it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What kind it is.
    pub kind: FindingKind,
    /// The file.
    pub path: PathBuf,
    /// What was found, in words.
    pub what: String,
}

/// What an audit found out about a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Audit {
    /// The files, in order.
    pub parts: Vec<PathBuf>,
    /// Their size.
    pub bytes: u64,
    /// Messages read.
    pub messages: u64,
    /// Samples read.
    pub samples: u64,
    /// Number of the first sample: 0, but in the later logs of a campaign, whose counter goes on.
    pub first_sample: u64,
    /// Samples missing by their numbers from the first one on.
    pub losses: u64,
    /// Samples that stand twice or out of order.
    pub repeated: u64,
    /// Losses as the recorder counted them from the first state to the last; `None` where no state says.
    pub losses_told: Option<u64>,
    /// Device time from first to last sample, s.
    pub device_s: f64,
    /// Rate of the device's clock against the host's less one, in parts per million; `None` for logs under a minute.
    pub drift_ppm: Option<f64>,
    /// Largest delay of a batch beyond the fastest one near it, ms.
    pub largest_delay_ms: f64,
    /// Every fault, at most `MAX_FINDINGS` of a kind.
    pub findings: Vec<Finding>,
    /// Findings that were not listed.
    pub more_findings: u64,
}

/// Findings of one kind that are listed.
pub const MAX_FINDINGS: usize = 20;

impl Audit {
    /// Whether there is nothing to find fault with.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.findings.is_empty()
    }
}

/// Gathers findings, and counts those that nobody would read.
#[derive(Default)]
struct Findings {
    list: Vec<Finding>,
    more: u64,
}

impl Findings {
    fn add(&mut self, kind: FindingKind, path: &Path, what: String) {
        if self.list.iter().filter(|finding| finding.kind == kind).count() < MAX_FINDINGS {
            self.list.push(Finding { kind, path: path.to_owned(), what });
        } else {
            self.more += 1;
        }
    }
}

/// Audits a log with all its parts.
///
/// # Errors
/// A file cannot be read or is no rig log. What is wrong inside is a finding.
pub fn audit(parts: &LogParts) -> Result<Audit, LogError> {
    let mut findings = Findings::default();
    let mut sequence = SequenceAudit::default();
    let mut clock = ClockAudit::default();
    let (mut bytes, mut messages, mut continued) = (0, 0, false);
    // What the first state told, what the last one told, and what was missing by the numbers when it did: a campaign's later logs begin with the
    // losses of the earlier ones.
    let mut told: Option<(u64, u64, u64)> = None;
    for path in parts.paths() {
        let (source, part_bytes) = open(path)?;
        check_channels(Walk::new(source, part_bytes, path)?)?;
        let mut walk = Walk::new(open(path)?.0, part_bytes, path)?;
        bytes += part_bytes;
        continued = false;
        sequence.begin_part();
        while let Some(event) = walk.next()? {
            match event {
                Event::Message { chunk_at, topic: Some(topic), message, .. } => {
                    let log_ns = message.log_time_ns;
                    if sequence.message(topic, message.header.sequence, path, &mut findings) {
                        messages += 1;
                    }
                    let bad = |source| bad_message(path, topic, log_ns, chunk_at, source);
                    match topic {
                        Topic::Angles => {
                            let decoded = AngleBatch::decode(message.data).map_err(bad);
                            let batch =
                                match decoded.and_then(|batch| batch.validate().map(|()| batch).map_err(Into::into)) {
                                    Ok(batch) => batch,
                                    Err(error) => {
                                        findings.add(FindingKind::Damage, path, error.to_string());
                                        continue;
                                    }
                                };
                            sequence.batch(&batch, path, &mut findings);
                            clock.batch(&batch, log_ns, path, &mut findings);
                        }
                        Topic::State => match RigState::decode(message.data) {
                            Ok(state) => {
                                let first = told.map_or(state.samples_lost, |(first, ..)| first);
                                told = Some((first, state.samples_lost, sequence.losses()));
                            }
                            Err(source) => findings.add(FindingKind::Damage, path, bad(source).to_string()),
                        },
                        _ => {}
                    }
                }
                Event::Message { .. } => messages += 1,
                Event::Metadata { name, .. } if name == PartMetadata::CONTINUED => continued = true,
                _ => {}
            }
        }
        match walk.completeness() {
            Some(whole @ Completeness::Damaged { .. }) => findings.add(FindingKind::Damage, path, whole.to_string()),
            Some(whole @ Completeness::Truncated { .. }) => {
                findings.add(FindingKind::Truncation, path, format!("{whole}; `rigd recover` gives it its end"));
            }
            _ => {}
        }
    }
    if let Some(missing) = parts.missing(continued) {
        findings.add(FindingKind::Truncation, parts.first(), missing.to_string());
    }
    clock.end(parts.first(), &mut findings);
    let found = sequence.losses();
    // The state may know of a loss whose next batch is not written yet, and be older than the last loss.
    let losses_told = told.map(|(first, last, _)| last.saturating_sub(first));
    if let Some((told, known)) = losses_told.zip(told.map(|(_, _, known)| known))
        && (told < known || told > found)
    {
        let what = format!("the recorder counted {told} lost samples, their numbers say {found}");
        findings.add(FindingKind::Account, parts.first(), what);
    }
    Ok(Audit {
        parts: parts.paths().map(Path::to_owned).collect(),
        bytes,
        messages,
        samples: sequence.samples(),
        first_sample: sequence.first_sample(),
        losses: found,
        repeated: sequence.repeated(),
        losses_told,
        device_s: clock.device_s(),
        drift_ppm: clock.drift_ppm(),
        largest_delay_ms: clock.largest_delay_ms(),
        findings: findings.list,
        more_findings: findings.more,
    })
}
