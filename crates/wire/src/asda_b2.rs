//! Delta ASDA-B2 servo drive: the parameters the rig uses, their bits and codes.
//!
//! Parameter Pg-nn sits at `g·0100h + nn·2` and takes two registers, low word first; 16-bit parameters leave the
//! second at zero. Sources: *ASDA-B2 Series User Manual*, revisions June 2010, September 2013 and May 2018; page
//! numbers are given where a page was read, the table is `docs/wire/asda-b2.md`.

use crate::register_map::{Access, RegisterDef, RegisterKind};

/// Address of parameter P`group`-`index`.
pub const fn address(group: u8, index: u8) -> u16 {
    group as u16 * 0x100 + index as u16 * 2
}

/// Parameter number (group, index) of an address, and whether it is the high word.
pub const fn parameter(address: u16) -> (u8, u8, bool) {
    ((address >> 8) as u8, ((address & 0xFF) / 2) as u8, address & 1 == 1)
}

/// Registers one request may read or write (2010, p. 8-10; 2013, p. 8-11).
pub const MAX_WORDS: u16 = 10;
/// Silence the drive wants before and after an RTU frame, ms (2018, p. 8-13).
pub const FRAME_SILENCE_MS: u64 = 10;
/// Motor speed that the ramp times P1-34 and P1-35 count to, rpm.
pub const RAMP_SPEED_RPM: f64 = 3000.0;

const fn hex16(name: &'static str, group: u8, index: u8, access: Access) -> RegisterDef {
    RegisterDef::new(name, address(group, index), RegisterKind::U16, 1.0, "", access)
}

const fn i32_def(
    name: &'static str,
    group: u8,
    index: u8,
    scale: f64,
    unit: &'static str,
    access: Access,
) -> RegisterDef {
    RegisterDef::new(name, address(group, index), RegisterKind::I32LowFirst, scale, unit, access)
}

const fn u16_def(name: &'static str, group: u8, index: u8, scale: f64, unit: &'static str) -> RegisterDef {
    RegisterDef::new(name, address(group, index), RegisterKind::U16, scale, unit, Access::ReadWrite)
}

