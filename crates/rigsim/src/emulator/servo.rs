//! A Delta ASDA-B2 servo drive in speed mode. Registers: [`wire::asda_b2`], `docs/wire/asda-b2.md`.
//!
//! Emulated: the parameters the rig uses, software inputs, internal speed commands, ramps, monitor readouts, output functions,
//! the communication watchdog with its fault action, emergency stop and limits, alarm reset, and the wear of the EEPROM by
//! writes that are not kept to RAM.

use wire::asda_b2::{self as drive, InputFunction, Outputs};
use wire::modbus::{ExceptionCode, Request};

use super::interface::{Reply, ServoAxis, echo_write, read_words};
use super::parameters::Parameters;

/// Time the drive takes to answer, before P3-07 is added, ns.
const PROCESSING_NS: u64 = 1_000_000;
/// Speed below which a fault stop ends and the motor is released, rpm.
const STOPPED_RPM: f64 = 1.0;
/// Time constant of the average load, s.
const LOAD_AVERAGE_S: f64 = 1.0;
/// Alarms of P0-01 that end with their cause.
const ALARM_EMERGENCY_STOP: u16 = 0x0013;
const ALARM_REVERSE_LIMIT: u16 = 0x0014;
const ALARM_FORWARD_LIMIT: u16 = 0x0015;

/// What the input functions say now.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Functions {
    servo_on: bool,
    alarm_reset: bool,
    speed_select: u8,
    emergency_stop: bool,
    reverse_limit: bool,
    forward_limit: bool,
}

/// The emulated drive.
#[derive(Debug, Clone)]
pub struct ServoEmulator {
    unit: u8,
    /// Control mode since power-up; P1-01 takes effect at the next.
    mode: u16,
    parameters: Parameters,
    /// Level of the input terminals, a bit an input.
    terminals: u16,
    software_inputs: u16,
    functions: Functions,
    alarm: u16,
    enabled: bool,
    /// A fault brings the axis to a stop; the motor is released when it stands.
    stopping: bool,
    last_request_ns: Option<u64>,
    last_tick_ns: Option<u64>,
    average_load_percent: f64,
    eeprom_writes: u64,
    has_watchdog: bool,
}

impl ServoEmulator {
    /// A drive as commissioned for the rig: speed mode, 3000 rpm at most, default inputs; emergency stop and limit contacts
    /// closed.
    pub fn new(unit: u8) -> Self {
        let parameters = Parameters::commissioned(unit);
        let mut servo = Self {
            unit,
            mode: 0,
            parameters,
            terminals: 0,
            software_inputs: 0,
            functions: Functions::default(),
            alarm: 0,
            enabled: false,
            stopping: false,
            last_request_ns: None,
            last_tick_ns: None,
            average_load_percent: 0.0,
            eeprom_writes: 0,
            has_watchdog: true,
        };
        // Normally closed contacts are closed while all is well.
        for (n, def) in drive::INPUT_FUNCTIONS.iter().enumerate() {
            let value = servo.word(def.address);
            let safety = matches!(
                InputFunction::from_parameter(value),
                InputFunction::EmergencyStop | InputFunction::ReverseLimit | InputFunction::ForwardLimit
            );
            if safety && !drive::is_normally_open(value) {
                servo.terminals |= 1 << n;
            }
        }
        servo.power_up();
        servo
    }

    /// Unit number to which it answers.
    pub fn unit(&self) -> u8 {
        self.unit
    }

    /// Active alarm, 0 for none.
    pub fn alarm(&self) -> u16 {
        self.alarm
    }

    /// Whether the motor is energised.
    pub fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Parameters written to the EEPROM since the drive was made. Each cell survives about 10⁵.
    pub fn eeprom_writes(&self) -> u64 {
        self.eeprom_writes
    }

