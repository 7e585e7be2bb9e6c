//! A cable with faults: passes requests and answers between a master and a device, and harms them by a plan.
//!
//! It knows what the device really answered to each request, and so what a master may believe. It works on any stream: a pipe in
//! simulated time or a pseudo-terminal in real time.

mod fault;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::time::{Instant, sleep_until};
use wire::modbus::{ExceptionCode, Response};
use wire::modbus::{Incoming, Request, ServerDecoder, ServerFrame, encode_response};

pub use fault::{Fault, FaultPlan};

use rigd::link::Duplex;

/// One request that reached the device, and what the device answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exchange {
    /// What was asked.
    pub request: Request,
    /// What was answered, before any harm.
    pub response: Response,
}

/// What passed through the cable.
#[derive(Debug, Default)]
pub struct Record {
    /// The latest exchanges, oldest first.
    exchanges: std::collections::VecDeque<Exchange>,
    /// Exchanges so far.
    pub answered: u64,
    /// Requests that the master sent.
    pub requests: u64,
    /// Faults so far, by name.
    pub faults: BTreeMap<&'static str, u64>,
}

/// Exchanges remembered; a master's single call makes far fewer.
const REMEMBERED: usize = 256;

impl Record {
    /// The exchanges since `answered` was so many.
    pub fn since(&self, mark: u64) -> impl Iterator<Item = &Exchange> {
        let fresh = usize::try_from(self.answered - mark).unwrap_or(usize::MAX).min(self.exchanges.len());
        self.exchanges.iter().skip(self.exchanges.len() - fresh)
    }

    fn add(&mut self, exchange: Exchange) {
        if self.exchanges.len() == REMEMBERED {
            self.exchanges.pop_front();
        }
        self.exchanges.push_back(exchange);
        self.answered += 1;
    }

    fn count(&mut self, fault: Fault) {
        *self.faults.entry(fault.name()).or_default() += 1;
    }
}

/// Why the cable's master end was closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// By a fault; a new master end may be given.
    HungUp,
    /// The master closed it.
    MasterGone,
    /// The device closed its own.
    DeviceGone,
}

/// The cable.
pub struct Proxy {
    plan: FaultPlan,
    record: Rc<RefCell<Record>>,
    requests: ServerDecoder,
    frames: Vec<ServerFrame>,
    /// Asked and not yet answered by the device.
    open: std::collections::VecDeque<(Instant, u8, Request)>,
    /// What the device has sent of its next answer.
    answer: Vec<u8>,
    /// What is on its way to the master, by due time and order.
    due: BTreeMap<(Instant, u64), Vec<u8>>,
    order: u64,
    /// Nothing that keeps the order passes before this.
    not_before: Instant,
    /// An answer that waits for the next.
    held: Option<(Instant, Vec<u8>)>,
}

impl Proxy {
    /// A cable with these faults, which writes down what passes.
    #[must_use]
    pub fn new(plan: FaultPlan, record: Rc<RefCell<Record>>) -> Self {
        Self {
            plan,
            record,
            requests: ServerDecoder::new(),
            frames: Vec::new(),
            open: std::collections::VecDeque::new(),
            answer: Vec::new(),
            due: BTreeMap::new(),
            order: 0,
            not_before: Instant::now(),
            held: None,
        }
    }

    /// Carries bytes until an end closes.
    ///
    /// # Errors
    /// None: a line that fails is a line that closed.
    pub async fn carry(&mut self, mut master: impl Duplex, device: &mut impl Duplex) -> End {
        let (mut asked, mut answered) = ([0; 512], [0; 512]);
        // What was on its way when the port hung up died with it.
        self.due.clear();
        self.held = None;
        loop {
            let next = self.next_due();
            tokio::select! {
                biased;
                read = device.read(&mut answered) => {
                    let Ok(count @ 1..) = read else { return End::DeviceGone };
                    self.take_answer(&answered[..count]);
                }
                () = sleep_until(next.unwrap_or_else(far_future)), if next.is_some() => {
                    for bytes in self.take_due() {
                        if master.write_all(&bytes).await.is_err() {
                            return End::MasterGone;
                        }
                    }
                }
                read = master.read(&mut asked) => {
                    let Ok(count @ 1..) = read else { return End::MasterGone };
                    match self.take_request(&asked[..count]) {
                        None => return End::HungUp,
                        Some(bytes) => if device.write_all(&bytes).await.is_err() {
                            return End::DeviceGone;
                        },
                    }
                }
            }
        }
    }

    fn next_due(&self) -> Option<Instant> {
        let due = self.due.keys().next().map(|(when, _)| *when);
        due.into_iter().chain(self.held.as_ref().map(|(when, _)| *when)).min()
    }

    fn take_due(&mut self) -> Vec<Vec<u8>> {
        let now = Instant::now();
        let mut taken = Vec::new();
        while let Some(entry) = self.due.first_entry().filter(|entry| entry.key().0 <= now) {
            taken.push(entry.remove());
        }
        if let Some((_, bytes)) = self.held.take_if(|(when, _)| *when <= now) {
            taken.push(bytes);
        }
        taken
    }

    fn send(&mut self, when: Instant, bytes: Vec<u8>) {
        self.order += 1;
        self.due.insert((when, self.order), bytes);
    }

