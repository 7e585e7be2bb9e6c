//! Messages to bytes, into buffers that are used again.

use thiserror::Error;

use super::frame::{Ack, Command, Frame, Identity};
use super::{CRC, MAX_SAMPLES_PER_FRAME, MAX_TEXT, SAMPLES_HEAD, kind, varint};
use crate::samples::Samples;

/// A message that the format cannot carry.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// No samples, or more than a frame may carry.
    #[error("a samples frame of {count} samples; 1 to {limit} fit: split the batch")]
    SampleCount {
        /// Samples given.
        count: usize,
        /// Most a frame may carry.
        limit: u16,
    },
    /// The two channels differ in length.
    #[error("a samples frame of {input} input and {output} output deltas: give both the same length")]
    UnequalChannels {
        /// Input deltas.
        input: usize,
        /// Output deltas.
        output: usize,
    },
    /// The first delta of a channel is not zero.
    #[error("the first {channel} delta is {delta} counts instead of 0: put it into the base")]
    FirstDelta {
        /// Which channel.
        channel: &'static str,
        /// The delta.
        delta: i32,
    },
    /// A text is too long.
    #[error("the {field} text has {len} bytes, at most {limit} fit: shorten it")]
    Text {
        /// Which text.
        field: &'static str,
        /// Its length, bytes.
        len: usize,
        /// Longest, bytes.
        limit: usize,
    },
}

/// Turns messages into bytes. Keeps its work space, so encoding a stream does not allocate.
#[derive(Debug, Clone, Default)]
pub struct Encoder {
    plain: Vec<u8>,
}

impl Encoder {
    /// An encoder.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends a message of any kind, delimiter included, to `out`.
    ///
    /// # Errors
    /// [`EncodeError`] when the format cannot carry it; `out` is untouched then.
    pub fn frame(&mut self, frame: &Frame, out: &mut Vec<u8>) -> Result<(), EncodeError> {
        match frame {
            Frame::Command(command) => self.command(command, out),
            Frame::Identity(identity) => return self.identity(identity, out),
            Frame::Ack(ack) => self.ack(ack, out),
            Frame::Samples(samples) => return self.samples(samples, out),
        }
        Ok(())
    }

    /// Appends a command.
    pub fn command(&mut self, command: &Command, out: &mut Vec<u8>) {
        let kind = match command {
            Command::Identify { .. } => kind::IDENTIFY,
            Command::Start { .. } => kind::START,
            Command::Stop { .. } => kind::STOP,
        };
        self.begin(kind);
        self.put(&command.request_id().to_le_bytes());
        if let Command::Start { sample_period_ns, samples_per_frame, .. } = command {
            self.put(&sample_period_ns.to_le_bytes());
            self.put(&samples_per_frame.to_le_bytes());
        }
        self.finish(out);
    }

    /// Appends an acknowledgement.
    pub fn ack(&mut self, ack: &Ack, out: &mut Vec<u8>) {
        self.begin(kind::ACK);
        self.put(&ack.request_id.to_le_bytes());
        self.put(&[ack.status.code()]);
        self.finish(out);
    }

    /// Appends an identity.
    ///
    /// # Errors
    /// [`EncodeError::Text`] when a text is too long.
    pub fn identity(&mut self, identity: &Identity, out: &mut Vec<u8>) -> Result<(), EncodeError> {
        let texts = [("serial", identity.serial.as_bytes()), ("firmware", identity.firmware.as_bytes())];
        for (field, text) in texts {
            if text.len() > MAX_TEXT {
                return Err(EncodeError::Text { field, len: text.len(), limit: MAX_TEXT });
            }
        }
        self.begin(kind::IDENTITY);
        self.put(&identity.request_id.to_le_bytes());
        self.put(&identity.protocol_version.to_le_bytes());
        self.put(&identity.input_counts_per_rev.to_le_bytes());
        self.put(&identity.output_counts_per_rev.to_le_bytes());
        self.put(&identity.input_lines.to_le_bytes());
        self.put(&identity.output_lines.to_le_bytes());
        self.put(&identity.max_sample_rate_hz.to_le_bytes());
        self.put(&identity.status.0.to_le_bytes());
        for (_, text) in texts {
            // Checked above: MAX_TEXT fits a byte.
            self.put(&[text.len() as u8]);
            self.put(text);
        }
        self.finish(out);
        Ok(())
    }

