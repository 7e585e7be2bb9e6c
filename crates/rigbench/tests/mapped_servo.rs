//! The servo driver of a register map, against drives that refuse, keep nothing, or answer late.

#![allow(clippy::unwrap_used)] // helpers of tests may

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use rigbench::bus_stress::{Device, Servo as EmulatedDrive, Workload, serve};
use rigd::device::drivers::mapped_servo::open;
use rigd::device::{DeviceError, DeviceKind, Servo};
use rigd::link::Address;
use rigd::profile::{Profile, ServoProfile};
use rigsim::emulator::Reply;
use wire::asda_b2::{ALARM_COMMUNICATION_TIMEOUT, ALARM_EMERGENCY_STOP, MONITOR_1};
use wire::modbus::{ExceptionCode, Request, Response};

/// A drive that keeps what is written, but for one register.
#[derive(Clone, Default)]
struct Keeping {
    registers: Rc<RefCell<BTreeMap<u16, u16>>>,
    refused: Option<u16>,
    stuck: Option<u16>,
}

impl Keeping {
    fn write(&self, first: u16, values: &[u16]) -> Option<Response> {
        for (address, value) in (first..).zip(values) {
            if self.refused == Some(address) {
                return Some(Response::Exception(ExceptionCode::IllegalDataAddress));
            }
            if self.stuck != Some(address) {
                self.registers.borrow_mut().insert(address, *value);
            }
        }
        None
    }
}

impl Device for Keeping {
    fn handle(&mut self, _: u64, request: &Request) -> Reply {
        let response = match request {
            Request::ReadHolding { address, count } => {
                let registers = self.registers.borrow();
                let value = |at| registers.get(&at).copied().unwrap_or_default();
                Response::Registers((*address..address.saturating_add(*count)).map(value).collect())
            }
            Request::WriteSingle { address, value } => {
                self.write(*address, &[*value]).unwrap_or(Response::WroteSingle { address: *address, value: *value })
            }
            Request::WriteMultiple { address, values } => self
                .write(*address, values)
                .unwrap_or(Response::WroteMultiple { address: *address, count: request.count() }),
        };
        Reply { response: Some(response), processing_ns: 500_000 }
    }

    fn workload(&self) -> Workload {
        EmulatedDrive::default().workload()
    }
}

/// Works with a driver of the map on such a drive.
async fn with<T>(map: &str, drive: Keeping, work: impl AsyncFnOnce(&mut dyn Servo) -> T) -> T {
    let profile = ServoProfile { driver: map.into(), unit: 1, ..Profile::simulated().servo };
    with_profile(&profile, drive, work).await
}

async fn with_profile<T>(profile: &ServoProfile, drive: Keeping, work: impl AsyncFnOnce(&mut dyn Servo) -> T) -> T {
    let (near, far) = tokio::io::duplex(1024);
    let address = Address { device: DeviceKind::Servo, port: "x".into(), baud: 38_400, format: "8N2".into() };
    let mut servo = open(Box::new(near), address, profile);
    let served = serve(far, drive);
    tokio::select! {
        () = served => panic!("the line is open"),
        done = work(&mut *servo) => done,
    }
}

async fn prepared(map: &str, drive: Keeping) -> Result<(), DeviceError> {
    with(map, drive, async |servo| servo.prepare(300.0, 600.0, Duration::from_secs(1)).await).await
}

#[tokio::test(start_paused = true)]
async fn a_map_without_a_watchdog_is_told_once_all_else_is_prepared() {
    let drive = Keeping::default();
    let outcome = prepared("dsy-rs", drive.clone()).await;
    assert!(
        matches!(&outcome, Err(DeviceError::NoWatchdog { register, .. }) if register.contains("DSY-RS")),
        "{outcome:?}"
    );
    // The map's last step before the watchdog, and a ramp.
    assert_eq!([0x0B0A, 0x0506].map(|at| drive.registers.borrow().get(&at).copied()), [Some(1), Some(200)]);
}

#[tokio::test(start_paused = true)]
async fn a_watchdog_that_refuses_or_does_not_keep_its_time_is_none() {
    let watchdog = wire::asda_b2::WATCHDOG.address;
    let refusing = Keeping { refused: Some(watchdog), ..Keeping::default() };
    let stuck = Keeping { stuck: Some(watchdog), ..Keeping::default() };
    for drive in [refusing, stuck] {
        let outcome = prepared("asda-b2", drive).await;
        assert!(
            matches!(&outcome, Err(DeviceError::NoWatchdog { register, .. }) if register == "watchdog P3-04"),
            "{outcome:?}"
        );
    }
    assert!(prepared("asda-b2", Keeping::default()).await.is_ok());
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_refuses_its_watchdog_is_switched_off_all_the_same() {
    let drive = Keeping { refused: Some(wire::asda_b2::WATCHDOG.address), ..Keeping::default() };
    let off = with("asda-b2", drive, async |servo| servo.set_enabled(false).await).await;
    assert!(off.is_ok(), "{off:?}");
}

#[tokio::test(start_paused = true)]
async fn a_line_is_heard_for_as_long_as_the_profile_says_that_answers_are_late() {
    let mut took = Vec::new();
    for late_ms in [400.0, 900.0] {
        let profile = ServoProfile { late_ms, ..Profile::simulated().servo };
        let begun = tokio::time::Instant::now();
        with_profile(&profile, Keeping::default(), async |servo| servo.max_motor_rpm().await.map(drop))
            .await
            .expect("it answers");
        took.push(begun.elapsed().as_millis());
    }
    // A line just opened is heard for a whole horizon before the first request.
    assert!((480..=520).contains(&(took[1] - took[0])), "{took:?} ms");
}

#[tokio::test(start_paused = true)]
async fn torque_comes_with_its_sign_and_step() {
    let drive = Keeping::default();
    // −37 in two words, the low one first.
    drive.registers.borrow_mut().extend([(MONITOR_1.address, 0xFFDB), (MONITOR_1.address + 1, 0xFFFF)]);
    let torque = with("asda-b2", drive, async |servo| servo.motor_torque_percent().await).await;
    assert_eq!(torque.expect("answers"), Some((-37.0, 1.0)));
}

#[test]
fn only_the_emergency_stops_code_is_one() {
    let (link, _far) = tokio::io::duplex(16);
    let address = Address { device: DeviceKind::Servo, port: "x".into(), baud: 38_400, format: "8N2".into() };
    let servo = open(Box::new(link), address, &Profile::simulated().servo);
    assert!(servo.is_emergency_stop(ALARM_EMERGENCY_STOP) && !servo.is_emergency_stop(ALARM_COMMUNICATION_TIMEOUT));
}