    /// Bytes for the device; `None` hangs up.
    fn take_request(&mut self, bytes: &[u8]) -> Option<Vec<u8>> {
        // Masters here send whole requests.
        let mut frames = std::mem::take(&mut self.frames);
        let _ = self.requests.idle();
        self.requests.feed(bytes, &mut frames);
        let mut bytes = bytes.to_vec();
        let fault = self.plan.draw(true);
        let now = Instant::now();
        if let Some(fault) = fault {
            self.record.borrow_mut().count(fault);
        }
        match fault {
            Some(Fault::HangUp) => return None,
            Some(Fault::Echoed) => self.send(now, bytes.clone()),
            Some(Fault::Noise) => {
                let (when, noise) = (now + self.plan.delay(self.plan.latest), self.plan.noise());
                self.send(when, noise);
            }
            Some(Fault::LostRequest) => bytes.clear(),
            Some(Fault::CorruptRequest) => self.plan.damage(&mut bytes),
            _ => {}
        }
        self.record.borrow_mut().requests += 1;
        let arrives = !matches!(fault, Some(Fault::LostRequest | Fault::CorruptRequest));
        for frame in frames.drain(..).filter(|_| arrives) {
            if let Incoming::Request(request) = frame.incoming {
                self.open.push_back((now, frame.unit, request));
            }
        }
        self.frames = frames;
        Some(bytes)
    }

    /// Collects the device's bytes; its frames are whole and in order.
    fn take_answer(&mut self, bytes: &[u8]) {
        self.answer.extend_from_slice(bytes);
        while let Some(length) = answer_length(&self.answer).filter(|length| self.answer.len() >= *length) {
            let frame: Vec<u8> = self.answer.drain(..length).collect();
            // A request that the device never answered must not be taken for the one that it answers now: requests of one shape
            // are further apart than the latest answer.
            let now = Instant::now();
            self.open.retain(|(asked, ..)| now - *asked <= self.plan.latest);
            while let Some((_, unit, request)) = self.open.pop_front() {
                if let Some(response) = parse(unit, &request, &frame) {
                    self.record.borrow_mut().add(Exchange { request, response });
                    break;
                }
            }
            self.harm(frame);
        }
    }

    /// Sends an answer on its way to the master, with its fault.
    fn harm(&mut self, mut frame: Vec<u8>) {
        let fault = self.plan.draw(false);
        if let Some(fault) = fault {
            self.record.borrow_mut().count(fault);
        }
        let now = Instant::now();
        // No answer is later than the plan says, whatever it is merged with.
        let mut latest = now + self.plan.latest;
        let mut repeated = now + self.plan.latest_repetition;
        if let Some((deadline, mut merged)) = self.held.take() {
            merged.append(&mut frame);
            frame = merged;
            latest = deadline;
            repeated = repeated.min(deadline);
        }
        let mut when = now.max(self.not_before).min(latest);
        match fault {
            Some(Fault::Late) => {
                when = when.max(now + self.plan.delay(latest - now));
                self.not_before = when;
                self.send(when, frame);
            }
            Some(Fault::Overtaken) => {
                let later = self.plan.delay(latest - now);
                self.send(now + later, frame);
            }
            Some(Fault::Split) => {
                let tail = frame.split_off(1 + self.plan.below(frame.len() - 1));
                let later = when + self.plan.delay(latest - when);
                self.send(when, frame);
                self.send(later, tail);
                self.not_before = later;
            }
            Some(Fault::Merged) => self.held = Some((latest, frame)),
            Some(Fault::Corrupt) => {
                self.plan.damage(&mut frame);
                self.send(when, frame);
            }
            Some(Fault::Truncated) => {
                frame.truncate(1 + self.plan.below(frame.len() - 1));
                self.send(when, frame);
            }
            Some(Fault::Duplicated) => {
                let later = when + self.plan.delay(repeated.saturating_duration_since(when));
                self.send(when, frame.clone());
                self.send(later, frame);
            }
            Some(Fault::WrongUnit) => {
                readdress(&mut frame);
                self.send(when, frame);
            }
            Some(Fault::Silence) => {}
            _ => self.send(when, frame),
        }
    }
}

fn far_future() -> Instant {
    Instant::now() + std::time::Duration::from_secs(86_400)
}

/// Length of an answer by its head (Application Protocol V1.1b3, §6).
fn answer_length(head: &[u8]) -> Option<usize> {
    match head {
        [_, 3, count, ..] => Some(5 + usize::from(*count)),
        [_, 6 | 16, ..] => Some(8),
        [_, 0x80..=0xFF, ..] => Some(5),
        // Nothing else is asked here, so nothing else is answered.
        [_, _, ..] => Some(head.len()),
        _ => None,
    }
}

/// What a frame says to a request; `None` when it cannot be its answer.
fn parse(unit: u8, request: &Request, frame: &[u8]) -> Option<Response> {
    wire::modbus::ClientDecoder::new(unit, request).feed(frame).ok().flatten()
}

/// Makes an answer a faultless one of the next unit.
fn readdress(frame: &mut Vec<u8>) {
    // A refusal of another unit, or the same data under its number: both are encoded anew, so that the CRC is good.
    let (unit, function) = (frame[0].wrapping_add(1), frame[1]);
    let response = match function {
        3 => Response::Registers(
            frame[3..frame.len() - 2].chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect(),
        ),
        _ => Response::Exception(ExceptionCode::ServerDeviceBusy),
    };
    if let Ok(bytes) = encode_response(unit, function & 0x7F, &response) {
        *frame = bytes;
    }
}