    /// Sets the level of input terminal DI`number` (1 to 9), as a switch on the rig would.
    pub fn set_terminal(&mut self, number: u8, on: bool, axis: &mut dyn ServoAxis) {
        if let Some(bit) = number.checked_sub(1).filter(|bit| *bit < 9) {
            let mask = 1 << bit;
            self.terminals = if on { self.terminals | mask } else { self.terminals & !mask };
            self.act(axis);
        }
    }

    /// Makes it a drive whose watchdog's register takes no value.
    pub fn forget_watchdog(&mut self) {
        self.has_watchdog = false;
    }

    /// Raises an alarm of the drive's own, say 0006 overload: the motor is released.
    pub fn raise_alarm(&mut self, alarm: u16, axis: &mut dyn ServoAxis) {
        self.alarm = alarm;
        self.act(axis);
    }

    /// Switches the drive off and on: what was not stored is lost, P1-01 and P3-00 take effect.
    pub fn power_cycle(&mut self, axis: &mut dyn ServoAxis) {
        self.parameters.forget();
        self.power_up();
        self.act(axis);
    }

    fn power_up(&mut self) {
        self.mode = self.word(drive::CONTROL_MODE.address);
        self.unit = u8::try_from(self.word(drive::UNIT.address)).unwrap_or(self.unit);
        self.software_inputs = 0;
        self.functions = self.functions_now();
        self.alarm = 0;
        self.enabled = false;
        self.stopping = false;
        self.last_request_ns = None;
    }

    /// Answers a request to its unit. Any such request feeds the watchdog.
    pub fn handle(&mut self, now_ns: u64, request: &Request, axis: &mut dyn ServoAxis) -> Reply {
        self.tick(now_ns, axis);
        self.last_request_ns = Some(now_ns);
        let response = match request {
            Request::ReadHolding { address, count } => {
                read_words(*address, *count, drive::MAX_WORDS, |at| self.shown(at, axis))
            }
            Request::WriteSingle { address, value } => echo_write(request, self.write(*address, &[*value], axis)),
            Request::WriteMultiple { address, values } => echo_write(request, self.write(*address, values, axis)),
        };
        let delay_ns = u64::from(self.word(drive::RESPONSE_DELAY.address)) * 1_000_000;
        Reply::after(PROCESSING_NS + delay_ns, response)
    }

    /// Lets time pass: the watchdog, and the end of a fault stop.
    pub fn tick(&mut self, now_ns: u64, axis: &mut dyn ServoAxis) {
        let dt_s = self.last_tick_ns.map_or(0.0, |last| now_ns.saturating_sub(last) as f64 * 1e-9);
        self.last_tick_ns = Some(now_ns);
        let weight = 1.0 - (-dt_s / LOAD_AVERAGE_S).exp();
        self.average_load_percent += (axis.torque_percent().abs() - self.average_load_percent) * weight;

        let watchdog_ns = u64::from(self.word(drive::WATCHDOG.address)) * 1_000_000_000;
        let elapsed = self.last_request_ns.is_some_and(|last| now_ns.saturating_sub(last) > watchdog_ns);
        if watchdog_ns != 0 && elapsed && self.alarm == 0 {
            self.alarm = drive::ALARM_COMMUNICATION_TIMEOUT;
            self.act(axis);
        } else if self.stopping && axis.reference_speed_after_ramp_rpm().abs() < STOPPED_RPM {
            self.release(axis);
        }
    }

    fn word(&self, address: u16) -> u16 {
        self.parameters.raw(address) as u16
    }

