//! The long stress test of the Modbus master: a cable with faults between it and a device, every value compared with what the device said.
//!
//! ```text
//! cargo run --release -p rigd --example modbus_faults -- --device servo --transactions 1000000            # simulated time
//! cargo run --release -p rigd --example modbus_faults -- --device servo --over pty --transactions 10000   # real time
//! cargo run --release -p rigd --example modbus_faults -- --device pymodbus --transactions 10000           # its server, over ptys
//! ```
//!
//! Prints one JSON object; exit code 1 when a value was silently wrong.

use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, ExitCode, Stdio};

use clap::{Parser, ValueEnum};
use rigbench::bus_stress::{self, Brake, Counting, Device, Servo, Tally, Timing, Workload};
use rigd::link::Link;
use rigsim::pty::Terminal;
use tokio::task::LocalSet;
use tokio_serial::SerialStream;

#[derive(Debug, Parser)]
struct Args {
    /// Who answers
    #[arg(long, value_enum)]
    device: Which,
    /// What carries the bytes
    #[arg(long, value_enum, default_value = "pipe")]
    over: Over,
    /// Requests to send
    #[arg(long, default_value_t = 10_000)]
    transactions: u64,
    /// Share of requests, and of answers, that a fault meets
    #[arg(long, default_value_t = 0.15)]
    share: f64,
    /// Of faults and calls
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Python that has pymodbus
    #[arg(long, default_value = ".venv/bin/python")]
    python: PathBuf,
}

#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum Which {
    /// The emulated drive
    Servo,
    /// The emulated current source
    Brake,
    /// A table that counts
    Table,
    /// The server of pymodbus, in a process of its own
    Pymodbus,
}

#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum Over {
    /// Pipes, in simulated time
    Pipe,
    /// Pseudo-terminals, in real time
    Pty,
}

type Failure = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    let args = Args::parse();
    let outcome = match args.device {
        Which::Servo => emulated(&args, Servo::default()),
        Which::Brake => emulated(&args, Brake::default()),
        Which::Table => emulated(&args, Counting::default()),
        Which::Pymodbus => pymodbus(&args),
    };
    match outcome.and_then(|tally| Ok((serde_json::to_string_pretty(&tally)?, tally.silently_wrong))) {
        Ok((json, wrong)) => {
            println!("{json}");
            if wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn pipe() -> (Link, Link) {
    let (near, far) = tokio::io::duplex(4096);
    (Box::new(near), Box::new(far))
}

/// Both ends of a new pseudo-terminal.
fn pty() -> std::io::Result<(Link, Link)> {
    let (near, far) = SerialStream::pair()?;
    Ok((Box::new(near), Box::new(far)))
}

fn emulated(args: &Args, device: impl Device + 'static) -> Result<Tally, Failure> {
    let simulated = args.over == Over::Pipe;
    let timing = if simulated { Timing::of_a_drive() } else { Timing::brisk() };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(simulated).build()?;
    LocalSet::new().block_on(&runtime, async {
        let work = device.workload();
        let (mut cable, end) = if simulated { pipe() } else { pty()? };
        tokio::task::spawn_local(bus_stress::serve(end, device));
        let connect = || if simulated { Ok(pipe()) } else { pty() };
        Ok(drive(args, timing, &work, &mut cable, connect).await?)
    })
}

async fn drive(
    args: &Args,
    timing: Timing,
    work: &Workload,
    cable: &mut Link,
    connect: impl FnMut() -> std::io::Result<(Link, Link)>,
) -> std::io::Result<Tally> {
    let plan = timing.faults(args.seed, args.share);
    bus_stress::run(args.transactions, work, plan, args.seed, cable, connect, |link| timing.master(link, work)).await
}

/// A process that ends with the stress test.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn pymodbus(args: &Args) -> Result<Tally, Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    LocalSet::new().block_on(&runtime, async {
        let path = std::env::temp_dir().join(format!("modbus-faults-{}", std::process::id()));
        let (device, _terminal) = Terminal::at(&path)?;
        let mut server = Server(
            Command::new(&args.python).arg("scripts/modbus_server.py").arg(&path).stdout(Stdio::piped()).spawn()?,
        );
        let output = server.0.stdout.take().ok_or("the server's output is not read")?;
        if !BufReader::new(output).lines().map_while(Result::ok).any(|line| line == "ready") {
            return Err("pymodbus's server did not start; its reason stands above".into());
        }
        let mut cable: Link = Box::new(device);
        Ok(drive(args, Timing::brisk(), &Counting::WORKLOAD, &mut cable, pty).await?)
    })
}
