//! Two US Digital QSB readers as one counter: their streams are put on the input reader's clock. Lines: `wire::qsb`, docs/wire/qsb.md.
//!
//! A sample is a line of the input reader. The output is interpolated between its reader's lines on both sides of that instant, which
//! [`two_clocks`](crate::device::two_clocks) finds by both clocks' fits to the host's; the fits are kept up while the readers stream.

mod reader;

use std::time::Duration;

use async_trait::async_trait;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::time::{Instant, timeout_at};
use wire::Samples;
use wire::qsb::{Answer, END_CR, END_LF, END_TIME, Instruction, Kind, register};

use crate::device::two_clocks::{ClockFit, Skew};
use crate::device::{Clocks, Counter, CounterIdentity, DeviceError, DeviceKind, Zero};
use crate::link::{Address, Link};
pub use crate::profile::qsb::DRIVER;
use crate::profile::{CounterProfile, QsbProfile};
use reader::{Jumped, Reader, TICK_NS, TICK_S};

/// How long a reader may take to answer.
const PATIENCE: Duration = Duration::from_millis(300);
/// How often it is asked.
const ATTEMPTS: usize = 3;
/// How long both stream before their clocks are believed.
const ACQUAINTANCE: Duration = Duration::from_millis(1500);
/// How long they may take to get so far.
const LONGEST_ACQUAINTANCE: Duration = Duration::from_secs(5);
/// How often the clocks are fitted anew.
const REFIT: Duration = Duration::from_millis(500);
/// A reader that is silent for so long while the other one speaks is lost.
const SILENCE: Duration = Duration::from_millis(250);
/// Most samples in a batch: what has piled up is given in several.
const LARGEST_BATCH: usize = 1024;
/// Lines of the output that are kept behind the last instant.
const KEPT: usize = 64;
/// The other one has to be heard so often meanwhile: after a stall of this program both lines are full, and one is read first.
const HEARD: u32 = 8;
/// The readers, as messages call them.
const NAMES: [&str; 2] = ["input", "output"];

/// One reader's line and stream.
struct Side {
    link: Option<Link>,
    port: String,
    reader: Reader,
    fit: Option<ClockFit>,
    buffer: Box<[u8; 4096]>,
    /// The other reader has spoken since, and so often, and this one has not.
    silent_since: Option<(Instant, u32)>,
}

struct Qsb {
    profile: Option<QsbProfile>,
    address: Address,
    sides: [Side; 2],
    base: Instant,
    fitted: Instant,
    /// Ticks of the first sample that was given.
    first_ticks: Option<i64>,
    streams: bool,
}

/// The driver on the input reader's open link; the output reader's port is opened when it is first asked.
#[must_use]
pub fn open(link: Link, address: Address, profile: &CounterProfile) -> Box<dyn Counter> {
    let qsb = profile.qsb.clone();
    let (interval, counts) = qsb.as_ref().map_or((1, [1; 2]), |qsb| (qsb.interval_ticks, qsb.counts_per_rev()));
    let output_port = qsb.as_ref().map_or_else(String::new, |qsb| qsb.output_port.clone());
    let side = |link, port, counts_per_rev| Side {
        link,
        port,
        reader: Reader::new(interval, counts_per_rev),
        fit: None,
        buffer: Box::new([0; 4096]),
        silent_since: None,
    };
    let now = Instant::now();
    Box::new(Qsb {
        profile: qsb,
        sides: [side(Some(link), address.port.clone(), counts[0]), side(None, output_port, counts[1])],
        address,
        base: now,
        fitted: now,
        first_ticks: None,
        streams: false,
    })
}

impl Side {
    /// Reads what there is. Cancelling it loses nothing.
    async fn read(&mut self) -> std::io::Result<usize> {
        match &mut self.link {
            Some(link) => link.read(&mut self.buffer[..]).await,
            None => Err(std::io::ErrorKind::NotConnected.into()),
        }
    }
}

impl Qsb {
    fn failed(&self, which: usize, what: impl std::fmt::Display) -> DeviceError {
        DeviceError::Counter { port: self.sides[which].port.clone(), what: format!("{} reader: {what}", NAMES[which]) }
    }