/// P0-00 VER: firmware version, as the panel shows it without its point.
pub const FIRMWARE: RegisterDef = hex16("P0-00 VER", 0, 0, Access::Read);
/// P0-01 ALE: active alarm, 0 for none; writing 0 resets it.
pub const ALARM: RegisterDef = hex16("P0-01 ALE", 0, 1, Access::ReadWrite).limited(0, 0);
/// P0-09 CM1: the monitored variable that P0-17 selects.
pub const MONITOR_1: RegisterDef = i32_def("P0-09 CM1", 0, 9, 1.0, "", Access::Read);
/// P0-10 CM2: the monitored variable that P0-18 selects.
pub const MONITOR_2: RegisterDef = i32_def("P0-10 CM2", 0, 10, 1.0, "", Access::Read);
/// P0-11 CM3: the monitored variable that P0-19 selects.
pub const MONITOR_3: RegisterDef = i32_def("P0-11 CM3", 0, 11, 1.0, "", Access::Read);
/// P0-17 CM1A: what P0-09 shows, a [`monitor`] code.
pub const MONITOR_1_CODE: RegisterDef = u16_def("P0-17 CM1A", 0, 17, 1.0, "").limited(0, 127);
/// P0-18 CM2A: what P0-10 shows, a [`monitor`] code.
pub const MONITOR_2_CODE: RegisterDef = u16_def("P0-18 CM2A", 0, 18, 1.0, "").limited(0, 127);
/// P0-19 CM3A: what P0-11 shows, a [`monitor`] code.
pub const MONITOR_3_CODE: RegisterDef = u16_def("P0-19 CM3A", 0, 19, 1.0, "").limited(0, 127);
/// P0-44 PCMN: the monitored variable that P0-45 selects, for software.
pub const STATUS_MONITOR: RegisterDef = i32_def("P0-44 PCMN", 0, 44, 1.0, "", Access::Read);
/// P0-45 PCMNA: what P0-44 shows, a [`monitor`] code.
pub const STATUS_MONITOR_CODE: RegisterDef = u16_def("P0-45 PCMNA", 0, 45, 1.0, "").limited(0, 127);
/// P0-46 SVSTS: state of the output functions, [`Outputs`].
pub const OUTPUTS: RegisterDef = hex16("P0-46 SVSTS", 0, 46, Access::Read);
/// P1-01 CTL: control mode, [`MODE_SPEED`] for speed control; takes effect at the next power-up.
pub const CONTROL_MODE: RegisterDef = hex16("P1-01 CTL", 1, 1, Access::ReadWrite).limited(0, 0x1110);
/// P1-09 SP1: internal speed command 1, motor rpm (2013, p. 6-13).
pub const SPEED_1: RegisterDef = i32_def("P1-09 SP1", 1, 9, 0.1, "rpm", Access::ReadWrite).limited(-50_000, 50_000);
/// P1-10 SP2: internal speed command 2, motor rpm (2013, p. 6-13).
pub const SPEED_2: RegisterDef = i32_def("P1-10 SP2", 1, 10, 0.1, "rpm", Access::ReadWrite).limited(-50_000, 50_000);
/// P1-11 SP3: internal speed command 3, motor rpm (2013, p. 6-13).
pub const SPEED_3: RegisterDef = i32_def("P1-11 SP3", 1, 11, 0.1, "rpm", Access::ReadWrite).limited(-50_000, 50_000);
/// P1-34 TACC: time from 0 to [`RAMP_SPEED_RPM`].
pub const RAMP_UP: RegisterDef = u16_def("P1-34 TACC", 1, 34, 1.0, "ms").limited(1, 20_000);
/// P1-35 TDEC: time from [`RAMP_SPEED_RPM`] to 0.
pub const RAMP_DOWN: RegisterDef = u16_def("P1-35 TDEC", 1, 35, 1.0, "ms").limited(1, 20_000);
/// P1-36 TSL: rounding of the ramps.
pub const RAMP_S_CURVE: RegisterDef = u16_def("P1-36 TSL", 1, 36, 1.0, "ms").limited(0, 10_000);
/// P1-38 ZSPD: speed below which the output ZSPD is on.
pub const ZERO_SPEED: RegisterDef = u16_def("P1-38 ZSPD", 1, 38, 0.1, "rpm").limited(0, 2000);
/// P1-39 SSPD: speed above which the output TSPD is on.
pub const TARGET_SPEED: RegisterDef = u16_def("P1-39 SSPD", 1, 39, 1.0, "rpm").limited(0, 5000);
/// P1-55 MSPD: highest motor speed.
pub const MAX_SPEED: RegisterDef = u16_def("P1-55 MSPD", 1, 55, 1.0, "rpm").limited(10, 5000);
/// P2-10 DI1 to P2-17 DI8 and P2-36 DI9: function of each digital input, [`InputFunction`].
pub const INPUT_FUNCTIONS: [RegisterDef; 9] = [
    hex16("P2-10 DI1", 2, 10, Access::ReadWrite).limited(0, 0x15F),
    hex16("P2-11 DI2", 2, 11, Access::ReadWrite).limited(0, 0x15F),
    hex16("P2-12 DI3", 2, 12, Access::ReadWrite).limited(0, 0x15F),
    hex16("P2-13 DI4", 2, 13, Access::ReadWrite).limited(0, 0x15F),
    hex16("P2-14 DI5", 2, 14, Access::ReadWrite).limited(0, 0x15F),
    hex16("P2-15 DI6", 2, 15, Access::ReadWrite).limited(0, 0x15F),
    hex16("P2-16 DI7", 2, 16, Access::ReadWrite).limited(0, 0x15F),
    hex16("P2-17 DI8", 2, 17, Access::ReadWrite).limited(0, 0x15F),
    hex16("P2-36 DI9", 2, 36, Access::ReadWrite).limited(0, 0x15F),
];
/// P2-30 INH: auxiliary functions; [`AUX_RAM_ONLY`] keeps writes out of the EEPROM. Itself never stored.
pub const AUXILIARY: RegisterDef =
    RegisterDef::new("P2-30 INH", address(2, 30), RegisterKind::I16, 1.0, "", Access::ReadWrite).limited(-8, 8);
