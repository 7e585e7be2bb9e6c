//! The task that owns a line: one transaction at a time, silences kept, every stray byte seen.
//!
//! It is a task of its own so that a transaction, once begun, is ended whoever stops waiting for it, and so that the line is heard
//! while nobody asks: a late answer that comes between two requests is counted and thrown away then.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::sync::{mpsc, oneshot};
use tokio::time::{Instant, timeout_at};
use wire::modbus::{self, ClientDecoder, Request, Response};

use super::error::BusError;
use super::memory::LateReplyWindow;
use super::memory::{Memory, Shape};
use super::statistics::BusStatistics;
use super::timing::{BusTiming, Span};
use crate::link::{Address, Link};

/// Longest wait for a line to fall silent: shorter than any lease, so that one chattering device never costs the other's.
const DRAIN_LIMIT: Duration = Duration::from_millis(250);
/// A line is silent when nothing came for so long, even if its inter-frame silence is shorter: adapters deliver in bursts.
const QUIET: Duration = Duration::from_millis(20);

/// Consecutive registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Range {
    pub first: u16,
    pub count: u16,
}

impl Range {
    fn end(self) -> u32 {
        u32::from(self.first) + u32::from(self.count)
    }
}

/// What is to be done on the line.
#[derive(Debug)]
pub(super) enum Ask {
    /// Read these ranges, in one request where that is possible.
    Read(Vec<Range>),
    /// Write consecutive registers.
    Write { first: u16, values: Vec<u16> },
}

/// A transaction that somebody waits for.
pub(super) struct Job {
    pub ask: Ask,
    pub reply: oneshot::Sender<Result<Vec<Vec<u16>>, BusError>>,
}

/// How the device wants its line used, and what may be read of it.
pub(super) struct Owner {
    pub link: Option<Link>,
    pub address: Address,
    pub unit: u8,
    pub timing: BusTiming,
    pub spans: Vec<Span>,
    pub jobs: mpsc::Receiver<Job>,
    pub statistics: Arc<Mutex<BusStatistics>>,
    memory: Memory,
    late_replies: LateReplyWindow,
    quiet_since: Instant,
    suspect: bool,
    /// Nobody knows what was asked here before: an earlier run may have died waiting.
    fresh: bool,
    gone: String,
}

/// One request without a good answer.
enum Failure {
    TimedOut,
    Damaged(modbus::ResponseError),
    Refused(modbus::ExceptionCode),
}

impl Owner {
    pub fn new(
        link: Link,
        address: Address,
        unit: u8,
        timing: BusTiming,
        jobs: mpsc::Receiver<Job>,
        statistics: Arc<Mutex<BusStatistics>>,
    ) -> Self {
        let silence = modbus::inter_frame_silence(address.baud);
        Self {
            link: Some(link),
            address,
            unit,
            timing: BusTiming { silence: timing.silence.max(silence), ..timing },
            spans: Vec::new(),
            jobs,
            statistics,
            memory: Memory::new(LateReplyWindow::default()),
            late_replies: LateReplyWindow::default(),
            quiet_since: Instant::now(),
            // What an earlier master left on the line is no answer to us.
            suspect: true,
            fresh: true,
            gone: String::new(),
        }
    }

    pub fn set_late_replies(&mut self, late_replies: LateReplyWindow) {
        self.memory = Memory::new(late_replies);
        self.late_replies = late_replies;
    }

    /// Serves until nobody can ask any more.
    pub async fn run(mut self) {
        while let Some(job) = self.next_job().await {
            let outcome = self.perform(&job.ask).await;
            // Whoever stopped waiting does not want it.
            let _ = job.reply.send(outcome);
        }
    }

    /// The next transaction; until it comes, the line is heard.
    async fn next_job(&mut self) -> Option<Job> {
        let mut buffer = [0; 256];
        loop {
            let Some(link) = &mut self.link else { return self.jobs.recv().await };
            tokio::select! {
                biased;
                job = self.jobs.recv() => return job,
                read = link.read(&mut buffer) => {
                    // A hang-up is told to whoever asks next.
                    if let Ok(count) = self.received(read) { self.stray(count) }
                }
            }
        }
    }

    async fn perform(&mut self, ask: &Ask) -> Result<Vec<Vec<u16>>, BusError> {
        match ask {
            Ask::Write { first, values } => {
                self.transact(&mut |owner, now| owner.write_request(*first, values, now)).await?;
                Ok(Vec::new())
            }
            Ask::Read(ranges) => {
                if let Some(whole) =
                    hull(ranges).filter(|whole| ranges.len() == 1 || self.free_window(*whole).is_some())
                {
                    let (window, words) = self.read(whole).await?;
                    return Ok(ranges.iter().map(|range| part(*range, window, &words)).collect());
                }
                let mut read: Vec<(Range, Vec<u16>)> = Vec::new();
                let mut parts = Vec::with_capacity(ranges.len());
                for range in ranges {
                    // What an earlier window happens to hold is not asked for again.
                    let held =
                        read.iter().find(|(window, _)| window.first <= range.first && window.end() >= range.end());
                    if held.is_none() {
                        read.push(self.read(*range).await?);
                    }
                    let held =
                        read.iter().find(|(window, _)| window.first <= range.first && window.end() >= range.end());
                    parts.push(held.map(|(window, words)| part(*range, *window, words)).unwrap_or_default());
                }
                Ok(parts)
            }
        }
    }

