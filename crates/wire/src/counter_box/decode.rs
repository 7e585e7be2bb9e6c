//! Bytes to messages, whatever the pieces in which they come and whatever happens to them.

use super::body::{self, MalformedFrame};
use super::frame::Frame;
use super::{CRC, MAX_STUFFED};

/// What a decoder has seen.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct StreamStats {
    /// Good frames.
    pub frames: u64,
    /// Frames whose CRC did not fit.
    pub crc_errors: u64,
    /// Frames that were damaged in their stuffing, too long, too short, or not what their type says.
    pub malformed: u64,
    /// Bytes of frames that were not used.
    pub bytes_skipped: u64,
    /// Frames missing between good samples frames, by their sequence number.
    pub sequence_gaps: u64,
    /// Samples missing between good samples frames, by their running number.
    pub samples_lost: u64,
    /// The latest frame with a good CRC that could not be understood.
    pub last_malformed: Option<MalformedFrame>,
}

/// Finds frames in a byte stream. Damage costs the frame it hits: the next delimiter starts anew. Holds at most one
/// longest frame.
#[derive(Debug, Clone, Default)]
pub struct StreamDecoder {
    /// Head of a frame whose delimiter has not come yet.
    pending: Vec<u8>,
    /// The pending frame is longer than any frame can be; it is being skipped.
    overlong: bool,
    /// Work space for unstuffing.
    plain: Vec<u8>,
    /// Sequence number and first sample that the next samples frame should have.
    expected: Option<(u32, u64)>,
    stats: StreamStats,
}

impl StreamDecoder {
    /// A decoder at the start of a stream. If that is in the middle of a frame, the frame counts as damaged.
    pub fn new() -> Self {
        Self::default()
    }

    /// What has been seen so far.
    pub fn stats(&self) -> &StreamStats {
        &self.stats
    }

    /// Forgets the pending bytes and where the samples stood; for a port that was reopened. Statistics stay.
    pub fn reset(&mut self) {
        self.pending.clear();
        self.overlong = false;
        self.expected = None;
    }

    /// Takes bytes as they arrive and appends the frames that they complete.
    pub fn feed(&mut self, mut bytes: &[u8], frames: &mut Vec<Frame>) {
        while let Some(end) = bytes.iter().position(|byte| *byte == 0) {
            let (head, tail) = (&bytes[..end], &bytes[end + 1..]);
            bytes = tail;
            if self.pending.is_empty() && !self.overlong {
                self.stuffed_frame(head, frames);
            } else {
                self.hold(head);
                let pending = std::mem::take(&mut self.pending);
                if std::mem::take(&mut self.overlong) {
                    self.stats.malformed += 1;
                } else {
                    self.stuffed_frame(&pending, frames);
                }
                self.pending = pending;
                self.pending.clear();
            }
        }
        self.hold(bytes);
    }

    /// Keeps the head of a frame, unless it is longer than a frame can be.
    fn hold(&mut self, bytes: &[u8]) {
        if self.overlong || self.pending.len() + bytes.len() > MAX_STUFFED {
            self.stats.bytes_skipped += (self.pending.len() + bytes.len()) as u64;
            self.pending.clear();
            self.overlong = true;
        } else {
            self.pending.extend_from_slice(bytes);
        }
    }

    /// Takes what stood between two delimiters.
    fn stuffed_frame(&mut self, stuffed: &[u8], frames: &mut Vec<Frame>) {
        if stuffed.is_empty() {
            // Two delimiters in a row are idle, not damage.
            return;
        }
        match self.unstuffed(stuffed) {
            Some(frame) => {
                self.stats.frames += 1;
                self.follow(&frame);
                frames.push(frame);
            }
            None => self.stats.bytes_skipped += stuffed.len() as u64,
        }
    }

    fn unstuffed(&mut self, stuffed: &[u8]) -> Option<Frame> {
        let plain = &mut self.plain;
        if plain.len() < stuffed.len() {
            plain.resize(stuffed.len(), 0);
        }
        let checked = unstuff(stuffed, plain).and_then(|len| plain[..len].split_last_chunk::<4>());
        let Some((body, crc)) = checked else {
            self.stats.malformed += 1;
            return None;
        };
        if CRC.checksum(body) != u32::from_le_bytes(*crc) {
            self.stats.crc_errors += 1;
            return None;
        }
        match body::parse(body) {
            Ok(frame) => Some(frame),
            Err(error) => {
                self.stats.malformed += 1;
                self.stats.last_malformed = Some(error);
                None
            }
        }
    }

    /// Counts what is missing before a samples frame.
    fn follow(&mut self, frame: &Frame) {
        let Frame::Samples(samples) = frame else {
            return;
        };
        // Numbers that go back are a restart of the box, not a loss.
        if let Some((sequence, first_sample)) = self.expected
            && samples.first_sample >= first_sample
        {
            self.stats.samples_lost = self.stats.samples_lost.saturating_add(samples.first_sample - first_sample);
            self.stats.sequence_gaps += u64::from(samples.sequence.wrapping_sub(sequence));
        }
        let next_sample = samples.first_sample.saturating_add(samples.len() as u64);
        self.expected = Some((samples.sequence.wrapping_add(1), next_sample));
    }
}

/// Undoes COBS; `None` if the code bytes do not add up.
fn unstuff(stuffed: &[u8], plain: &mut [u8]) -> Option<usize> {
    cobs::decode(stuffed, plain).ok().map(|report| report.frame_size())
}
