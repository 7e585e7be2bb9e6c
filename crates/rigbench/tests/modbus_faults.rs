//! The Modbus master on lines with faults: no value that the device did not give. The long runs are `just modbus-faults`.

use std::time::Duration;

use rigbench::bus_stress::{self, Brake, Counting, Device, Master, Servo, Tally, Timing, Told, Workload};
use rigbench::proxy::{Fault, FaultPlan};
use rigd::device::bus::BusStatistics;
use rigd::link::{Duplex, Link};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::task::LocalSet;
use wire::modbus::{ClientDecoder, Request, Response, encode_request};

fn pipe() -> (Link, Link) {
    let (near, far) = tokio::io::duplex(4096);
    (Box::new(near), Box::new(far))
}

/// A stress test in simulated time.
fn in_simulated_time<M: Master>(
    transactions: u64,
    device: impl Device + 'static,
    plan: FaultPlan,
    master: impl Fn(Link, &Workload) -> M,
) -> Tally {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build().expect("a runtime");
    LocalSet::new().block_on(&runtime, async {
        let work = device.workload();
        let (mut cable, end) = pipe();
        tokio::task::spawn_local(bus_stress::serve(end, device));
        bus_stress::run(transactions, &work, plan, 1, &mut cable, || Ok(pipe()), |link| master(link, &work))
            .await
            .expect("a cable")
    })
}

fn ours(timing: Timing) -> impl Fn(Link, &Workload) -> rigd::device::bus::Bus {
    move |link, work| timing.master(link, work)
}

#[test]
fn no_value_is_silently_wrong() {
    let timing = Timing::of_a_drive();
    for (name, tally) in [
        ("servo", in_simulated_time(20_000, Servo::default(), timing.faults(1, 0.15), ours(timing))),
        ("brake", in_simulated_time(20_000, Brake::default(), timing.faults(2, 0.15), ours(timing))),
        ("table", in_simulated_time(20_000, Counting::default(), timing.faults(3, 0.15), ours(timing))),
    ] {
        println!("{name}: {tally:?}");
        assert_eq!(tally.silently_wrong, 0, "{name}: {:#?}", tally.examples);
        // It must have been a test: every fault came, and most calls got through.
        for fault in Fault::ALL {
            assert!(tally.faults.get(fault.name()).is_some_and(|count| *count > 0), "{name}: no {}", fault.name());
        }
        assert!(tally.right as f64 > 0.8 * tally.calls as f64, "{name}: {} of {}", tally.right, tally.calls);
        assert!(tally.reconnections > 0);
    }
}

#[test]
fn a_line_in_good_order_costs_nothing() {
    let timing = Timing::of_a_drive();
    let tally = in_simulated_time(2_000, Brake::default(), timing.faults(1, 0.0), ours(timing));
    let BusStatistics { retried, timeouts, damaged, stray_bytes, .. } = tally.statistics;
    assert_eq!((retried, timeouts, damaged, stray_bytes, tally.told), (0, 0, 0, 0, 0));
    assert_eq!(tally.right, tally.calls);
}

/// A master as they are: it finds frames by their head, checks CRC, unit and function, and asks on after a time-out without
/// draining the line.
struct Naive<L> {
    line: L,
    unit: u8,
    received: Vec<u8>,
}

impl<L: Duplex> Naive<L> {
    async fn ask(&mut self, request: &Request) -> Result<Response, Told> {
        // The inter-frame silence it does keep.
        tokio::time::sleep(Duration::from_millis(10)).await;
        let frame = encode_request(self.unit, request).expect("a request");
        self.line.write_all(&frame).await.map_err(|_| Told::HungUp)?;
        let mut buffer = [0; 256];
        // As an operating system's buffer takes what comes.
        while let Ok(Ok(count @ 1..)) = tokio::time::timeout(Duration::ZERO, self.line.read(&mut buffer)).await {
            self.received.extend_from_slice(&buffer[..count]);
        }
        loop {
            if let Some(frame) = self.take_frame() {
                let count = frame[2] / 2;
                // Asking for what came leaves CRC, unit and function to be checked.
                let fits = match request {
                    Request::ReadHolding { address, .. } => {
                        Request::ReadHolding { address: *address, count: u16::from(count) }
                    }
                    other => other.clone(),
                };
                return ClientDecoder::new(self.unit, &fits).feed(&frame).ok().flatten().ok_or(Told::Failed);
            }
            match tokio::time::timeout(Duration::from_millis(100), self.line.read(&mut buffer)).await {
                Err(_) => return Err(Told::Failed),
                Ok(Ok(0) | Err(_)) => return Err(Told::HungUp),
                Ok(Ok(count)) => self.received.extend_from_slice(&buffer[..count]),
            }
        }
    }