/// P3-00 ADR: unit number.
pub const UNIT: RegisterDef = hex16("P3-00 ADR", 3, 0, Access::ReadWrite).limited(1, 0x7F);
/// P3-01 BRT: baud rate code, one hexadecimal digit a port.
pub const BAUD: RegisterDef = hex16("P3-01 BRT", 3, 1, Access::ReadWrite).limited(0, 0x55);
/// P3-02 PTL: protocol code, one hexadecimal digit a port; 6 is RTU 8N2 (2018, p. 7-81).
pub const PROTOCOL: RegisterDef = hex16("P3-02 PTL", 3, 2, Access::ReadWrite).limited(0, 0x88);
/// P3-03 FLT: what a communication fault does, [`FAULT_CONTINUE`] or [`FAULT_STOP`].
pub const FAULT_ACTION: RegisterDef = hex16("P3-03 FLT", 3, 3, Access::ReadWrite).limited(0, 1);
/// P3-04 CWD: communication watchdog; 0 (the default) is off.
pub const WATCHDOG: RegisterDef = u16_def("P3-04 CWD", 3, 4, 1.0, "s").limited(0, 20);
/// P3-05 CMM: which ports may write.
pub const COMMUNICATION_MODE: RegisterDef = hex16("P3-05 CMM", 3, 5, Access::ReadWrite).limited(0, 1);
/// P3-06 SDI: a bit an input; set means that software (P4-07) drives it instead of the terminal (2018, p. 7-88).
pub const INPUT_SOURCE: RegisterDef = hex16("P3-06 SDI", 3, 6, Access::ReadWrite).limited(0, 0x1FF);
/// P3-07 CDT: extra delay before an answer.
pub const RESPONSE_DELAY: RegisterDef = u16_def("P3-07 CDT", 3, 7, 1.0, "ms").limited(0, 1000);
/// P4-07 ITST: writes set the software inputs, reads show the inputs after combination (2018, p. 7-88).
pub const INPUTS: RegisterDef = hex16("P4-07 ITST", 4, 7, Access::ReadWrite).limited(0, 0x1FF);

/// Control mode "speed" of P1-01 (its lower two digits).
pub const MODE_SPEED: u16 = 0x02;
/// P2-30: written parameters are lost at power-off, the EEPROM is spared.
pub const AUX_RAM_ONLY: u16 = 5;
/// P3-03: report a communication fault and run on.
pub const FAULT_CONTINUE: u16 = 0;
/// P3-03: report a communication fault and stop.
pub const FAULT_STOP: u16 = 1;
/// Highest [`Alarm`] code that P0-01 shows for the communication watchdog.
pub const ALARM_COMMUNICATION_TIMEOUT: u16 = 0x0020;
/// Alarm of P0-01: the emergency stop input is open.
pub const ALARM_EMERGENCY_STOP: u16 = 0x0013;

/// Codes for P0-17 to P0-21 and P0-45 (2018, p. 7-106).
pub mod monitor {
    /// Motor speed, filtered, in steps of [`SPEED_STEP_RPM`].
    pub const SPEED: u16 = 7;
    /// Speed command after all sources, 1 rpm a step.
    pub const SPEED_COMMAND: u16 = 9;
    /// Torque command after all sources, 1 % of the rated torque a step.
    pub const TORQUE: u16 = 11;
    /// Average load, 1 % a step.
    pub const AVERAGE_LOAD: u16 = 12;
    /// Step of [`SPEED`].
    pub const SPEED_STEP_RPM: f64 = 0.1;
    /// Step of [`TORQUE`].
    pub const TORQUE_STEP_PERCENT: f64 = 1.0;
}

/// What a digital input does: the lower two digits of P2-10 to P2-17 and P2-36 (tables in chapter 7 of the manual).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum InputFunction {
    /// 00: nothing.
    Disabled,
    /// 01 SON: servo on.
    ServoOn,
    /// 02 ARST: alarm reset, on the rising edge.
    AlarmReset,
    /// 14 SPD0: speed selection, low bit.
    Speed0,
    /// 15 SPD1: speed selection, high bit.
    Speed1,
    /// 21 EMGS: emergency stop.
    EmergencyStop,
    /// 22 NL: reverse limit.
    ReverseLimit,
    /// 23 PL: forward limit.
    ForwardLimit,
    /// Any other, which the rig does not use.
    Other(u8),
}

impl InputFunction {
    /// From the parameter; its third digit is the contact and is left out.
    pub fn from_parameter(value: u16) -> Self {
        match value & 0xFF {
            0x00 => Self::Disabled,
            0x01 => Self::ServoOn,
            0x02 => Self::AlarmReset,
            0x14 => Self::Speed0,
            0x15 => Self::Speed1,
            0x21 => Self::EmergencyStop,
            0x22 => Self::ReverseLimit,
            0x23 => Self::ForwardLimit,
            other => Self::Other(other as u8),
        }
    }

    /// Code of the function.
    pub fn code(self) -> u8 {
        match self {
            Self::Disabled => 0x00,
            Self::ServoOn => 0x01,
            Self::AlarmReset => 0x02,
            Self::Speed0 => 0x14,
            Self::Speed1 => 0x15,
            Self::EmergencyStop => 0x21,
            Self::ReverseLimit => 0x22,
            Self::ForwardLimit => 0x23,
            Self::Other(code) => code,
        }
    }