    /// Word at an address as a master reads it now; `None` where there is no parameter.
    fn shown(&self, at: u16, axis: &dyn ServoAxis) -> Option<u16> {
        let stored = self.parameters.find(at)?;
        let low = at & !1;
        let monitored = |code: &wire::register_map::RegisterDef| self.monitored(self.word(code.address), axis);
        let raw = if low == drive::ALARM.address {
            i64::from(self.alarm)
        } else if low == drive::MONITOR_1.address {
            monitored(&drive::MONITOR_1_CODE)
        } else if low == drive::MONITOR_2.address {
            monitored(&drive::MONITOR_2_CODE)
        } else if low == drive::MONITOR_3.address {
            monitored(&drive::MONITOR_3_CODE)
        } else if low == drive::STATUS_MONITOR.address {
            monitored(&drive::STATUS_MONITOR_CODE)
        } else if low == drive::OUTPUTS.address {
            i64::from(self.outputs(axis))
        } else if low == drive::INPUTS.address {
            i64::from(self.inputs())
        } else {
            stored
        };
        Some(if at == low { raw as u16 } else { (raw >> 16) as u16 })
    }

    /// Value of a monitored variable; those that the emulated axis does not have read 0.
    fn monitored(&self, code: u16, axis: &dyn ServoAxis) -> i64 {
        use drive::monitor;
        let value = match code {
            monitor::SPEED => axis.speed_rpm() / monitor::SPEED_STEP_RPM,
            monitor::SPEED_COMMAND => axis.reference_speed_after_ramp_rpm(),
            monitor::TORQUE => axis.torque_percent() / monitor::TORQUE_STEP_PERCENT,
            monitor::AVERAGE_LOAD => self.average_load_percent,
            _ => 0.0,
        };
        // Saturates, and a plant that has lost its numbers shows 0.
        i64::from(value.round() as i32)
    }

    /// Output functions, the bits of P0-46.
    fn outputs(&self, axis: &dyn ServoAxis) -> u16 {
        let speed_rpm = axis.speed_rpm().abs();
        let zero_rpm = f64::from(self.word(drive::ZERO_SPEED.address)) * drive::ZERO_SPEED.scale;
        let target_rpm = f64::from(self.word(drive::TARGET_SPEED.address));
        let bits = [
            (Outputs::READY, self.alarm == 0),
            (Outputs::SERVO_ON, self.enabled),
            (Outputs::ZERO_SPEED, speed_rpm < zero_rpm),
            (Outputs::TARGET_SPEED, speed_rpm > target_rpm),
            (Outputs::ALARM, self.alarm != 0),
        ];
        bits.into_iter().filter(|(_, on)| *on).map(|(bit, _)| bit).sum()
    }

    /// Inputs after combination: P3-06 says which come from software (manual of May 2018, p. 7-88).
    fn inputs(&self) -> u16 {
        let from_software = self.word(drive::INPUT_SOURCE.address);
        (self.software_inputs & from_software) | (self.terminals & !from_software)
    }

    fn functions_now(&self) -> Functions {
        let inputs = self.inputs();
        let mut functions = Functions::default();
        for (n, def) in drive::INPUT_FUNCTIONS.iter().enumerate() {
            let value = self.word(def.address);
            let on = inputs & (1 << n) != 0;
            if on != drive::is_normally_open(value) {
                continue;
            }
            match InputFunction::from_parameter(value) {
                InputFunction::ServoOn => functions.servo_on = true,
                InputFunction::AlarmReset => functions.alarm_reset = true,
                InputFunction::Speed0 => functions.speed_select |= 1,
                InputFunction::Speed1 => functions.speed_select |= 2,
                InputFunction::EmergencyStop => functions.emergency_stop = true,
                InputFunction::ReverseLimit => functions.reverse_limit = true,
                InputFunction::ForwardLimit => functions.forward_limit = true,
                InputFunction::Disabled | InputFunction::Other(_) => {}
            }
        }
        functions
    }