    fn profile(&self) -> Result<&QsbProfile, DeviceError> {
        self.profile.as_ref().ok_or_else(|| DeviceError::Line {
            device: DeviceKind::Counter,
            port: self.address.port.clone(),
            what: "the profile has no [counter.qsb]; `rigd profile check` says what belongs there".into(),
        })
    }

    /// Opens the output reader's port.
    async fn connect(&mut self) -> Result<(), DeviceError> {
        if self.sides[1].link.is_none() {
            let port = self.profile()?.output_port.clone();
            let address = Address { port, ..self.address.clone() };
            let link = address.open().await.map_err(|error| self.failed(1, error))?;
            self.sides[1].link = Some(link);
        }
        Ok(())
    }

    /// Reads either line; which it was. Cancelling it loses nothing.
    async fn receive(&mut self) -> Result<usize, DeviceError> {
        let [input, output] = &mut self.sides;
        let (which, read) = tokio::select! {
            read = input.read() => (0, read),
            read = output.read() => (1, read),
        };
        self.sort(which, read)?;
        Ok(which)
    }

    /// Hands bytes that were read to their reader.
    fn sort(&mut self, which: usize, read: std::io::Result<usize>) -> Result<(), DeviceError> {
        let count = match read {
            Ok(0) => return Err(self.failed(which, "the line hung up (end of stream)")),
            Ok(count) => count,
            Err(error) => return Err(self.failed(which, format!("the line failed: {error}"))),
        };
        let now = Instant::now();
        let arrived_s = (now - self.base).as_secs_f64();
        let side = &mut self.sides[which];
        side.silent_since = None;
        let outcome = side.reader.feed(&side.buffer[..count], arrived_s);
        let (since, heard) = self.sides[1 - which].silent_since.get_or_insert((now, 0));
        *heard += 1;
        let (since, heard) = (*since, *heard);
        if outcome.is_err() && !self.streams {
            // What it still streams for an earlier master is no stream of ours.
            self.sides[which].reader.begin();
            return Ok(());
        }
        outcome.map_err(|Jumped { last, now }| {
            self.failed(
                which,
                format!(
                    "its stream went from count {} at tick {} to {} at tick {}: it began anew, or its line is disturbed; its zero is lost",
                    last.count, last.ticks, now.count, now.ticks
                ),
            )
        })?;
        if self.streams && now - since > SILENCE && heard >= HEARD {
            let what = format!("it sends nothing for {} ms while the other one does", (now - since).as_millis());
            return Err(self.failed(1 - which, what));
        }
        Ok(())
    }

    /// Sends an instruction until it is answered.
    async fn ask(&mut self, which: usize, instruction: Instruction) -> Result<Answer, DeviceError> {
        let (kind, register) = match instruction {
            Instruction::Write8(register, _) | Instruction::Write16(register, _) => (Kind::Wrote, register),
            Instruction::Read(register) => (Kind::Read, register),
            Instruction::Stream(register) => (Kind::Streamed, register),
        };
        let line = instruction.line();
        for _ in 0..ATTEMPTS {
            self.sides[which].reader.answers.clear();
            self.send(which, &line).await?;
            let deadline = Instant::now() + PATIENCE;
            loop {
                let Ok(read) = timeout_at(deadline, self.sides[which].read()).await else { break };
                self.sort(which, read)?;
                while let Some(answer) = self.sides[which].reader.answers.pop_front() {
                    if answer.register == register && answer.kind == kind {
                        return Ok(answer);
                    }
                    if answer.register == register && answer.kind == Kind::Error {
                        let what = format!("it refused {:?}; check its model and firmware", line.trim_end());
                        return Err(self.failed(which, what));
                    }
                }
            }
        }
        let what = format!(
            "no answer to {:?}, asked {ATTEMPTS} times within {} ms each ({} lines were no answers); check 230400 8N1",
            line.trim_end(),
            PATIENCE.as_millis(),
            self.sides[which].reader.refused
        );
        Err(self.failed(which, what))
    }