    /// Parameter that gives an input this function; `normally_open` (third digit 1) acts when the input is on.
    pub fn parameter(self, normally_open: bool) -> u16 {
        u16::from(self.code()) | if normally_open { 0x100 } else { 0 }
    }
}

/// Whether a parameter of P2-10 to P2-17 and P2-36 makes its function act when the input is on.
pub const fn is_normally_open(parameter: u16) -> bool {
    parameter & 0x100 != 0
}

/// State of the output functions, the bits of P0-46.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Outputs(pub u16);

impl Outputs {
    /// SRDY: powered, no alarm.
    pub const READY: u16 = 1 << 0;
    /// SON: the motor is energised.
    pub const SERVO_ON: u16 = 1 << 1;
    /// ZSPD: speed below P1-38.
    pub const ZERO_SPEED: u16 = 1 << 2;
    /// TSPD: speed above P1-39.
    pub const TARGET_SPEED: u16 = 1 << 3;
    /// TQL: the torque is being limited.
    pub const TORQUE_LIMITED: u16 = 1 << 5;
    /// ALRM: an alarm is active.
    pub const ALARM: u16 = 1 << 6;
    /// WARN: a warning is active.
    pub const WARNING: u16 = 1 << 10;

    /// Whether all of these bits are set.
    pub fn has(self, bits: u16) -> bool {
        self.0 & bits == bits
    }
}

/// Alarms of P0-01, as the panel shows them (chapter 9 or 10 of the manual, by revision).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Alarm(pub u16);

impl Alarm {
    /// What the alarm means, for those a speed-controlled axis meets.
    pub fn meaning(self) -> &'static str {
        match self.0 {
            0x0000 => "no alarm",
            0x0001 => "overcurrent",
            0x0002 => "overvoltage",
            0x0003 => "undervoltage",
            0x0004 => "wrong motor for this drive",
            0x0005 => "regeneration error",
            0x0006 => "overload",
            0x0007 => "overspeed",
            0x0009 => "excessive deviation",
            0x0011 => "encoder error",
            0x0013 => "emergency stop",
            0x0014 => "reverse limit",
            0x0015 => "forward limit",
            0x0016 => "power stage too hot",
            0x0019 => "serial communication error",
            ALARM_COMMUNICATION_TIMEOUT => "serial communication timed out: the drive's watchdog P3-04 elapsed",
            0x0022 => "a phase of the main supply is missing",
            _ => "see the alarm list of the manual",
        }
    }
}

impl std::fmt::Display for Alarm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "AL{:03X}: {}", self.0, self.meaning())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_of_the_manual() {
        let pairs = [
            (&ALARM, 0x0002),
            (&STATUS_MONITOR, 0x0058),
            (&OUTPUTS, 0x005C),
            (&CONTROL_MODE, 0x0102),
            (&SPEED_1, 0x0112),
            (&AUXILIARY, 0x023C),
            (&PROTOCOL, 0x0304),
            (&FAULT_ACTION, 0x0306),
            (&WATCHDOG, 0x0308),
            (&INPUT_SOURCE, 0x030C),
            (&INPUTS, 0x040E),
        ];
        for (def, expected) in pairs {
            assert_eq!(def.address, expected, "{}", def.name);
        }
        assert_eq!(parameter(0x0113), (1, 9, true));
    }

    #[test]
    fn speed_in_tenths_of_rpm_low_word_first() {
        // The manual's example: 3000 rpm would be 7530h; it writes 0BB8h = 300.0 rpm.
        assert_eq!(SPEED_1.encode(300.0).unwrap(), [0x0BB8, 0x0000]);
        assert_eq!(SPEED_1.encode(-5.0).unwrap(), [0xFFCE, 0xFFFF]);
        assert!(SPEED_1.encode(5000.1).is_err());
    }

    #[test]
    fn input_functions_round_trip() {
        for code in 0..=0xFF {
            assert_eq!(InputFunction::from_parameter(0x100 | code).code(), code as u8);
        }
        assert_eq!(InputFunction::ServoOn.parameter(true), 0x101);
        assert!(is_normally_open(0x101) && !is_normally_open(0x21));
    }

    #[test]
    fn alarms_read_as_on_the_panel() {
        assert!(Alarm(0x20).to_string().starts_with("AL020: serial communication timed out"));
    }
}
