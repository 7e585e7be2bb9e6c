//! A Modbus line with an emulated device at its end, and the faults that lines and devices have.

use std::collections::VecDeque;

use wire::modbus::{self, ExceptionCode, Incoming, Request, Response, ServerDecoder, ServerFrame, ServerStats};

use super::interface::Reply;

/// What goes wrong with an answer. The request has been carried out, except with [`LineFault::Exception`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFault {
    /// No answer.
    Silent,
    /// The answer comes so much later, ns.
    Late(u64),
    /// The byte at this place (counted round the frame) is XORed with the mask.
    Corrupt {
        /// Place.
        byte: usize,
        /// Bits that flip; 0 flips none.
        mask: u8,
    },
    /// The device refuses, without carrying the request out.
    Exception(ExceptionCode),
    /// Another unit's number stands in the answer, with a good CRC.
    WrongUnit(u8),
    /// The answer comes twice, the second so much later, ns.
    Duplicate(u64),
    /// The request is echoed before the answer.
    Echo,
    /// The answer stops for so long after this many bytes, ns.
    Split {
        /// Bytes before the gap (counted round the frame).
        after: usize,
        /// The gap.
        gap_ns: u64,
    },
}

/// Bytes to send.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transmission {
    /// When to begin, ns after the request was complete. Never before an earlier transmission has ended.
    pub after_ns: u64,
    /// What to send.
    pub bytes: Vec<u8>,
}

/// The device's end of a Modbus line: finds requests, asks the device, makes the bytes of its answer.
#[derive(Debug, Clone, Default)]
pub struct ModbusLine {
    decoder: ServerDecoder,
    frames: Vec<ServerFrame>,
    next_faults: VecDeque<Option<LineFault>>,
    steady_fault: Option<LineFault>,
}

impl ModbusLine {
    /// A line in good order.
    pub fn new() -> Self {
        Self::default()
    }

    /// What the device has seen on the line.
    pub fn stats(&self) -> ServerStats {
        self.decoder.stats()
    }

    /// The fault (or none) of the next answer that has no fault planned yet.
    pub fn plan(&mut self, fault: Option<LineFault>) {
        self.next_faults.push_back(fault);
    }

    /// The fault of all answers for which none is planned.
    pub fn set_steady_fault(&mut self, fault: Option<LineFault>) {
        self.steady_fault = fault;
    }

    /// Takes bytes from the line. `handle` is the device: it is asked once for each request to `unit`. Requests to other
    /// units and broadcasts are met with silence.
    pub fn receive(&mut self, bytes: &[u8], unit: u8, handle: impl FnMut(&Request) -> Reply) -> Vec<Transmission> {
        let mut frames = std::mem::take(&mut self.frames);
        self.decoder.feed(bytes, &mut frames);
        let sent = self.answer(&frames, unit, handle);
        frames.clear();
        self.frames = frames;
        sent
    }

    /// Reports a silence on the line; a request of an unknown function ends there and is refused.
    pub fn idle(&mut self, unit: u8, handle: impl FnMut(&Request) -> Reply) -> Vec<Transmission> {
        let frame = self.decoder.idle();
        self.answer(frame.as_slice(), unit, handle)
    }

    fn answer(
        &mut self,
        frames: &[ServerFrame],
        unit: u8,
        mut handle: impl FnMut(&Request) -> Reply,
    ) -> Vec<Transmission> {
        let mut sent = Vec::new();
        for frame in frames.iter().filter(|frame| frame.unit == unit && unit != BROADCAST) {
            let fault = self.next_faults.pop_front().unwrap_or(self.steady_fault);
            let refusal = |code| Reply::after(REFUSAL_NS, Response::Exception(code));
            let reply = match (&frame.incoming, fault) {
                (_, Some(LineFault::Exception(code))) => refusal(code),
                (Incoming::Refused { exception, .. }, _) => refusal(*exception),
                (Incoming::Request(request), _) => handle(request),
            };
            let (function, request) = match &frame.incoming {
                Incoming::Request(request) => (request.function(), Some(request)),
                Incoming::Refused { function, .. } => (*function, None),
            };
            let answering_unit = match fault {
                Some(LineFault::WrongUnit(other)) => other,
                _ => unit,
            };
            // Emulators answer no more than was asked and the decoder lets no more be asked than a frame carries, so this
            // fails only for counts a device must refuse; silence is what a device that cannot answer gives.
            let answer =
                reply.response.and_then(|response| modbus::encode_response(answering_unit, function, &response).ok());
            if let Some(answer) = answer {
                let echo = request.and_then(|request| modbus::encode_request(unit, request).ok());
                transmit(&mut sent, fault, reply.processing_ns, answer, echo);
            }
        }
        sent
    }
}