    /// Reads a window around a range.
    async fn read(&mut self, range: Range) -> Result<(Range, Vec<u16>), BusError> {
        let mut window = range;
        let response = self
            .transact(&mut |owner, _| {
                window = owner.free_window(range).unwrap_or(range);
                Request::ReadHolding { address: window.first, count: window.count }
            })
            .await?;
        match response {
            Response::Registers(words) => Ok((window, words)),
            // The decoder checks function and count, so nothing else arrives here.
            _ => Ok((window, vec![0; usize::from(window.count)])),
        }
    }

    /// The smallest readable window around a range whose answer cannot be taken for one that may still come.
    fn free_window(&mut self, range: Range) -> Option<Range> {
        let now = Instant::now();
        let span = self.spans.iter().find(|span| span.first <= range.first && span.end() >= range.end());
        let (first, end) =
            span.map_or((u32::from(range.first), range.end()), |span| (u32::from(span.first), span.end()));
        let longest = (end - first).min(u32::from(modbus::MAX_READ_COUNT)) as u16;
        (range.count..=longest.max(range.count)).find_map(|count| {
            if self.memory.free_at(self.unit, Shape::Words(count), now).is_some() {
                return None;
            }
            // As far to the right as the span lets it.
            let start = u32::from(range.first).min(end - u32::from(count)).max(first);
            Some(Range { first: start as u16, count })
        })
    }

    /// The write in a form whose confirmation is not that of an earlier one, where there is a choice. A write never waits: what
    /// decides is the value read back.
    fn write_request(&mut self, first: u16, values: &[u16], now: Instant) -> Request {
        match values {
            [value] => {
                let single = Request::WriteSingle { address: first, value: *value };
                let free = self.memory.free_at(self.unit, Shape::of(&single), now).is_none();
                if free { single } else { Request::WriteMultiple { address: first, values: vec![*value] } }
            }
            _ => Request::WriteMultiple { address: first, values: values.to_vec() },
        }
    }

    /// One request and its answer, sent again after silence or damage. All requests here may be repeated: they set states.
    async fn transact(
        &mut self,
        make: &mut (dyn FnMut(&mut Self, Instant) -> Request + Send),
    ) -> Result<Response, BusError> {
        let mut request = make(self, Instant::now());
        let mut last = Failure::TimedOut;
        for attempt in 0..self.timing.attempts {
            if attempt > 0 {
                self.count(|statistics| statistics.retried += 1);
                request = make(self, Instant::now());
            }
            self.settle(&request).await?;
            match self.attempt(&request).await? {
                Ok(response) => return Ok(response),
                Err(failure) => {
                    self.suspect = true;
                    self.count(|statistics| match &failure {
                        Failure::TimedOut => statistics.timeouts += 1,
                        Failure::Damaged(_) => statistics.damaged += 1,
                        Failure::Refused(_) => statistics.refused += 1,
                    });
                    let certain = matches!(failure, Failure::Refused(_)) && !self.memory.exception_is_ambiguous();
                    last = failure;
                    if certain {
                        // An answer in order: the line needs no draining.
                        self.suspect = false;
                        break;
                    }
                }
            }
        }
        Err(self.failed(&request, last))
    }

    /// Waits until the line is silent and the request's answer cannot be taken for another's.
    async fn settle(&mut self, request: &Request) -> Result<(), BusError> {
        if self.suspect {
            self.drain().await?;
        }
        let shape = Shape::of(request);
        if matches!(shape, Shape::Words(_)) {
            let now = Instant::now();
            if let Some(free_at) = self.memory.free_at(self.unit, shape, now) {
                self.count(|statistics| statistics.waited += 1);
                // What comes meanwhile is what was waited for.
                self.listen_until(free_at.max(now)).await?;
                self.memory.forget(self.unit, shape);
            }
        }
        self.listen_until(self.quiet_since + self.timing.silence).await?;
        if self.suspect { self.drain().await } else { Ok(()) }
    }

