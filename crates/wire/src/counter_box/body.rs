//! Bodies of the messages: what stands between the delimiters once CRC and stuffing are off.

use thiserror::Error;

use super::frame::{Ack, AckStatus, BoxStatus, Command, Frame, Identity};
use super::{MAX_SAMPLES_PER_FRAME, MAX_TEXT, kind, varint};
use crate::samples::{SampleFlags, Samples};

/// A frame with a good CRC whose body is not what its type says.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MalformedFrame {
    /// No such type.
    #[error("counter box frame of unknown type {kind:02X}h: box and host speak different versions; update one of them")]
    UnknownType {
        /// Type byte.
        kind: u8,
    },
    /// Too few or too many bytes for the type.
    #[error("counter box frame of type {kind:02X}h: its {len} bytes do not fit its content: update the box's firmware")]
    Length {
        /// Type byte.
        kind: u8,
        /// Bytes of the body.
        len: usize,
    },
    /// No samples, or more than a frame may carry.
    #[error("counter box frame with {count} samples; 1 to {limit} are allowed: set samples_per_frame within that")]
    SampleCount {
        /// Samples announced.
        count: u16,
        /// Most a frame may carry.
        limit: u16,
    },
    /// A text too long or not UTF-8.
    #[error("counter box identity with a bad {field} text of {len} bytes; at most {limit} bytes of UTF-8 are allowed")]
    Text {
        /// Which text.
        field: &'static str,
        /// Its length.
        len: usize,
        /// Longest.
        limit: usize,
    },
}

/// Little-endian fields from the head of a body.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, tail) = self.0.split_first_chunk::<N>()?;
        self.0 = tail;
        Some(*head)
    }

    fn u8(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| byte)
    }

    fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn i64(&mut self) -> Option<i64> {
        self.take().map(i64::from_le_bytes)
    }

    fn bytes(&mut self, len: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(len)?;
        self.0 = tail;
        Some(head)
    }
}

/// Reads a body whose CRC was good.
pub(super) fn parse(body: &[u8]) -> Result<Frame, MalformedFrame> {
    let Some((&kind, rest)) = body.split_first() else {
        return Err(MalformedFrame::Length { kind: 0, len: 0 });
    };
    let mut reader = Reader(rest);
    let frame = match kind {
        kind::IDENTIFY | kind::START | kind::STOP => command(kind, &mut reader).map(Frame::Command),
        kind::IDENTITY => identity(&mut reader)?.map(Frame::Identity),
        kind::ACK => ack(&mut reader).map(Frame::Ack),
        kind::SAMPLES => samples(&mut reader)?.map(Frame::Samples),
        _ => return Err(MalformedFrame::UnknownType { kind }),
    };
    match frame {
        Some(frame) if reader.0.is_empty() => Ok(frame),
        _ => Err(MalformedFrame::Length { kind, len: body.len() }),
    }
}

fn command(kind: u8, reader: &mut Reader<'_>) -> Option<Command> {
    let request_id = reader.u16()?;
    Some(match kind {
        kind::IDENTIFY => Command::Identify { request_id },
        kind::START => Command::Start { request_id, sample_period_ns: reader.u32()?, samples_per_frame: reader.u16()? },
        _ => Command::Stop { request_id },
    })
}

fn ack(reader: &mut Reader<'_>) -> Option<Ack> {
    Some(Ack { request_id: reader.u16()?, status: AckStatus::from_code(reader.u8()?) })
}

fn identity(reader: &mut Reader<'_>) -> Result<Option<Identity>, MalformedFrame> {
    let mut fixed = || {
        Some(Identity {
            request_id: reader.u16()?,
            protocol_version: reader.u16()?,
            input_counts_per_rev: reader.u64()?,
            output_counts_per_rev: reader.u64()?,
            input_lines: reader.u32()?,
            output_lines: reader.u32()?,
            max_sample_rate_hz: reader.u32()?,
            status: BoxStatus(reader.u16()?),
            serial: String::new(),
            firmware: String::new(),
        })
    };
    let Some(mut identity) = fixed() else {
        return Ok(None);
    };
    for (field, target) in [("serial", &mut identity.serial), ("firmware", &mut identity.firmware)] {
        let Some(bytes) = reader.u8().and_then(|len| reader.bytes(usize::from(len))) else {
            return Ok(None);
        };
        let bad = MalformedFrame::Text { field, len: bytes.len(), limit: MAX_TEXT };
        match std::str::from_utf8(bytes) {
            Ok(text) if bytes.len() <= MAX_TEXT => target.push_str(text),
            _ => return Err(bad),
        }
    }
    Ok(Some(identity))
}

fn samples(reader: &mut Reader<'_>) -> Result<Option<Samples>, MalformedFrame> {
    let mut fixed = || {
        let samples = Samples {
            sequence: reader.u32()?,
            device_time_ns: reader.u64()?,
            dt_ns: reader.u32()?,
            first_sample: reader.u64()?,
            flags: SampleFlags(reader.u16()?),
            input_index_counts: reader.i64()?,
            output_index_counts: reader.i64()?,
            input_base: reader.i64()?,
            output_base: reader.i64()?,
            input_delta: Vec::new(),
            output_delta: Vec::new(),
        };
        Some((samples, reader.u16()?))
    };
    let Some((mut samples, count)) = fixed() else {
        return Ok(None);
    };
    if count == 0 || count > MAX_SAMPLES_PER_FRAME {
        return Err(MalformedFrame::SampleCount { count, limit: MAX_SAMPLES_PER_FRAME });
    }
    let count = usize::from(count);
    for deltas in [&mut samples.input_delta, &mut samples.output_delta] {
        let Some(rest) = varint::read(reader.0, count, deltas) else {
            return Ok(None);
        };
        reader.0 = rest;
        if deltas.first() != Some(&0) {
            return Ok(None);
        }
    }
    Ok(Some(samples))
}