    fn take_frame(&mut self) -> Option<Vec<u8>> {
        let length = match self.received.as_slice() {
            [_, 3, bytes, ..] => 5 + usize::from(*bytes),
            [_, 16, ..] => 8,
            _ => return None,
        };
        (self.received.len() >= length).then(|| self.received.drain(..length).collect())
    }
}

impl<L: Duplex> Master for Naive<L> {
    async fn read(&mut self, first: u16, count: u16) -> Result<Vec<u16>, Told> {
        match self.ask(&Request::ReadHolding { address: first, count }).await? {
            Response::Registers(words) => Ok(words),
            _ => Err(Told::Failed),
        }
    }

    async fn write(&mut self, first: u16, values: &[u16]) -> Result<(), Told> {
        match self.ask(&Request::WriteMultiple { address: first, values: values.to_vec() }).await? {
            Response::WroteMultiple { .. } => Ok(()),
            _ => Err(Told::Failed),
        }
    }

    fn statistics(&self) -> BusStatistics {
        BusStatistics::default()
    }
}

/// The check itself can fail: late answers alone make a master without drain return other requests' values.
#[test]
fn a_master_without_drain_is_caught() {
    for kind in [Fault::Late, Fault::Duplicated, Fault::Overtaken] {
        let mut plan = Timing::of_a_drive().faults(1, 0.1);
        plan.kinds = vec![kind];
        let tally = in_simulated_time(5_000, Servo::default(), plan, |line, work| Naive {
            line,
            unit: work.unit,
            received: Vec::new(),
        });
        println!("{}: {} of {} calls silently wrong", kind.name(), tally.silently_wrong, tally.calls);
        assert!(tally.silently_wrong > 100, "{}: {tally:?}", kind.name());
    }
}

/// A process that ends with its test.
struct Server(std::process::Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A server of another hand, over pseudo-terminals in real time; `./test` names the Python that has it.
#[test]
fn no_value_of_pymodbus_is_silently_wrong() {
    use std::io::BufRead as _;
    let Some(python) = std::env::var_os("RIG_PYTHON") else {
        println!("RIG_PYTHON is not set: not tried");
        return;
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let directory = tempfile::TempDir::new().unwrap();
    let tally = LocalSet::new().block_on(&runtime, async {
        let path = directory.path().join("server");
        let (device, _terminal) = rigsim::pty::Terminal::at(&path).unwrap();
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scripts/modbus_server.py");
        let mut command = std::process::Command::new(python);
        let mut server =
            Server(command.arg(script).arg(&path).stdout(std::process::Stdio::piped()).spawn().expect("Python starts"));
        let output = std::io::BufReader::new(server.0.stdout.take().unwrap());
        assert!(output.lines().map_while(Result::ok).any(|line| line == "ready"), "pymodbus did not start");
        let (timing, work) = (Timing::brisk(), Counting::WORKLOAD);
        let mut cable: Link = Box::new(device);
        let pty = || {
            let (near, far) = tokio_serial::SerialStream::pair()?;
            Ok((Box::new(near) as Link, Box::new(far) as Link))
        };
        let plan = timing.faults(1, 0.15);
        bus_stress::run(300, &work, plan, 1, &mut cable, pty, |link| timing.master(link, &work)).await.unwrap()
    });
    println!("{tally:?}");
    assert_eq!(tally.silently_wrong, 0, "{:#?}", tally.examples);
    assert!(tally.fault_count() > 30 && tally.right as f64 > 0.7 * tally.calls as f64, "{tally:?}");
}
