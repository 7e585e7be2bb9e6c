//! The emulated drive, as a master sees it.

use wire::asda_b2::{
    ALARM, AUXILIARY, CONTROL_MODE, FAULT_ACTION, INPUT_FUNCTIONS, INPUT_SOURCE, INPUTS, InputFunction, MONITOR_1,
    MONITOR_1_CODE, Outputs, RAMP_UP, RESPONSE_DELAY, SPEED_1, SPEED_2, STATUS_MONITOR, STATUS_MONITOR_CODE, UNIT,
    WATCHDOG, monitor,
};
use wire::modbus::{ExceptionCode, Request, Response};

use super::*;

const SECOND_NS: u64 = 1_000_000_000;

#[derive(Default)]
struct Axis {
    enabled: bool,
    reference_rpm: f64,
    ramp_ms: (f64, f64),
    speed_rpm: f64,
    torque_percent: f64,
    ramped_rpm: f64,
}

impl ServoAxis for Axis {
    fn set_enabled(&mut self, enabled: bool) {
        self.enabled = enabled;
    }
    fn set_speed_reference_rpm(&mut self, rpm: f64) {
        self.reference_rpm = rpm;
    }
    fn set_ramp_ms(&mut self, accel_ms: f64, decel_ms: f64) {
        self.ramp_ms = (accel_ms, decel_ms);
    }
    fn speed_rpm(&self) -> f64 {
        self.speed_rpm
    }
    fn torque_percent(&self) -> f64 {
        self.torque_percent
    }
    fn reference_speed_after_ramp_rpm(&self) -> f64 {
        self.ramped_rpm
    }
}

struct Bench {
    servo: ServoEmulator,
    axis: Axis,
    now_ns: u64,
}

impl Bench {
    /// A drive whose inputs DI1 to DI4 are servo on, SPD0, SPD1 and alarm reset by software.
    fn new() -> Self {
        let mut bench = Self { servo: ServoEmulator::new(1), axis: Axis::default(), now_ns: 0 };
        bench.set(AUXILIARY.address, &[5]);
        let functions =
            [InputFunction::ServoOn, InputFunction::Speed0, InputFunction::Speed1, InputFunction::AlarmReset];
        for (def, function) in INPUT_FUNCTIONS.iter().zip(functions) {
            bench.set(def.address, &[function.parameter(true)]);
        }
        // The factory's alarm reset on DI5 would be a second one.
        bench.set(INPUT_FUNCTIONS[4].address, &[0x100]);
        bench.set(INPUT_SOURCE.address, &[0x0F]);
        bench
    }

    fn ask(&mut self, request: &Request) -> Response {
        self.servo.handle(self.now_ns, request, &mut self.axis).response.unwrap()
    }

    fn write(&mut self, address: u16, values: &[u16]) -> Response {
        let request = match values {
            [value] => Request::WriteSingle { address, value: *value },
            _ => Request::WriteMultiple { address, values: values.to_vec() },
        };
        self.ask(&request)
    }

    #[track_caller]
    fn set(&mut self, address: u16, values: &[u16]) {
        let response = self.write(address, values);
        assert!(!matches!(response, Response::Exception(_)), "{address:04X}: {response:?}");
    }

    #[track_caller]
    fn get(&mut self, address: u16, count: u16) -> Vec<u16> {
        match self.ask(&Request::ReadHolding { address, count }) {
            Response::Registers(values) => values,
            other => panic!("{address:04X}: {other:?}"),
        }
    }

    fn wait(&mut self, duration_ns: u64) {
        self.now_ns += duration_ns;
        self.servo.tick(self.now_ns, &mut self.axis);
    }
}