    async fn send(&mut self, which: usize, line: &str) -> Result<(), DeviceError> {
        let Some(link) = &mut self.sides[which].link else { return Err(self.failed(which, "its port is not open")) };
        let sent = match link.write_all(line.as_bytes()).await {
            Ok(()) => link.flush().await,
            Err(error) => Err(error),
        };
        sent.map_err(|error| self.failed(which, format!("the line failed: {error}")))
    }

    /// Fits both clocks; the fit before stays where there is no better one.
    fn refit(&mut self) -> bool {
        self.fitted = Instant::now();
        for side in &mut self.sides {
            if let Ok(fit) = side.reader.fit() {
                side.fit = Some(fit);
            }
        }
        self.sides.iter().all(|side| side.fit.is_some())
    }

    /// The next samples on the input's clock; `None` until the output's line after them has arrived.
    ///
    /// An instant of the input reader, t1 ticks, is on the output reader's clock t2 = (host(t1) − offset2) / s2.
    fn pair(&mut self) -> Option<Samples> {
        let (input_fit, output_fit) = (self.sides[0].fit?, self.sides[1].fit?);
        let interval = i64::from(self.profile.as_ref()?.interval_ticks.max(1));
        let [Side { reader: input, .. }, Side { reader: output, .. }] = &mut self.sides;
        let mut batch = Samples::default();
        let mut last: Option<(i64, [i64; 2])> = None;
        while let Some(&sample) = input.samples.front() {
            let at = (input_fit.host_s(sample.ticks as f64) - output_fit.offset_s) / output_fit.seconds_per_tick;
            let after = output.samples.partition_point(|next| next.ticks as f64 <= at);
            let Some(&to) = output.samples.get(after) else { break };
            let from = after.checked_sub(1).map_or(to, |before| output.samples[before]);
            // A later fit may put an instant a little back.
            output.samples.drain(..after.saturating_sub(KEPT));
            let part = (at - from.ticks as f64) / (to.ticks - from.ticks) as f64;
            // Nothing is carried over a line that is missing, nor before the first one (which makes no part).
            let known = (0.0..1.0).contains(&part) && to.ticks - from.ticks == interval;
            let counts = [sample.count, from.count + ((to.count - from.count) as f64 * part).round() as i64];
            match last {
                // A batch is unbroken; the numbers of the next one say what is missing.
                Some((ticks, _)) if !known || sample.ticks != ticks + interval => break,
                _ => input.samples.pop_front(),
            };
            if !known {
                continue;
            }
            let steps = last.map_or(Some([0; 2]), |(_, before)| {
                Some([i32::try_from(counts[0] - before[0]).ok()?, i32::try_from(counts[1] - before[1]).ok()?])
            });
            // Steps that 32 bits do not hold were refused by the reader.
            let Some([input_step, output_step]) = steps else { break };
            if last.is_none() {
                let first = *self.first_ticks.get_or_insert(sample.ticks);
                let since = u64::try_from(sample.ticks - first).unwrap_or(0);
                batch.device_time_ns = since * TICK_NS;
                batch.first_sample = since / interval.unsigned_abs();
                batch.dt_ns = u32::try_from(interval.unsigned_abs() * TICK_NS).unwrap_or(u32::MAX);
                [batch.input_base, batch.output_base] = counts;
            }
            batch.input_delta.push(input_step);
            batch.output_delta.push(output_step);
            last = Some((sample.ticks, counts));
            if batch.len() >= LARGEST_BATCH {
                break;
            }
        }
        (!batch.is_empty()).then_some(batch)
    }
}

