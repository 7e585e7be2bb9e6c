//! Devices of a stress test: the emulators, with a plant that shows another number at each request, so that no stale value passes for a
//! fresh one.

use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::time::{Instant, sleep_until, timeout};
use wire::modbus::{Request, Response};
use wire::rd60xx::Model;

use super::workload::Workload;
use rigd::device::bus::Span;
use rigd::link::Duplex;
use rigsim::emulator::{BrakeCoil, BrakeEmulator, ModbusLine, Reply, ServoAxis, ServoEmulator};

/// Who answers.
pub trait Device {
    /// Answers a request.
    fn handle(&mut self, now_ns: u64, request: &Request) -> Reply;
    /// What a stress test asks of it.
    fn workload(&self) -> Workload;
}

/// The emulated drive on an axis whose speed is the number of the request, in steps.
pub struct Servo {
    drive: ServoEmulator,
    axis: Axis,
}

impl Default for Servo {
    fn default() -> Self {
        let mut servo = Self { drive: ServoEmulator::new(1), axis: Axis::default() };
        // What P0-44 shows: the speed.
        let shown = Request::WriteSingle {
            address: wire::asda_b2::STATUS_MONITOR_CODE.address,
            value: wire::asda_b2::monitor::SPEED,
        };
        servo.drive.handle(0, &shown, &mut servo.axis);
        servo
    }
}

impl Device for Servo {
    fn handle(&mut self, now_ns: u64, request: &Request) -> Reply {
        self.axis.requests += 1;
        self.drive.handle(now_ns, request, &mut self.axis)
    }

    fn workload(&self) -> Workload {
        Workload {
            unit: 1,
            reads: &[(0x0058, 2), (0x0058, 6), (0x0058, 2), (0x005C, 1), (0x0112, 2), (0x0144, 1), (0x016E, 1), (2, 1)],
            writes: &[(0x0112, 2, 30_000), (0x0144, 1, 20_000), (0x0146, 1, 20_000)],
            spans: &[
                Span { first: 0x0000, words: 4 },
                Span { first: 0x0058, words: 6 },
                Span { first: 0x0112, words: 6 },
                Span { first: 0x0144, words: 6 },
                Span { first: 0x016E, words: 2 },
            ],
        }
    }
}

#[derive(Default)]
struct Axis {
    requests: u64,
}

impl ServoAxis for Axis {
    fn set_enabled(&mut self, _: bool) {}
    fn set_speed_reference_rpm(&mut self, _: f64) {}
    fn set_ramp_ms(&mut self, _: f64, _: f64) {}
    fn speed_rpm(&self) -> f64 {
        // 0.1 rpm a step of the monitor.
        self.requests as f64 * wire::asda_b2::monitor::SPEED_STEP_RPM
    }
    fn torque_percent(&self) -> f64 {
        0.0
    }
    fn reference_speed_after_ramp_rpm(&self) -> f64 {
        0.0
    }
}

/// The emulated current source on a coil whose current is the number of the request, in steps.
pub struct Brake {
    source: BrakeEmulator,
    coil: Coil,
}

impl Default for Brake {
    fn default() -> Self {
        Self { source: BrakeEmulator::new(1, Model::Rd6006), coil: Coil::default() }
    }
}

impl Device for Brake {
    fn handle(&mut self, now_ns: u64, request: &Request) -> Reply {
        self.coil.requests += 1;
        self.source.handle(now_ns, request, &mut self.coil)
    }

    fn workload(&self) -> Workload {
        Workload {
            unit: 1,
            reads: &[(4, 32), (10, 2), (10, 2), (11, 1), (8, 1), (9, 1), (0, 4)],
            writes: &[(8, 1, 6000), (9, 1, 6000)],
            spans: &[Span { first: 0, words: 120 }],
        }
    }
}

#[derive(Default)]
struct Coil {
    requests: u64,
}

impl BrakeCoil for Coil {
    fn set_drive(&mut self, _: bool, _: f64, _: f64) {}
    fn current_a(&self) -> f64 {
        (self.requests % 6000) as f64 * 1e-3
    }
    fn voltage_v(&self) -> f64 {
        (self.requests / 6000 % 6000) as f64 * 1e-2
    }
    fn temperature_c(&self) -> f64 {
        25.0
    }
}

/// A table of 200 registers, the first hundred of which count requests; `scripts/modbus_server.py` is the same by another hand.
pub struct Counting {
    registers: [u16; 200],
    requests: u64,
}

impl Default for Counting {
    fn default() -> Self {
        Self { registers: [0; 200], requests: 0 }
    }
}

impl Device for Counting {
    fn handle(&mut self, _: u64, request: &Request) -> Reply {
        self.requests += 1;
        let response = match request {
            Request::ReadHolding { address, count } => Response::Registers(
                (*address..address.saturating_add(*count))
                    .map(|at| match at {
                        0..100 => (self.requests as u16).wrapping_add(at.wrapping_mul(257)),
                        _ => self.registers.get(usize::from(at)).copied().unwrap_or_default(),
                    })
                    .collect(),
            ),
            Request::WriteSingle { address, value } => {
                self.put(*address, &[*value]);
                Response::WroteSingle { address: *address, value: *value }
            }
            Request::WriteMultiple { address, values } => {
                self.put(*address, values);
                Response::WroteMultiple { address: *address, count: request.count() }
            }
        };
        Reply { response: Some(response), processing_ns: 500_000 }
    }

    fn workload(&self) -> Workload {
        Self::WORKLOAD
    }
}

impl Counting {
    /// What a stress test asks of it, or of its twin.
    pub const WORKLOAD: Workload = Workload {
        unit: 1,
        reads: &[(0, 2), (0, 2), (10, 4), (50, 1), (98, 4), (100, 2), (150, 8)],
        writes: &[(100, 2, 60_000), (150, 1, 60_000), (151, 1, 60_000)],
        spans: &[Span { first: 0, words: 200 }],
    };

    fn put(&mut self, first: u16, values: &[u16]) {
        for (register, value) in self.registers.iter_mut().skip(usize::from(first)).zip(values) {
            *register = *value;
        }
    }
}

/// Serves a device until its line is closed.
pub async fn serve(mut line: impl Duplex, mut device: impl Device) {
    let unit = device.workload().unit;
    let start = Instant::now();
    let mut protocol = ModbusLine::new();
    let mut buffer = [0; 512];
    let mut partial = false;
    loop {
        let read = if partial {
            timeout(Duration::from_millis(2), line.read(&mut buffer)).await
        } else {
            Ok(line.read(&mut buffer).await)
        };
        let now_ns = start.elapsed().as_nanos() as u64;
        let mut handle = |request: &Request| device.handle(now_ns, request);
        let answers = match read {
            Ok(Ok(0) | Err(_)) => return,
            Ok(Ok(count)) => {
                partial = true;
                protocol.receive(&buffer[..count], unit, &mut handle)
            }
            Err(_) => {
                partial = false;
                protocol.idle(unit, &mut handle)
            }
        };
        let asked = Instant::now();
        for answer in answers {
            partial = false;
            sleep_until(asked + Duration::from_nanos(answer.after_ns)).await;
            if line.write_all(&answer.bytes).await.is_err() {
                return;
            }
        }
    }
}
