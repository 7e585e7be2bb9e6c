//! The server's side: requests out of a byte stream.

use super::pdu::{ExceptionCode, Request};
use super::{function, split_crc, words};

/// Longest RTU frame, unit and CRC included (V1.02 §2.5.1).
const MAX_FRAME: usize = 256;

/// A request addressed to some unit. Whether it concerns this server is for the caller to say: a frame for another
/// unit is met with silence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServerFrame {
    /// Unit addressed; 0 is a broadcast, which is never answered.
    pub unit: u8,
    /// What it asks.
    pub incoming: Incoming,
}

/// What a frame with a good CRC asks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Incoming {
    /// A request of a function this project knows. Counts and values are the device's to judge.
    Request(Request),
    /// A frame that every server of this project refuses in the same way: an unknown function, or a byte count that
    /// contradicts the register count.
    Refused {
        /// Function code of the frame.
        function: u8,
        /// What to answer.
        exception: ExceptionCode,
    },
}

/// What a server has seen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ServerStats {
    /// Frames with a good CRC, for any unit.
    pub frames: u64,
    /// Frames whose CRC did not fit.
    pub crc_errors: u64,
    /// Frames that ended early, or runs of bytes that were no frame.
    pub fragments: u64,
    /// Bytes thrown away.
    pub bytes_skipped: u64,
}

/// Finds requests in a byte stream. Frames are delimited by the length that their function implies and confirmed by
/// their CRC. After any damage everything is thrown away until the caller reports a silence with [`idle`]: RTU frames
/// start after a silence only, and looking for the next frame inside a damaged one could execute its data.
///
/// Whoever owns the port calls [`idle`] when no byte has come for an inter-frame silence (or, on adapters that deliver
/// in bursts, for longer than their latency).
///
/// [`idle`]: ServerDecoder::idle
#[derive(Debug, Clone, Default)]
pub struct ServerDecoder {
    buffer: Vec<u8>,
    /// Damage was seen: wait for a silence.
    lost: bool,
    stats: ServerStats,
}

/// Length of a request frame as far as its head tells.
enum Length {
    /// More bytes are needed to tell.
    Unknown,
    /// The function is not one whose length is known: only a silence ends the frame.
    UntilSilence,
    /// Whole frame with CRC.
    Known(usize),
}

impl ServerDecoder {
    /// A decoder at the start of a stream.
    pub fn new() -> Self {
        Self::default()
    }

    /// What has been seen so far.
    pub fn stats(&self) -> ServerStats {
        self.stats
    }

    /// Takes bytes as they arrive and appends the frames that they complete.
    pub fn feed(&mut self, bytes: &[u8], frames: &mut Vec<ServerFrame>) {
        if self.lost {
            self.stats.bytes_skipped += bytes.len() as u64;
            return;
        }
        self.buffer.extend_from_slice(bytes);
        let mut start = 0;
        while start < self.buffer.len() {
            let head = &self.buffer[start..];
            match request_len(head) {
                Length::Known(len) if head.len() >= len => {
                    if let Some(frame) = decode(&head[..len]) {
                        self.stats.frames += 1;
                        frames.push(frame);
                        start += len;
                    } else {
                        self.stats.crc_errors += 1;
                        self.lose(start);
                        return;
                    }
                }
                Length::UntilSilence if head.len() > MAX_FRAME => {
                    self.stats.fragments += 1;
                    self.lose(start);
                    return;
                }
                Length::Known(_) | Length::Unknown | Length::UntilSilence => break,
            }
        }
        self.buffer.drain(..start);
    }

    /// Reports a silence: a pending frame of an unknown function ends here, an incomplete one is dropped, and after
    /// damage the decoder listens again.
    pub fn idle(&mut self) -> Option<ServerFrame> {
        self.lost = false;
        if self.buffer.is_empty() {
            return None;
        }
        let whole = matches!(request_len(&self.buffer), Length::UntilSilence);
        let frame = if whole { decode(&self.buffer) } else { None };
        if frame.is_some() {
            self.stats.frames += 1;
        } else {
            self.stats.fragments += 1;
            self.stats.bytes_skipped += self.buffer.len() as u64;
        }
        self.buffer.clear();
        frame
    }

    fn lose(&mut self, start: usize) {
        self.stats.bytes_skipped += (self.buffer.len() - start) as u64;
        self.buffer.clear();
        self.lost = true;
    }
}

/// Lengths of the requests of public functions (V1.1b3 §6).
fn request_len(head: &[u8]) -> Length {
    let Some(&function) = head.get(1) else {
        return Length::Unknown;
    };
    let counted = |at: usize| head.get(at).map_or(Length::Unknown, |count| Length::Known(at + 3 + usize::from(*count)));
    match function {
        1..=6 | 8 => Length::Known(8),
        7 | 11 | 12 | 17 => Length::Known(4),
        15 | 16 => counted(6),
        22 => Length::Known(10),
        23 => counted(10),
        _ => Length::UntilSilence,
    }
}