#[test]
fn runs_at_the_selected_speed() {
    let mut bench = Bench::new();
    bench.set(SPEED_1.address, &SPEED_1.encode(100.0).unwrap());
    bench.set(SPEED_2.address, &SPEED_2.encode(-250.0).unwrap());
    bench.set(RAMP_UP.address, &[3000]);
    assert!(!bench.axis.enabled);
    bench.set(INPUTS.address, &[0b0011]);
    assert!(bench.axis.enabled);
    assert_eq!((bench.axis.reference_rpm, bench.axis.ramp_ms), (100.0, (3000.0, 200.0)));
    bench.set(INPUTS.address, &[0b0101]);
    assert_eq!(bench.axis.reference_rpm, -250.0);
    bench.set(SPEED_2.address, &SPEED_2.encode(4000.0).unwrap());
    assert_eq!(bench.axis.reference_rpm, 3000.0, "P1-55 limits it");
    bench.set(INPUTS.address, &[0b0001]);
    assert_eq!(bench.axis.reference_rpm, 0.0);
    bench.set(INPUTS.address, &[0]);
    assert!(!bench.axis.enabled);
}

#[test]
fn status_in_one_read() {
    let mut bench = Bench::new();
    bench.set(STATUS_MONITOR_CODE.address, &[monitor::SPEED]);
    bench.set(MONITOR_1_CODE.address, &[monitor::TORQUE]);
    bench.set(INPUTS.address, &[1]);
    (bench.axis.speed_rpm, bench.axis.torque_percent) = (-99.96, 31.4);
    let words = bench.get(STATUS_MONITOR.address, 6);
    // -1000 steps of 0.1 rpm, low word first; the code; ready and servo on.
    assert_eq!(words, [0xFC18, 0xFFFF, 7, 0, Outputs::READY | Outputs::SERVO_ON, 0]);
    assert_eq!(bench.get(MONITOR_1.address, 2), [31, 0]);
    assert_eq!(bench.get(STATUS_MONITOR.address + 1, 1), [0xFFFF], "a read may begin at a high word");
}

#[test]
fn refuses_as_modbus_says() {
    let mut bench = Bench::new();
    let address_error = Response::Exception(ExceptionCode::IllegalDataAddress);
    let value_error = Response::Exception(ExceptionCode::IllegalDataValue);
    assert_eq!(bench.ask(&Request::ReadHolding { address: 0x0700, count: 1 }), address_error);
    assert_eq!(bench.ask(&Request::ReadHolding { address: 0x0058, count: 11 }), value_error, "10 words at most");
    assert_eq!(bench.write(0x0700, &[1]), address_error);
    assert_eq!(bench.write(STATUS_MONITOR.address, &[1, 0]), address_error, "read only");
    assert_eq!(bench.write(WATCHDOG.address, &[21]), value_error);
    assert_eq!(bench.write(SPEED_1.address, &[0, 1]), value_error, "6553.6 rpm");
    assert_eq!(bench.write(FAULT_ACTION.address, &[1, 0, 21, 0]), value_error);
    assert_eq!(bench.get(FAULT_ACTION.address, 1), [0], "all or none");
}

#[test]
fn the_watchdog_stops_the_motor_and_says_so() {
    let mut bench = Bench::new();
    bench.set(WATCHDOG.address, &[1]);
    bench.set(FAULT_ACTION.address, &[1]);
    bench.set(SPEED_1.address, &[1000, 0]);
    bench.set(INPUTS.address, &[0b0011]);
    bench.axis.ramped_rpm = 100.0;
    for _ in 0..10 {
        bench.wait(SECOND_NS / 2);
        bench.get(ALARM.address, 1);
    }
    assert_eq!(bench.servo.alarm(), 0, "fed twice a second");
    bench.wait(SECOND_NS + 1);
    assert_eq!(bench.servo.alarm(), 0x20);
    assert!(bench.axis.enabled && bench.axis.reference_rpm == 0.0, "it ramps down under control");
    bench.wait(SECOND_NS / 10);
    assert!(bench.axis.enabled);
    bench.axis.ramped_rpm = 0.0;
    bench.wait(SECOND_NS / 10);
    assert!(!bench.axis.enabled, "and is released at rest");
    assert_eq!(bench.get(ALARM.address, 1), [0x20]);
    bench.set(INPUTS.address, &[0]);
    bench.set(ALARM.address, &[0]);
    assert_eq!(bench.get(ALARM.address, 1), [0]);
    assert!(!bench.axis.enabled);
}