/// Time a device takes to refuse a request that it does not look at, ns.
const REFUSAL_NS: u64 = 500_000;
/// Unit number to which nobody answers.
const BROADCAST: u8 = 0;

/// Sends an answer with its fault.
fn transmit(
    sent: &mut Vec<Transmission>,
    fault: Option<LineFault>,
    after_ns: u64,
    mut answer: Vec<u8>,
    echo: Option<Vec<u8>>,
) {
    let mut send = |after_ns, bytes| sent.push(Transmission { after_ns, bytes });
    match fault {
        Some(LineFault::Silent) => {}
        Some(LineFault::Late(late_ns)) => send(after_ns.saturating_add(late_ns), answer),
        Some(LineFault::Corrupt { byte, mask }) => {
            let place = byte % answer.len();
            answer[place] ^= mask;
            send(after_ns, answer);
        }
        Some(LineFault::Duplicate(later_ns)) => {
            send(after_ns, answer.clone());
            send(after_ns.saturating_add(later_ns), answer);
        }
        Some(LineFault::Echo) => {
            if let Some(echo) = echo {
                send(0, echo);
            }
            send(after_ns, answer);
        }
        Some(LineFault::Split { after, gap_ns }) => {
            let tail = answer.split_off(after % answer.len());
            send(after_ns, answer);
            send(after_ns.saturating_add(gap_ns), tail);
        }
        None | Some(LineFault::Exception(_) | LineFault::WrongUnit(_)) => send(after_ns, answer),
    }
}

#[cfg(test)]
mod tests {
    use wire::modbus::{ClientDecoder, encode_request, encode_response};

    use super::*;

    const READ: Request = Request::ReadHolding { address: 8, count: 2 };

    fn device(request: &Request) -> Reply {
        let count = request.count();
        Reply::after(1000, Response::Registers((0..count).map(|n| request.address() + n).collect()))
    }

    fn ask(line: &mut ModbusLine, unit: u8) -> Vec<Transmission> {
        line.receive(&encode_request(unit, &READ).unwrap(), 1, device)
    }

    fn good() -> Vec<u8> {
        encode_response(1, 3, &Response::Registers(vec![8, 9])).unwrap()
    }

    #[test]
    fn answers_its_own_unit_only() {
        let mut line = ModbusLine::new();
        assert_eq!(ask(&mut line, 1), [Transmission { after_ns: 1000, bytes: good() }]);
        assert!(ask(&mut line, 2).is_empty());
        let broadcast = encode_request(0, &READ).unwrap();
        assert!(line.receive(&broadcast, 0, device).is_empty());
    }

    #[test]
    fn unknown_functions_are_refused() {
        let mut line = ModbusLine::new();
        // Function 01, read coils.
        let coils = [1, 1, 0, 0, 0, 1, 0xFD, 0xCA];
        let sent = line.receive(&coils, 1, device);
        assert_eq!(sent[0].bytes[..3], [1, 0x81, 1]);
        assert!(line.idle(1, device).is_empty());
    }

    #[test]
    fn planned_faults_come_first_and_once() {
        let mut line = ModbusLine::new();
        line.set_steady_fault(Some(LineFault::Late(5)));
        line.plan(Some(LineFault::Silent));
        line.plan(None);
        assert!(ask(&mut line, 1).is_empty());
        assert_eq!(ask(&mut line, 1)[0].after_ns, 1000);
        assert_eq!(ask(&mut line, 1)[0].after_ns, 1005);
    }

    #[test]
    fn no_fault_yields_a_believable_wrong_answer() {
        let faults = [
            LineFault::Corrupt { byte: 4, mask: 1 },
            LineFault::WrongUnit(2),
            LineFault::Echo,
            LineFault::Exception(ExceptionCode::ServerDeviceBusy),
        ];
        for fault in faults {
            let mut line = ModbusLine::new();
            line.plan(Some(fault));
            let bytes: Vec<u8> = ask(&mut line, 1).into_iter().flat_map(|part| part.bytes).collect();
            let outcome = ClientDecoder::new(1, &READ).feed(&bytes);
            assert!(!matches!(outcome, Ok(Some(Response::Registers(_)))), "{fault:?}: {outcome:?}");
        }
    }

    #[test]
    fn splits_and_duplicates_keep_every_byte() {
        let mut line = ModbusLine::new();
        line.plan(Some(LineFault::Split { after: 3, gap_ns: 50 }));
        let parts = ask(&mut line, 1);
        assert_eq!([parts[0].bytes.clone(), parts[1].bytes.clone()].concat(), good());
        assert_eq!((parts[0].after_ns, parts[1].after_ns), (1000, 1050));
        line.plan(Some(LineFault::Duplicate(7)));
        let parts = ask(&mut line, 1);
        assert_eq!((&parts[0].bytes, &parts[1].bytes), (&good(), &good()));
    }
}
