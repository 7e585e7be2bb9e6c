//! Modbus RTU master: one owner a line, silences kept, late answers never taken for the next one's.
//!
//! Well-kept masters return a late answer as the value of the next request; the rules here exist so that this cannot happen:
//!
//! 1. a line has one owner, a task (`owner`); what it begins it ends, whoever stops waiting;
//! 2. silence before and after each frame; bytes that come when none are due are counted and thrown away;
//! 3. after any time-out, damage or stray byte the line is drained until it has been silent;
//! 4. an answer must match unit, function, length and echo (`wire::modbus::ClientDecoder`);
//! 5. consecutive reads are of different lengths: none is sent whose answer could be that of an earlier request (`memory`);
//! 6. writes are read back, and written again once when they read otherwise.
//!
//! What is left: an answer later than [`LateReplyWindow`] that also overtakes the order of the line, and damage that a CRC of 16 bits
//! does not show (never up to three flipped bits or a burst of 16; else once in 65 536 damaged frames).

mod error;
mod memory;
mod owner;
mod statistics;
mod timing;

use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::{mpsc, oneshot};
use wire::DeviceKind;
use wire::register_map::{RegisterDef, RegisterError};

pub use error::BusError;
pub use memory::LateReplyWindow;
use owner::{Ask, Job, Owner, Range};
pub use statistics::BusStatistics;
pub use timing::{BusTiming, Span};

use crate::link::{Address, Link};

/// Transactions that may wait for the line; a driver asks one after another.
const QUEUE: usize = 4;
/// How often a setting is written that reads back otherwise.
const WRITES: u32 = 2;

/// Master of one line with one device.
pub struct Bus {
    device: DeviceKind,
    port: String,
    /// Until the first transaction starts its task.
    owner: Option<Owner>,
    jobs: mpsc::Sender<Job>,
    task: Option<tokio::task::AbortHandle>,
    statistics: Arc<Mutex<BusStatistics>>,
}

impl Bus {
    /// A master on `link`. Its task starts with the first transaction, in the runtime that asks for it.
    #[must_use]
    pub fn new(link: Link, address: Address, unit: u8, timing: BusTiming) -> Self {
        let statistics = Arc::new(Mutex::new(BusStatistics::default()));
        let (jobs, queue) = mpsc::channel(QUEUE);
        let (device, port) = (address.device, address.port.clone());
        let owner = Some(Owner::new(link, address, unit, timing, queue, Arc::clone(&statistics)));
        Self { device, port, owner, jobs, task: None, statistics }
    }

    /// The same with ranges that may be read as a whole. Before the first transaction.
    #[must_use]
    pub fn with_spans(mut self, spans: &[Span]) -> Self {
        if let Some(owner) = &mut self.owner {
            owner.spans = spans.to_vec();
        }
        self
    }

    /// The same with another window. Before the first transaction.
    #[must_use]
    pub fn with_late_replies(mut self, late_replies: LateReplyWindow) -> Self {
        if let Some(owner) = &mut self.owner {
            owner.set_late_replies(late_replies);
        }
        self
    }

    /// What happened so far.
    #[must_use]
    pub fn statistics(&self) -> BusStatistics {
        *self.statistics.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Port of the line, for messages.
    #[must_use]
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Reads one value.
    ///
    /// # Errors
    /// As [`Bus::read`].
    pub async fn get(&mut self, register: &RegisterDef) -> Result<f64, BusError> {
        let words = self.read(register.address, register.words()).await?;
        register.decode(&words).map_err(|reason| self.value_error(reason))
    }

    /// Reads several values, in one request where the spans allow it.
    ///
    /// # Errors
    /// As [`Bus::read`].
    pub async fn get_all(&mut self, registers: &[&RegisterDef]) -> Result<Vec<f64>, BusError> {
        let ranges = registers.iter().map(|def| Range { first: def.address, count: def.words() }).collect();
        let parts = self.ask(Ask::Read(ranges)).await?;
        let values = registers.iter().zip(parts).map(|(register, words)| register.decode(&words));
        values.collect::<Result<_, _>>().map_err(|reason| self.value_error(reason))
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
        BusError::Value { device: self.device, port: self.port.clone(), reason }
    }

    /// Reads `count` registers from `register`.
    ///
    /// # Errors
    /// [`BusError`] when the device is silent, damaged, refuses, or is gone.
    pub async fn read(&mut self, register: u16, count: u16) -> Result<Vec<u16>, BusError> {
        let parts = self.ask(Ask::Read(vec![Range { first: register, count }])).await?;
        Ok(parts.into_iter().next().unwrap_or_default())
    }

    /// Writes registers and reads them back.
    ///
    /// # Errors
    /// [`BusError::ReadBack`] when they differ after a second write too, else as [`Bus::read`].
    pub async fn write(&mut self, register: u16, values: &[u16]) -> Result<(), BusError> {
        let mut read = Vec::new();
        for write in 0..WRITES {
            if write > 0 {
                self.statistics.lock().unwrap_or_else(PoisonError::into_inner).rewritten += 1;
            }
            self.write_unverified(register, values).await?;
            read = self.read(register, u16::try_from(values.len()).unwrap_or(u16::MAX)).await?;
            if read == values {
                return Ok(());
            }
        }
        Err(BusError::ReadBack { device: self.device, port: self.port.clone(), register, wrote: values.to_vec(), read })
    }

    /// Writes registers whose value cannot be read back (a command, not a setting). The caller looks at its effect.
    ///
    /// # Errors
    /// As [`Bus::read`].
    pub async fn write_unverified(&mut self, register: u16, values: &[u16]) -> Result<(), BusError> {
        self.ask(Ask::Write { first: register, values: values.to_vec() }).await.map(drop)
    }

    async fn ask(&mut self, ask: Ask) -> Result<Vec<Vec<u16>>, BusError> {
        if let Some(owner) = self.owner.take() {
            self.task = Some(tokio::spawn(owner.run()).abort_handle());
        }
        let (reply, answer) = oneshot::channel();
        if self.jobs.send(Job { ask, reply }).await.is_ok()
            && let Ok(outcome) = answer.await
        {
            return outcome;
        }
        Err(BusError::HungUp { device: self.device, port: self.port.clone(), reason: "its task has ended".into() })
    }
}

impl Drop for Bus {
    fn drop(&mut self) {
        // The line is closed with the driver, whatever is under way on it.
        if let Some(task) = &self.task {
            task.abort();
        }
    }
}