#[test]
fn the_watchdog_may_only_report() {
    let mut bench = Bench::new();
    bench.set(WATCHDOG.address, &[1]);
    bench.set(SPEED_1.address, &[1000, 0]);
    bench.set(INPUTS.address, &[0b0011]);
    bench.wait(2 * SECOND_NS);
    assert_eq!(bench.servo.alarm(), 0x20);
    assert!(bench.axis.enabled && bench.axis.reference_rpm == 100.0, "P3-03 = 0 runs on");
}

#[test]
fn the_default_watchdog_is_off() {
    let mut bench = Bench::new();
    bench.wait(100 * SECOND_NS);
    assert_eq!(bench.servo.alarm(), 0);
}

#[test]
fn alarm_reset_works_on_its_rising_edge() {
    let mut bench = Bench::new();
    bench.set(INPUTS.address, &[0b1000]);
    bench.servo.raise_alarm(0x06, &mut bench.axis);
    bench.set(INPUTS.address, &[0b1000]);
    assert_eq!(bench.servo.alarm(), 0x06, "a level resets nothing");
    bench.set(INPUTS.address, &[0]);
    bench.set(INPUTS.address, &[0b1000]);
    assert_eq!(bench.servo.alarm(), 0);
}

#[test]
fn emergency_stop_and_limits_follow_their_contacts() {
    let mut bench = Bench::new();
    bench.set(SPEED_1.address, &[1000, 0]);
    bench.set(INPUTS.address, &[0b0011]);
    bench.servo.set_terminal(7, false, &mut bench.axis);
    assert_eq!((bench.servo.alarm(), bench.axis.reference_rpm), (0x15, 0.0), "not further forward");
    bench.servo.set_terminal(7, true, &mut bench.axis);
    assert_eq!((bench.servo.alarm(), bench.axis.reference_rpm), (0, 100.0));
    bench.servo.set_terminal(8, false, &mut bench.axis);
    assert_eq!((bench.servo.alarm(), bench.axis.enabled), (0x13, false));
    bench.set(ALARM.address, &[0]);
    assert_eq!(bench.servo.alarm(), 0x13, "the contact is still open");
}

#[test]
fn writes_wear_the_eeprom_unless_kept_to_ram() {
    let mut bench = Bench::new();
    assert_eq!(bench.servo.eeprom_writes(), 0, "P2-30 = 5 came first");
    bench.set(RAMP_UP.address, &[500]);
    bench.set(AUXILIARY.address, &[0]);
    bench.set(INPUTS.address, &[0]);
    assert_eq!(bench.servo.eeprom_writes(), 0, "neither is ever stored");
    bench.set(SPEED_1.address, &[10, 0]);
    assert_eq!(bench.servo.eeprom_writes(), 1);
    bench.servo.power_cycle(&mut bench.axis);
    assert_eq!(bench.get(RAMP_UP.address, 1), [200]);
    assert_eq!(bench.get(SPEED_1.address, 1), [10]);
}

#[test]
fn mode_and_unit_take_effect_at_power_up() {
    let mut bench = Bench::new();
    bench.set(AUXILIARY.address, &[0]);
    bench.set(CONTROL_MODE.address, &[0]);
    bench.set(UNIT.address, &[9]);
    assert_eq!(bench.servo.unit(), 1);
    bench.servo.power_cycle(&mut bench.axis);
    assert_eq!(bench.servo.unit(), 9);
    assert_eq!(bench.get(CONTROL_MODE.address, 1), [0]);
}

#[test]
fn the_answer_waits_for_the_response_delay() {
    let mut bench = Bench::new();
    bench.set(RESPONSE_DELAY.address, &[20]);
    let reply = bench.servo.handle(0, &Request::ReadHolding { address: 0, count: 1 }, &mut bench.axis);
    assert_eq!(reply.processing_ns, PROCESSING_NS + 20_000_000);
}