    async fn attempt(&mut self, request: &Request) -> Result<Result<Response, Failure>, BusError> {
        let frame = modbus::encode_request(self.unit, request).map_err(|reason| BusError::Unaskable {
            device: self.address.device,
            request: request.to_string(),
            reason,
        })?;
        self.memory.sent(self.unit, Shape::of(request), Instant::now());
        self.send(&frame).await?;
        let sent = Instant::now();
        // 11 bits a character at most; both frames pass the wire before patience begins.
        let characters = frame.len() + request.response_len();
        let on_wire = Duration::from_secs_f64(characters as f64 * 11.0 / f64::from(self.address.baud));
        let deadline = sent + on_wire + self.timing.patience;
        let mut decoder = ClientDecoder::new(self.unit, request);
        let mut buffer = [0; 512];
        loop {
            let Some(link) = &mut self.link else { return Err(self.hung_up()) };
            let count = match timeout_at(deadline, link.read(&mut buffer)).await {
                Err(_) => return Ok(Err(Failure::TimedOut)),
                Ok(outcome) => self.received(outcome)?,
            };
            match decoder.feed(&buffer[..count]) {
                Ok(None) => {}
                Ok(Some(response)) => {
                    let now = Instant::now();
                    self.count(|statistics| statistics.answered_after(now - sent));
                    return Ok(match response {
                        Response::Exception(code) => {
                            let ambiguous = self.memory.exception_is_ambiguous();
                            if !ambiguous {
                                self.memory.answered(true, now);
                            }
                            Err(Failure::Refused(code))
                        }
                        response => {
                            self.memory.answered(false, now);
                            Ok(response)
                        }
                    });
                }
                Err(error) => return Ok(Err(Failure::Damaged(error))),
            }
        }
    }

    /// Reads and discards until the line has been silent, so that a late answer is gone before the next request.
    async fn drain(&mut self) -> Result<(), BusError> {
        let quiet =
            if std::mem::take(&mut self.fresh) { self.late_replies.late } else { self.timing.silence.max(QUIET) };
        // A line that never falls silent is not Modbus; the request that follows will tell.
        let give_up = Instant::now() + quiet + DRAIN_LIMIT;
        loop {
            let before = self.quiet_since;
            self.listen_until((Instant::now() + quiet).min(give_up)).await?;
            if self.quiet_since == before || Instant::now() >= give_up {
                break;
            }
        }
        self.suspect = false;
        Ok(())
    }

    /// Hears the line until then; whatever comes was not asked for.
    async fn listen_until(&mut self, then: Instant) -> Result<(), BusError> {
        let mut buffer = [0; 256];
        loop {
            let Some(link) = &mut self.link else { return Err(self.hung_up()) };
            // The line first: what has come already counts, however late it is.
            match timeout_at(then, link.read(&mut buffer)).await {
                Err(_) => return Ok(()),
                Ok(outcome) => {
                    let count = self.received(outcome)?;
                    self.stray(count);
                }
            }
        }
    }

    /// Bytes that nobody waits for. They may be the head of a frame, so the line must fall silent before the next request.
    fn stray(&mut self, count: usize) {
        self.suspect = true;
        self.count(|statistics| statistics.stray_bytes += count as u64);
    }

    async fn send(&mut self, frame: &[u8]) -> Result<(), BusError> {
        let Some(link) = &mut self.link else { return Err(self.hung_up()) };
        let sent = match link.write_all(frame).await {
            Ok(()) => link.flush().await,
            Err(error) => Err(error),
        };
        self.quiet_since = Instant::now();
        sent.map_err(|error| self.lost(error.to_string()))
    }

    /// Zero bytes for ever is how a hung-up line shows.
    fn received(&mut self, outcome: std::io::Result<usize>) -> Result<usize, BusError> {
        self.quiet_since = Instant::now();
        match outcome {
            Ok(0) => Err(self.lost("end of stream".into())),
            Ok(count) => Ok(count),
            Err(error) => Err(self.lost(error.to_string())),
        }
    }

    /// The port is closed at once, so that it can be opened again.
    fn lost(&mut self, reason: String) -> BusError {
        self.link = None;
        self.gone = reason;
        self.hung_up()
    }

    fn hung_up(&self) -> BusError {
        BusError::HungUp { device: self.address.device, port: self.address.port.clone(), reason: self.gone.clone() }
    }

    fn failed(&self, request: &Request, last: Failure) -> BusError {
        let (device, port, unit, attempts) =
            (self.address.device, self.address.port.clone(), self.unit, self.timing.attempts);
        let (baud, format, request) = (self.address.baud, self.address.format.clone(), request.to_string());
        match last {
            Failure::Refused(code) => BusError::Refused { device, port, unit, request, code },
            Failure::TimedOut => BusError::Silent {
                device,
                port,
                unit,
                attempts,
                request,
                patience_ms: self.timing.patience.as_millis(),
                baud,
                format,
            },
            Failure::Damaged(reason) => {
                BusError::Damaged { device, port, unit, attempts, request, reason, baud, format }
            }
        }
    }

    fn count(&self, add: impl FnOnce(&mut BusStatistics)) {
        add(&mut self.statistics.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

/// The range that covers all.
fn hull(ranges: &[Range]) -> Option<Range> {
    let first = ranges.iter().map(|range| range.first).min()?;
    let end = ranges.iter().map(|range| range.end()).max()?;
    Some(Range { first, count: u16::try_from(end - u32::from(first)).ok()? })
}

/// A range's words out of a window that covers it.
fn part(range: Range, window: Range, words: &[u16]) -> Vec<u16> {
    words.iter().skip(usize::from(range.first - window.first)).take(usize::from(range.count)).copied().collect()
}
