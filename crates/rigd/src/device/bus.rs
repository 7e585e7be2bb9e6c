//! Modbus RTU master: one owner a line, silences kept, late answers never taken for the next one's.
//!
//! Well-kept masters return a late answer as the value of the next request; the rules here exist so that this cannot happen:
//! after any time-out or damaged frame the line is drained until it has been silent, and an answer must match unit, function,
//! length and echo (checked by `wire::modbus::ClientDecoder`).

use std::time::Duration;

use thiserror::Error;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::time::{Instant, timeout_at};
use wire::modbus::{self, ClientDecoder, ExceptionCode, Request, Response};
use wire::register_map::{RegisterDef, RegisterError};

use crate::link::{Address, Link};

/// How a device wants its line used.
#[derive(Debug, Clone, Copy)]
pub struct Manners {
    /// Silence before a request and after an answer.
    pub silence: Duration,
    /// Longest wait for an answer, beyond its time on the wire.
    pub patience: Duration,
    /// How often a request is sent before the device counts as lost.
    pub attempts: u32,
}

/// What happened on a line so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BusStatistics {
    /// Requests answered.
    pub answered: u64,
    /// Requests sent again.
    pub retried: u64,
    /// Answers that were late or never came.
    pub timeouts: u64,
    /// Answers that were damaged or did not fit.
    pub damaged: u64,
}

impl std::fmt::Display for BusStatistics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { answered, retried, timeouts, damaged } = self;
        write!(f, "{answered} requests answered, {retried} sent again ({timeouts} timed out, {damaged} damaged)")
    }
}

/// Why a transaction failed.
#[derive(Debug, Error)]
pub enum BusError {
    /// No answer.
    #[error(
        "{device} on {port} (unit {unit}) did not answer {attempts} requests ({request}) within {patience_ms} ms each; check power, cable, baud {baud} {format}, and the unit number"
    )]
    Silent {
        /// Which device.
        device: &'static str,
        /// Its port.
        port: String,
        /// Its unit.
        unit: u8,
        /// How often it was asked.
        attempts: u32,
        /// What it was asked.
        request: String,
        /// How long each time, ms.
        patience_ms: u128,
        /// Line speed.
        baud: u32,
        /// Character format.
        format: String,
    },
    /// Only damaged answers.
    #[error(
        "{device} on {port} (unit {unit}) answered {request} with a damaged frame {attempts} times, last: {reason}; check wiring, termination, baud {baud} {format}, and that no second device has this unit number"
    )]
    Damaged {
        /// Which device.
        device: &'static str,
        /// Its port.
        port: String,
        /// Its unit.
        unit: u8,
        /// How often it was asked.
        attempts: u32,
        /// What it was asked.
        request: String,
        /// What was wrong with the last answer.
        reason: modbus::ResponseError,
        /// Line speed.
        baud: u32,
        /// Character format.
        format: String,
    },
    /// The device refused.
    #[error("{device} on {port} (unit {unit}) refused {request}: {code}")]
    Refused {
        /// Which device.
        device: &'static str,
        /// Its port.
        port: String,
        /// Its unit.
        unit: u8,
        /// What it was asked.
        request: String,
        /// The exception.
        code: ExceptionCode,
    },
    /// The request cannot be put into a frame.
    #[error("{device}: {request} is not a request: {reason}")]
    Unaskable {
        /// Which device.
        device: &'static str,
        /// What was to be asked.
        request: String,
        /// Why it cannot.
        reason: modbus::EncodeError,
    },
    /// A value does not fit its register.
    #[error("{device} on {port}: {reason}")]
    Value {
        /// Which device.
        device: &'static str,
        /// Its port.
        port: String,
        /// The register, the value and the limit.
        reason: RegisterError,
    },
    /// The line is gone.
    #[error("{device}: port {port} hung up ({reason}); check the plug, then start again")]
    HungUp {
        /// Which device.
        device: &'static str,
        /// Its port.
        port: String,
        /// The reason.
        reason: String,
    },
    /// A written value came back otherwise.
    #[error(
        "{device} on {port}: register {register:#06x} was written {wrote:?} and reads back {read:?}; is the parameter locked, or another master on the line?"
    )]
    ReadBack {
        /// Which device.
        device: &'static str,
        /// Its port.
        port: String,
        /// First register.
        register: u16,
        /// What was written.
        wrote: Vec<u16>,
        /// What was read.
        read: Vec<u16>,
    },
}