#[async_trait(?Send)]
impl Counter for Qsb {
    async fn identify(&mut self) -> Result<CounterIdentity, DeviceError> {
        self.connect().await?;
        self.streams = false;
        let mut versions = [0; 2];
        for (which, version) in versions.iter_mut().enumerate() {
            self.sides[which].reader.begin();
            // Line ends and time stamps first: without them no answer is told from the next.
            self.send(which, &Instruction::Write8(register::END_OF_RESPONSE, END_LF | END_CR | END_TIME).line())
                .await?;
            *version = self.ask(which, Instruction::Read(register::VERSION)).await?.data;
        }
        let qsb = self.profile()?;
        let zero = qsb.zero_counts.map_or(Zero::Begin, Zero::Counts);
        let said = match zero {
            Zero::Counts(counts) => format!("zero at counts {counts:?} by the profile"),
            Zero::Begin | Zero::Index => "zero where the run begins".into(),
        };
        Ok(CounterIdentity {
            text: format!(
                "two QSB readers without index, input on {} (version {:#x}), output on {} (version {:#x}), {} lines/s, {said}",
                self.sides[0].port,
                versions[0],
                self.sides[1].port,
                versions[1],
                qsb.rate_hz()
            ),
            counts_per_rev: qsb.counts_per_rev(),
            lines: qsb.lines,
            max_rate_hz: qsb.rate_hz(),
            own_rate: true,
            zero,
        })
    }

    async fn start(&mut self, _: f64) -> Result<(), DeviceError> {
        let qsb = self.profile()?.clone();
        self.streams = false;
        for which in 0..self.sides.len() {
            for instruction in [
                Instruction::Write8(register::END_OF_RESPONSE, END_LF | END_CR | END_TIME),
                Instruction::Write8(register::MODE, 0),
                // LS7366R, MDR0: bits 0 and 1 are the counts a cycle, all else 0 is free running without index.
                Instruction::Write8(register::MDR0, if qsb.quadrature == 4 { 3 } else { qsb.quadrature }),
                Instruction::Write16(register::THRESHOLD, 0),
                Instruction::Write16(register::INTERVAL, qsb.interval_ticks),
            ] {
                self.ask(which, instruction).await?;
            }
        }
        for which in 0..self.sides.len() {
            let side = &mut self.sides[which];
            side.reader.begin();
            (side.fit, side.silent_since) = (None, None);
            self.send(which, &Instruction::Stream(register::COUNT).line()).await?;
        }
        // The clocks are made acquainted before anything turns.
        self.first_ticks = None;
        let (known, latest) = (Instant::now() + ACQUAINTANCE, Instant::now() + LONGEST_ACQUAINTANCE);
        loop {
            while let Ok(read) = timeout_at(known, self.receive()).await {
                read?;
            }
            if self.refit() {
                break;
            }
            if Instant::now() > latest {
                let which = usize::from(self.sides[0].fit.is_some());
                let error = self.sides[which].reader.fit().err().map_or_else(String::new, |error| error.to_string());
                return Err(self.failed(which, error));
            }
            if let Ok(read) = timeout_at(Instant::now() + PATIENCE, self.receive()).await {
                read?;
            }
        }
        // What streamed meanwhile is of the past; the samples begin now.
        for side in &mut self.sides {
            let kept = side.reader.samples.len().saturating_sub(8);
            side.reader.samples.drain(..kept);
            side.silent_since = None;
        }
        self.streams = true;
        Ok(())
    }

    async fn next(&mut self) -> Result<Samples, DeviceError> {
        loop {
            if let Some(samples) = self.pair() {
                return Ok(samples);
            }
            self.receive().await?;
            if self.fitted.elapsed() > REFIT {
                self.refit();
            }
        }
    }

    async fn stop(&mut self) -> Result<(), DeviceError> {
        self.streams = false;
        // Any other instruction ends a stream.
        for which in 0..self.sides.len() {
            self.ask(which, Instruction::Read(register::VERSION)).await?;
        }
        Ok(())
    }

    fn clocks(&self) -> Option<Clocks> {
        let (input, output) = (self.sides[0].fit?, self.sides[1].fit?);
        let asymmetry_s = self.profile.as_ref()?.transit_difference_ms * 1e-3;
        Some(Clocks {
            drift_ppm: [input.drift_ppm(TICK_S), output.drift_ppm(TICK_S)],
            skew: Skew::between(&input, &output, TICK_S, asymmetry_s),
            refused: [self.sides[0].reader.refused, self.sides[1].reader.refused],
        })
    }
}
