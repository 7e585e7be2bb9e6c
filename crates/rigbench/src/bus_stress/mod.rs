//! A stress test of a Modbus master on a line with faults: every value it returns is compared with what the device answered.
//!
//! A value is *silently wrong* when the master returns it as good and the device gave no such answer to that question since the
//! call began; a write is, when the master calls it done and the device did not confirm it. An error is not: it was told.

mod device;
mod workload;

use std::cell::RefCell;
use std::fmt::Write as _;
use std::rc::Rc;
use std::time::Duration;

use rand::RngExt as _;
use rand_pcg::Pcg64;
use serde::Serialize;
use wire::modbus::{Request, Response};

pub use device::{Brake, Counting, Device, Servo, serve};
pub use workload::Workload;

use super::proxy::{End, FaultPlan, Proxy, Record};
use rigd::device::DeviceKind;
use rigd::device::bus::{Bus, BusError, BusStatistics, BusTiming, LateReplyWindow};
use rigd::link::{Address, Duplex, Link};

/// What a master is asked to do.
#[expect(async_fn_in_trait, reason = "stress tests run within one task")]
pub trait Master {
    /// Reads registers.
    async fn read(&mut self, first: u16, count: u16) -> Result<Vec<u16>, Told>;
    /// Writes registers and makes sure of it.
    async fn write(&mut self, first: u16, values: &[u16]) -> Result<(), Told>;
    /// What happened on its line.
    fn statistics(&self) -> BusStatistics;
}

/// A failure that the master told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Told {
    /// The transaction failed.
    Failed,
    /// The port is gone.
    HungUp,
}

impl Master for Bus {
    async fn read(&mut self, first: u16, count: u16) -> Result<Vec<u16>, Told> {
        Self::read(self, first, count).await.map_err(|error| told(&error))
    }

    async fn write(&mut self, first: u16, values: &[u16]) -> Result<(), Told> {
        Self::write(self, first, values).await.map_err(|error| told(&error))
    }

    fn statistics(&self) -> BusStatistics {
        Self::statistics(self)
    }
}

fn told(error: &BusError) -> Told {
    if matches!(error, BusError::HungUp { .. }) { Told::HungUp } else { Told::Failed }
}

/// How the line is used, and how late its answers may be.
#[derive(Debug, Clone, Copy)]
pub struct Timing {
    /// Of the master.
    pub manners: BusTiming,
    /// Of the master's memory; faults stay within it.
    pub horizon: LateReplyWindow,
}

impl Timing {
    /// As on a servo's line.
    #[must_use]
    pub fn of_a_drive() -> Self {
        Self {
            manners: BusTiming {
                silence: Duration::from_millis(10),
                patience: Duration::from_millis(100),
                attempts: 3,
            },
            horizon: LateReplyWindow::default(),
        }
    }

    /// Several times as fast, for real time.
    #[must_use]
    pub fn brisk() -> Self {
        Self {
            manners: BusTiming { silence: Duration::from_millis(2), patience: Duration::from_millis(30), attempts: 3 },
            horizon: LateReplyWindow { late: Duration::from_millis(150), repeated: Duration::from_millis(60) },
        }
    }

    /// Faults in a share of requests and of answers, inside the master's horizon.
    #[must_use]
    pub fn faults(&self, seed: u64, share: f64) -> FaultPlan {
        FaultPlan::new(seed, share, self.horizon.late.mul_f64(0.9), self.horizon.repeated.mul_f64(0.9))
    }

    /// The project's own master on a link.
    #[must_use]
    pub fn master(&self, link: Link, work: &Workload) -> Bus {
        let address = Address { device: DeviceKind::Servo, port: "bench".into(), baud: 115_200, format: "8N1".into() };
        Bus::new(link, address, work.unit, self.manners).with_spans(work.spans).with_late_replies(self.horizon)
    }
}

/// What came of a stress test.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Tally {
    /// Reads and writes asked of the master.
    pub calls: u64,
    /// Requests that it sent.
    pub transactions: u64,
    /// Requests that the device answered.
    pub exchanges: u64,
    /// Calls that returned a value, or a write done, and were right.
    pub right: u64,
    /// Calls that told a failure.
    pub told: u64,
    /// Calls that returned what the device never answered: must be 0.
    pub silently_wrong: u64,
    /// The first of them.
    pub examples: Vec<String>,
    /// Reconnections after the port had hung up.
    pub reconnections: u64,
    /// Faults put in, by kind.
    pub faults: std::collections::BTreeMap<&'static str, u64>,
    /// What the master says of its line.
    pub statistics: BusStatistics,
}

impl Tally {
    /// Faults put in.
    #[must_use]
    pub fn fault_count(&self) -> u64 {
        self.faults.values().sum()
    }

    fn wrong(&mut self, what: String) {
        self.silently_wrong += 1;
        if self.examples.len() < 10 {
            self.examples.push(what);
        }
    }

    fn add(&mut self, line: &BusStatistics) {
        let sum = &mut self.statistics;
        sum.answered += line.answered;
        sum.retried += line.retried;
        sum.timeouts += line.timeouts;
        sum.damaged += line.damaged;
        sum.refused += line.refused;
        sum.rewritten += line.rewritten;
        sum.stray_bytes += line.stray_bytes;
        sum.waited += line.waited;
        sum.total_us += line.total_us;
        sum.slowest_us = sum.slowest_us.max(line.slowest_us);
    }
}