/// Longest wait for a line to fall silent: shorter than any lease, so that one chattering device never costs the other's.
const DRAIN_LIMIT: Duration = Duration::from_millis(250);

/// Master of one line with one device.
pub struct Bus {
    link: Link,
    address: Address,
    unit: u8,
    manners: Manners,
    quiet_since: Instant,
    suspect: bool,
    statistics: BusStatistics,
}

enum Attempt {
    TimedOut,
    Damaged(modbus::ResponseError),
}

impl Bus {
    /// A master on `link`.
    #[must_use]
    pub fn new(link: Link, address: Address, unit: u8, manners: Manners) -> Self {
        let silence = modbus::inter_frame_silence(address.baud);
        let manners = Manners { silence: manners.silence.max(silence), ..manners };
        Self {
            link,
            address,
            unit,
            manners,
            quiet_since: Instant::now(),
            suspect: true,
            statistics: BusStatistics::default(),
        }
    }

    /// What happened so far.
    #[must_use]
    pub fn statistics(&self) -> BusStatistics {
        self.statistics
    }

    /// Port of the line, for messages.
    #[must_use]
    pub fn port(&self) -> &str {
        &self.address.port
    }

    /// Reads one value.
    ///
    /// # Errors
    /// As [`Bus::read`].
    pub async fn get(&mut self, register: &RegisterDef) -> Result<f64, BusError> {
        let words = self.read(register.address, register.words()).await?;
        register.decode(&words).map_err(|reason| self.value_error(reason))
    }

    /// Writes one value and reads it back.
    ///
    /// # Errors
    /// As [`Bus::write`]; [`BusError::Value`] when the value does not fit.
    pub async fn set(&mut self, register: &RegisterDef, value: f64) -> Result<(), BusError> {
        let words = register.encode(value).map_err(|reason| self.value_error(reason))?;
        self.write(register.address, &words).await
    }

    /// Which register, value and limit, with the device and its port.
    pub fn value_error(&self, reason: RegisterError) -> BusError {
        BusError::Value { device: self.address.device, port: self.address.port.clone(), reason }
    }

    /// Reads `count` registers from `register`.
    ///
    /// # Errors
    /// [`BusError`] when the device is silent, damaged, refuses, or is gone.
    pub async fn read(&mut self, register: u16, count: u16) -> Result<Vec<u16>, BusError> {
        match self.transact(&Request::ReadHolding { address: register, count }).await? {
            Response::Registers(values) => Ok(values),
            // The decoder checks function and count, so nothing else arrives here.
            _ => Ok(Vec::new()),
        }
    }

    /// Writes registers and reads them back.
    ///
    /// # Errors
    /// [`BusError::ReadBack`] when they differ, else as [`Bus::read`].
    pub async fn write(&mut self, register: u16, values: &[u16]) -> Result<(), BusError> {
        self.write_unverified(register, values).await?;
        let read = self.read(register, values.len() as u16).await?;
        if read == values {
            return Ok(());
        }
        Err(BusError::ReadBack {
            device: self.address.device,
            port: self.address.port.clone(),
            register,
            wrote: values.to_vec(),
            read,
        })
    }

    /// Writes registers whose value cannot be read back (a command, not a setting).
    ///
    /// # Errors
    /// As [`Bus::read`].
    pub async fn write_unverified(&mut self, register: u16, values: &[u16]) -> Result<(), BusError> {
        let request = match values {
            [value] => Request::WriteSingle { address: register, value: *value },
            _ => Request::WriteMultiple { address: register, values: values.to_vec() },
        };
        self.transact(&request).await.map(drop)
    }