    /// Writes consecutive words, all or none.
    fn write(&mut self, start: u16, values: &[u16], axis: &mut dyn ServoAxis) -> Result<(), ExceptionCode> {
        if values.is_empty() || values.len() > usize::from(drive::MAX_WORDS) {
            return Err(ExceptionCode::IllegalDataValue);
        }
        let changes = self.parameters.changes(start, values)?;
        let ram_only = self.word(drive::AUXILIARY.address) == drive::AUX_RAM_ONLY;
        for (address, raw) in changes {
            if address == drive::WATCHDOG.address && !self.has_watchdog {
                continue;
            } else if address == drive::ALARM.address {
                self.reset_alarm();
            } else if address == drive::INPUTS.address {
                self.software_inputs = raw as u16;
            } else if self.parameters.set(address, raw, ram_only) {
                self.eeprom_writes += 1;
            }
        }
        self.act(axis);
        Ok(())
    }

    fn reset_alarm(&mut self) {
        self.alarm = 0;
        self.stopping = false;
        // The watchdog starts anew with the next request, or it would trip again at once.
        self.last_request_ns = self.last_request_ns.and(self.last_tick_ns);
    }

    /// Brings the axis into line with inputs, parameters and alarms.
    fn act(&mut self, axis: &mut dyn ServoAxis) {
        let functions = self.functions_now();
        if functions.alarm_reset && !self.functions.alarm_reset {
            self.reset_alarm();
        }
        self.functions = functions;
        self.follow_contacts();

        axis.set_ramp_ms(f64::from(self.word(drive::RAMP_UP.address)), f64::from(self.word(drive::RAMP_DOWN.address)));
        match self.alarm {
            drive::ALARM_COMMUNICATION_TIMEOUT if self.word(drive::FAULT_ACTION.address) == drive::FAULT_CONTINUE => {}
            drive::ALARM_COMMUNICATION_TIMEOUT if self.enabled => {
                self.stopping = true;
                axis.set_speed_reference_rpm(0.0);
                return;
            }
            0 | ALARM_REVERSE_LIMIT | ALARM_FORWARD_LIMIT => {}
            _ => return self.release(axis),
        }
        if !functions.servo_on {
            return self.release(axis);
        }
        axis.set_speed_reference_rpm(self.reference_rpm(functions));
        if !self.enabled {
            self.enabled = true;
            axis.set_enabled(true);
        }
    }

    /// Emergency stop and limits are alarms that come and go with their contacts.
    fn follow_contacts(&mut self) {
        let contact = match self.functions {
            Functions { emergency_stop: true, .. } => ALARM_EMERGENCY_STOP,
            Functions { reverse_limit: true, .. } => ALARM_REVERSE_LIMIT,
            Functions { forward_limit: true, .. } => ALARM_FORWARD_LIMIT,
            _ => 0,
        };
        let of_contact = matches!(self.alarm, 0 | ALARM_EMERGENCY_STOP | ALARM_REVERSE_LIMIT | ALARM_FORWARD_LIMIT);
        if of_contact || contact == ALARM_EMERGENCY_STOP {
            self.alarm = contact;
        }
    }

    /// The speed that inputs and parameters ask for, motor rpm.
    fn reference_rpm(&self, functions: Functions) -> f64 {
        let selected = match functions.speed_select {
            1 => &drive::SPEED_1,
            2 => &drive::SPEED_2,
            3 => &drive::SPEED_3,
            // Both off is the analogue input, which is not connected.
            _ => return 0.0,
        };
        if self.mode & 0xFF != drive::MODE_SPEED {
            return 0.0;
        }
        let max_rpm = f64::from(self.word(drive::MAX_SPEED.address));
        let rpm = (self.parameters.raw(selected.address) as f64 * selected.scale).clamp(-max_rpm, max_rpm);
        let lowest = if functions.reverse_limit { 0.0 } else { -max_rpm };
        let highest = if functions.forward_limit { 0.0 } else { max_rpm };
        rpm.clamp(lowest, highest)
    }

    fn release(&mut self, axis: &mut dyn ServoAxis) {
        self.stopping = false;
        self.enabled = false;
        axis.set_speed_reference_rpm(0.0);
        axis.set_enabled(false);
    }
}

#[cfg(test)]
mod tests;