    /// Appends a batch of samples.
    ///
    /// # Errors
    /// [`EncodeError`] for an empty, too long, unequal or wrongly based batch.
    pub fn samples(&mut self, samples: &Samples, out: &mut Vec<u8>) -> Result<(), EncodeError> {
        let count = check(samples)?;
        self.begin(kind::SAMPLES);
        self.put(&samples.sequence.to_le_bytes());
        self.put(&samples.device_time_ns.to_le_bytes());
        self.put(&samples.dt_ns.to_le_bytes());
        self.put(&samples.first_sample.to_le_bytes());
        self.put(&samples.flags.0.to_le_bytes());
        self.put(&samples.input_index_counts.to_le_bytes());
        self.put(&samples.output_index_counts.to_le_bytes());
        self.put(&samples.input_base.to_le_bytes());
        self.put(&samples.output_base.to_le_bytes());
        self.put(&count.to_le_bytes());
        debug_assert_eq!(self.plain.len(), SAMPLES_HEAD);
        self.plain.resize(SAMPLES_HEAD + 2 * varint::MAX_LEN * usize::from(count), 0);
        let middle = varint::write(&mut self.plain, SAMPLES_HEAD, &samples.input_delta);
        let end = varint::write(&mut self.plain, middle, &samples.output_delta);
        self.plain.truncate(end);
        self.finish(out);
        Ok(())
    }

    fn begin(&mut self, kind: u8) {
        self.plain.clear();
        self.plain.push(kind);
    }

    fn put(&mut self, bytes: &[u8]) {
        self.plain.extend_from_slice(bytes);
    }

    /// CRC, stuffing, delimiter.
    fn finish(&mut self, out: &mut Vec<u8>) {
        let crc = CRC.checksum(&self.plain);
        self.plain.extend_from_slice(&crc.to_le_bytes());
        stuff(&self.plain, out);
        out.push(0);
    }
}

fn check(samples: &Samples) -> Result<u16, EncodeError> {
    let (input, output) = (samples.input_delta.len(), samples.output_delta.len());
    if input != output {
        return Err(EncodeError::UnequalChannels { input, output });
    }
    for (channel, deltas) in [("input", &samples.input_delta), ("output", &samples.output_delta)] {
        if let Some(&delta) = deltas.first().filter(|delta| **delta != 0) {
            return Err(EncodeError::FirstDelta { channel, delta });
        }
    }
    match u16::try_from(input) {
        Ok(count) if count != 0 && count <= MAX_SAMPLES_PER_FRAME => Ok(count),
        _ => Err(EncodeError::SampleCount { count: input, limit: MAX_SAMPLES_PER_FRAME }),
    }
}

/// Appends `plain` with its zeros taken out by COBS.
fn stuff(plain: &[u8], out: &mut Vec<u8>) {
    let start = out.len();
    out.resize(start + cobs::max_encoding_length(plain.len()), 0);
    let len = cobs::encode(plain, &mut out[start..]);
    out.truncate(start + len);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_format_cannot_carry_is_refused_and_leaves_no_bytes() {
        let mut encoder = Encoder::new();
        let mut out = vec![7];
        let batch = |input: Vec<i32>, output: Vec<i32>| Samples {
            input_delta: input,
            output_delta: output,
            ..Samples::default()
        };
        let bad = [
            batch(vec![], vec![]),
            batch(vec![0], vec![]),
            batch(vec![1], vec![0]),
            batch(vec![0; 1025], vec![0; 1025]),
        ];
        for samples in bad {
            assert!(encoder.samples(&samples, &mut out).is_err());
        }
        let long = Identity { serial: "x".repeat(65), ..identity() };
        assert!(encoder.identity(&long, &mut out).unwrap_err().to_string().contains("serial text has 65 bytes"));
        assert_eq!(out, [7]);
    }

    fn identity() -> Identity {
        Identity {
            request_id: 0,
            protocol_version: 1,
            input_counts_per_rev: 0,
            output_counts_per_rev: 0,
            input_lines: 0,
            output_lines: 0,
            max_sample_rate_hz: 0,
            status: super::super::BoxStatus(0),
            serial: String::new(),
            firmware: String::new(),
        }
    }
}