    /// One request and its answer, sent again after silence or damage. All requests here may be repeated: they set states.
    async fn transact(&mut self, request: &Request) -> Result<Response, BusError> {
        let mut last = Attempt::TimedOut;
        for attempt in 0..self.manners.attempts {
            if attempt > 0 {
                self.statistics.retried += 1;
            }
            if self.suspect {
                self.drain().await?;
            }
            match self.attempt(request).await? {
                Ok(Response::Exception(code)) => {
                    self.statistics.answered += 1;
                    return Err(BusError::Refused {
                        device: self.address.device,
                        port: self.address.port.clone(),
                        unit: self.unit,
                        request: request.to_string(),
                        code,
                    });
                }
                Ok(response) => {
                    self.statistics.answered += 1;
                    return Ok(response);
                }
                Err(failure) => {
                    self.suspect = true;
                    match &failure {
                        Attempt::TimedOut => self.statistics.timeouts += 1,
                        Attempt::Damaged(_) => self.statistics.damaged += 1,
                    }
                    last = failure;
                }
            }
        }
        let (device, port, unit, attempts) =
            (self.address.device, self.address.port.clone(), self.unit, self.manners.attempts);
        let (baud, format, request) = (self.address.baud, self.address.format.clone(), request.to_string());
        Err(match last {
            Attempt::TimedOut => BusError::Silent {
                device,
                port,
                unit,
                attempts,
                request,
                patience_ms: self.manners.patience.as_millis(),
                baud,
                format,
            },
            Attempt::Damaged(reason) => {
                BusError::Damaged { device, port, unit, attempts, request, reason, baud, format }
            }
        })
    }

    async fn attempt(&mut self, request: &Request) -> Result<Result<Response, Attempt>, BusError> {
        tokio::time::sleep_until(self.quiet_since + self.manners.silence).await;
        let frame = modbus::encode_request(self.unit, request).map_err(|reason| BusError::Unaskable {
            device: self.address.device,
            request: request.to_string(),
            reason,
        })?;
        self.send(&frame).await?;
        // 11 bits a character at most; both frames pass the wire before patience begins.
        let characters = frame.len() + request.response_len();
        let on_wire = Duration::from_secs_f64(characters as f64 * 11.0 / f64::from(self.address.baud));
        let deadline = Instant::now() + on_wire + self.manners.patience;
        let mut decoder = ClientDecoder::new(self.unit, request);
        let mut buffer = [0; 256];
        loop {
            let count = match timeout_at(deadline, self.link.read(&mut buffer)).await {
                Err(_) => return Ok(Err(Attempt::TimedOut)),
                Ok(outcome) => self.received(outcome)?,
            };
            match decoder.feed(&buffer[..count]) {
                Ok(None) => {}
                Ok(Some(response)) => return Ok(Ok(response)),
                Err(error) => return Ok(Err(Attempt::Damaged(error))),
            }
        }
    }

    /// Reads and discards until the line has been silent, so that a late answer is gone before the next request.
    async fn drain(&mut self) -> Result<(), BusError> {
        let mut buffer = [0; 256];
        let quiet = self.manners.silence.max(Duration::from_millis(20));
        // A line that never falls silent is not Modbus; the request that follows will tell.
        let give_up = Instant::now() + DRAIN_LIMIT;
        while Instant::now() < give_up {
            match tokio::time::timeout(quiet, self.link.read(&mut buffer)).await {
                Err(_) => break,
                Ok(outcome) => {
                    self.received(outcome)?;
                }
            }
        }
        self.suspect = false;
        Ok(())
    }

    async fn send(&mut self, frame: &[u8]) -> Result<(), BusError> {
        let sent = match self.link.write_all(frame).await {
            Ok(()) => self.link.flush().await,
            Err(error) => Err(error),
        };
        self.quiet_since = Instant::now();
        sent.map_err(|error| self.hung_up(error.to_string()))
    }

    /// Zero bytes for ever is how a hung-up line shows.
    fn received(&mut self, outcome: std::io::Result<usize>) -> Result<usize, BusError> {
        self.quiet_since = Instant::now();
        match outcome {
            Ok(0) => Err(self.hung_up("end of stream".into())),
            Ok(count) => Ok(count),
            Err(error) => Err(self.hung_up(error.to_string())),
        }
    }

    fn hung_up(&self, reason: String) -> BusError {
        BusError::HungUp { device: self.address.device, port: self.address.port.clone(), reason }
    }
}