/// A whole frame, if its CRC fits.
fn decode(frame: &[u8]) -> Option<ServerFrame> {
    let (body, found, expected) = split_crc(frame)?;
    if found != expected {
        return None;
    }
    let (unit, function) = (body[0], body[1]);
    let word = |at: usize| u16::from_be_bytes([body[at], body[at + 1]]);
    let incoming = match function {
        function::READ_HOLDING => Incoming::Request(Request::ReadHolding { address: word(2), count: word(4) }),
        function::WRITE_SINGLE => Incoming::Request(Request::WriteSingle { address: word(2), value: word(4) }),
        function::WRITE_MULTIPLE if u32::from(body[6]) == 2 * u32::from(word(4)) => {
            Incoming::Request(Request::WriteMultiple { address: word(2), values: words(&body[7..]) })
        }
        function::WRITE_MULTIPLE => Incoming::Refused { function, exception: ExceptionCode::IllegalDataValue },
        _ => Incoming::Refused { function, exception: ExceptionCode::IllegalFunction },
    };
    Some(ServerFrame { unit, incoming })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modbus::{encode_request, push_crc};

    fn feed(decoder: &mut ServerDecoder, bytes: &[u8]) -> Vec<ServerFrame> {
        let mut frames = Vec::new();
        decoder.feed(bytes, &mut frames);
        frames
    }

    fn read() -> Request {
        Request::ReadHolding { address: 0x0058, count: 6 }
    }

    #[test]
    fn frames_for_any_unit_back_to_back() {
        let mut decoder = ServerDecoder::new();
        let write = Request::WriteMultiple { address: 0x0112, values: vec![50, 0] };
        let bytes = [encode_request(1, &read()).unwrap(), encode_request(9, &write).unwrap()].concat();
        let frames = feed(&mut decoder, &bytes);
        assert_eq!(
            frames,
            [
                ServerFrame { unit: 1, incoming: Incoming::Request(read()) },
                ServerFrame { unit: 9, incoming: Incoming::Request(write) },
            ]
        );
        assert_eq!(decoder.stats().frames, 2);
    }

    #[test]
    fn damage_silences_until_idle() {
        let mut decoder = ServerDecoder::new();
        let good = encode_request(1, &read()).unwrap();
        let mut bad = good.clone();
        bad[3] ^= 1;
        assert!(feed(&mut decoder, &bad).is_empty());
        assert!(feed(&mut decoder, &good).is_empty(), "no frame starts without a silence");
        assert_eq!(decoder.idle(), None);
        assert_eq!(feed(&mut decoder, &good).len(), 1);
        let stats = decoder.stats();
        assert_eq!((stats.frames, stats.crc_errors, stats.bytes_skipped), (1, 1, 16));
    }

    #[test]
    fn data_that_look_like_a_frame_are_not_executed() {
        // The values of the outer write are themselves a good request.
        let inner = encode_request(1, &Request::WriteSingle { address: 0x0112, value: 30_000 }).unwrap();
        let outer = Request::WriteMultiple { address: 0x0400, values: words(&inner) };
        let mut bytes = encode_request(1, &outer).unwrap();
        bytes[1] ^= 0x06;
        let mut decoder = ServerDecoder::new();
        assert!(feed(&mut decoder, &bytes).is_empty());
        assert_eq!(decoder.idle(), None);
    }

    #[test]
    fn half_a_frame_is_dropped_at_a_silence() {
        let mut decoder = ServerDecoder::new();
        let good = encode_request(1, &read()).unwrap();
        feed(&mut decoder, &good[..5]);
        assert_eq!(decoder.idle(), None);
        assert_eq!(feed(&mut decoder, &good).len(), 1);
        assert_eq!(decoder.stats().fragments, 1);
    }

    #[test]
    fn unknown_functions_and_contradicting_counts_are_refused() {
        let mut decoder = ServerDecoder::new();
        let mut private = vec![1, 0x41, 0xAA, 0xBB];
        push_crc(&mut private);
        assert!(feed(&mut decoder, &private).is_empty(), "its length is unknown until a silence");
        let refused =
            |function, exception| ServerFrame { unit: 1, incoming: Incoming::Refused { function, exception } };
        assert_eq!(decoder.idle(), Some(refused(0x41, ExceptionCode::IllegalFunction)));
        let mut coils = vec![1, 1, 0, 0, 0, 8];
        push_crc(&mut coils);
        assert_eq!(feed(&mut decoder, &coils), [refused(1, ExceptionCode::IllegalFunction)]);
        let mut count = vec![1, 16, 0, 0, 0, 3, 4, 0, 1, 0, 2];
        push_crc(&mut count);
        assert_eq!(feed(&mut decoder, &count), [refused(16, ExceptionCode::IllegalDataValue)]);
    }
}