/// Runs a stress test until the master has sent so many requests. `connect` gives both ends of the master's side of the cable.
///
/// # Errors
/// When the cable cannot be made.
pub async fn run<M: Master, D: Duplex>(
    transactions: u64,
    work: &Workload,
    plan: FaultPlan,
    seed: u64,
    device: &mut D,
    mut connect: impl FnMut() -> std::io::Result<(Link, Link)>,
    mut master_on: impl FnMut(Link) -> M,
) -> std::io::Result<Tally> {
    let record = Rc::new(RefCell::new(Record::default()));
    let mut proxy = Proxy::new(plan, Rc::clone(&record));
    let mut caller = Caller {
        work,
        record: Rc::clone(&record),
        transactions,
        random: Pcg64::new(u128::from(seed), 0x1405_7b7e_f767_814f),
        tally: Tally::default(),
    };
    while record.borrow().requests < transactions {
        let (near, far) = connect()?;
        let mut master = master_on(far);
        let ended = {
            let mut calls = std::pin::pin!(caller.call(&mut master));
            tokio::select! {
                end = proxy.carry(near, device) => {
                    if end == End::HungUp {
                        // The master finds out by itself.
                        calls.await;
                    }
                    Some(end)
                }
                () = &mut calls => None,
            }
        };
        caller.tally.add(&master.statistics());
        match ended {
            Some(End::HungUp) => caller.tally.reconnections += 1,
            Some(End::DeviceGone) => return Err(std::io::Error::other("the device closed its line")),
            _ => {}
        }
    }
    let record = record.borrow();
    let mut tally = caller.tally;
    (tally.transactions, tally.exchanges, tally.faults) = (record.requests, record.answered, record.faults.clone());
    Ok(tally)
}

/// Who asks the master, and checks what it says.
struct Caller<'a> {
    work: &'a Workload,
    record: Rc<RefCell<Record>>,
    transactions: u64,
    random: Pcg64,
    tally: Tally,
}

impl Caller<'_> {
    /// Asks until the port hangs up or enough was sent.
    async fn call(&mut self, master: &mut impl Master) {
        while self.record.borrow().requests < self.transactions {
            self.tally.calls += 1;
            let writes = self.work.writes;
            let outcome = if !writes.is_empty() && self.random.random_range(0..4) == 0 {
                let (first, count, largest) = writes[self.random.random_range(0..writes.len())];
                let mut values = vec![0; usize::from(count)];
                values[0] = self.random.random_range(1..=largest);
                self.write(master, first, &values).await
            } else {
                let (first, count) = self.work.reads[self.random.random_range(0..self.work.reads.len())];
                self.read(master, first, count).await
            };
            match outcome {
                Ok(()) => {}
                Err(Told::Failed) => self.tally.told += 1,
                Err(Told::HungUp) => {
                    self.tally.told += 1;
                    return;
                }
            }
        }
    }

    async fn read(&mut self, master: &mut impl Master, first: u16, count: u16) -> Result<(), Told> {
        let mark = self.record.borrow().answered;
        let words = master.read(first, count).await?;
        let record = self.record.borrow();
        if record.since(mark).any(|exchange| holds(&exchange.request, &exchange.response, first, &words)) {
            self.tally.right += 1;
            return Ok(());
        }
        let mut said = format!("read {count} words at {first:#06x}: got {words:?}, the device answered");
        for exchange in record.since(mark) {
            let _ = write!(said, " [{}: {:?}]", exchange.request, exchange.response);
        }
        drop(record);
        self.tally.wrong(said);
        Ok(())
    }

    async fn write(&mut self, master: &mut impl Master, first: u16, values: &[u16]) -> Result<(), Told> {
        let mark = self.record.borrow().answered;
        master.write(first, values).await?;
        let record = self.record.borrow();
        // The last that the device did to this register is what was asked.
        let last = record.since(mark).filter(|exchange| wrote(&exchange.request, &exchange.response, first)).last();
        let done = last.is_some_and(|exchange| match &exchange.request {
            Request::WriteSingle { value, .. } => values == [*value],
            Request::WriteMultiple { values: written, .. } => written == values,
            Request::ReadHolding { .. } => false,
        });
        // Or the device itself showed it afterwards: confirmations of one register's writes look all alike.
        let covers = |request: &Request| {
            matches!(request, Request::ReadHolding { .. })
                && request.address() <= first
                && u32::from(request.address()) + u32::from(request.count()) >= u32::from(first) + values.len() as u32
        };
        let read = record.since(mark).filter(|exchange| covers(&exchange.request)).last();
        let shown = read.is_some_and(|exchange| holds(&exchange.request, &exchange.response, first, values));
        drop(record);
        if done || shown {
            self.tally.right += 1;
        } else {
            self.tally.wrong(format!("write {values:?} to {first:#06x}: called done, the device did not do it"));
        }
        Ok(())
    }
}

/// Whether an exchange holds these words at this place.
fn holds(request: &Request, response: &Response, first: u16, words: &[u16]) -> bool {
    match (request, response) {
        (Request::ReadHolding { address, .. }, Response::Registers(answered)) => first
            .checked_sub(*address)
            .and_then(|offset| answered.get(usize::from(offset)..usize::from(offset) + words.len()))
            .is_some_and(|part| part == words),
        _ => false,
    }
}

/// Whether an exchange wrote at this place.
fn wrote(request: &Request, response: &Response, first: u16) -> bool {
    request.address() == first
        && !matches!(request, Request::ReadHolding { .. })
        && !matches!(response, Response::Exception(_))
}
