//! Register maps: what a Modbus device is, as data. One TOML file a device; the drivers in `mapped_servo` and `mapped_brake` run
//! from it.
//!
//! A map names each register's address, type, word order, scale, unit and whether it reads back, the silence its line wants, and the
//! steps that prepare, enable and release the device. It states its sources.

mod check;
mod load;
mod mapped;

use std::collections::BTreeMap;

use serde::Deserialize;
use wire::register_map::{Access, RegisterDef, RegisterKind};

pub use load::{BUILT_IN, MapError};
pub(super) use mapped::Mapped;

/// Driver's name of a device whose register map is a file of its own, named by `map`.
pub const DRIVER: &str = "map";

/// A device as data.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// Its name in profiles.
    pub name: String,
    /// Its name for people.
    pub title: String,
    /// What it does.
    pub kind: Kind,
    /// Where the registers were taken from.
    pub source: Vec<String>,
    /// What nobody has tried yet.
    #[serde(default)]
    pub caution: String,
    /// How its line is used.
    pub line: LineRules,
    /// Its registers by name.
    pub registers: BTreeMap<String, Register>,
    /// Models whose scales differ.
    #[serde(default)]
    pub models: Vec<ModelRules>,
    /// How it is driven, if it is a servo.
    pub servo: Option<ServoRules>,
    /// How it is driven, if it is a brake's current source.
    pub brake: Option<BrakeRules>,
    /// What alarm codes mean.
    #[serde(default)]
    pub alarms: BTreeMap<String, String>,
}

/// What a device does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Turns the driver.
    Servo,
    /// Feeds the brake's coil.
    Brake,
}

/// How a line is used.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineRules {
    /// Silence before and after a frame, ms.
    pub silence_ms: f64,
    /// Longest wait for an answer, ms.
    pub patience_ms: f64,
    /// How often a request is sent.
    pub attempts: u32,
    /// Ranges that may be read as a whole: first register, count.
    #[serde(default)]
    pub readable: Vec<[u16; 2]>,
}

/// A register.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Register {
    /// What the manual and the device's panel call it, say `P3-04`.
    #[serde(default)]
    pub label: String,
    /// First address.
    pub address: u16,
    /// How it stores its number.
    #[serde(rename = "type")]
    pub kind: NumberType,
    /// Which word of two comes first.
    pub word_order: Option<WordOrder>,
    /// Value of one step.
    #[serde(default = "one")]
    pub scale: f64,
    /// Unit of the value.
    #[serde(default)]
    pub unit: String,
    /// Who may write it.
    #[serde(default)]
    pub access: AccessRule,
    /// Smallest number it takes, in steps.
    pub min: Option<i64>,
    /// Largest number it takes, in steps.
    pub max: Option<i64>,
    /// What was written reads back; if not, its effect is looked at.
    #[serde(default = "yes")]
    pub read_back: bool,
}

fn one() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}

/// How a register stores its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NumberType {
    /// 16 bits, unsigned.
    U16,
    /// 16 bits, two's complement.
    I16,
    /// 32 bits, unsigned.
    U32,
    /// 32 bits, two's complement.
    I32,
    /// A word of sign, a word of magnitude.
    SignMagnitude,
}

/// Which word of two comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WordOrder {
    /// The low word.
    LowFirst,
    /// The high word.
    HighFirst,
}

/// Who may write a register.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AccessRule {
    /// Nobody.
    #[default]
    Read,
    /// The driver.
    ReadWrite,
}

/// Scales and limits of one model.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelRules {
    /// Its name.
    pub name: String,
    /// First and last number it shows.
    pub ids: [u16; 2],
    /// Scales that differ.
    #[serde(default)]
    pub scale: BTreeMap<String, f64>,
    /// Largest numbers that differ, in steps.
    #[serde(default)]
    pub max: BTreeMap<String, i64>,
}

/// One write.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Register.
    pub set: String,
    /// A number, or a quantity of the run: `accel_ms`, `decel_ms`, `lease_s` (rounded up to whole steps), `voltage_v`.
    pub to: StepValue,
    /// The quantity is multiplied by this.
    #[serde(default = "one")]
    pub times: f64,
}

/// What a step writes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum StepValue {
    /// This number.
    Number(f64),
    /// A quantity of the run.
    Quantity(String),
}

/// A condition on a register.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Test {
    /// Register.
    pub register: String,
    /// Bits that are looked at.
    pub mask: Option<u32>,
    /// True when the bits are this; without it, when any bit of the mask is set.
    pub equals: Option<u32>,
    /// True when the number is this or more.
    pub at_least: Option<u32>,
    /// What a person does when it does not hold.
    #[serde(default)]
    pub advice: String,
}

impl Test {
    /// Whether it holds for a register's value.
    #[must_use]
    pub fn holds(&self, value: f64) -> bool {
        let bits = value as i64 as u32 & self.mask.unwrap_or(u32::MAX);
        match (self.equals, self.at_least) {
            (Some(wanted), _) => bits == wanted,
            (None, Some(least)) => bits >= least,
            (None, None) => bits != 0,
        }
    }
}

/// How a servo is driven.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoRules {
    /// Firmware version.
    pub firmware: Option<String>,
    /// Speed setpoint, rpm of the motor.
    pub speed_set: String,
    /// Highest speed that the drive allows, rpm.
    pub max_speed: String,
    /// What must hold before anything is written.
    #[serde(default)]
    pub require: Vec<Test>,
    /// First steps, before alarms are looked at.
    #[serde(default)]
    pub before_alarm_reset: Vec<Step>,
    /// Steps that prepare it; the motor stays off.
    pub prepare: Vec<Step>,
    /// Steps that arm its communication watchdog; none when it has none.
    #[serde(default)]
    pub watchdog: Vec<Step>,
    /// Steps that disarm it.
    #[serde(default)]
    pub watchdog_off: Vec<Step>,
    /// Steps that energise the motor.
    pub enable: Vec<Step>,
    /// Steps that free it.
    pub disable: Vec<Step>,
    /// How long that may take, s.
    #[serde(default = "one")]
    pub enable_s: f64,
    /// What it says of itself.
    pub status: ServoStatusRules,
    /// The alarm that its watchdog leaves, and how it is reset.
    pub own_watchdog_alarm: Option<WatchdogAlarm>,
    /// The alarm that the input of its emergency stop leaves; without it, that is an alarm as any other.
    pub emergency_stop_alarm: Option<u16>,
}

/// What a servo says of itself.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoStatusRules {
    /// Motor speed, rpm.
    pub speed: String,
    /// Motor torque, % of the rated one; without it the drive does not tell.
    pub torque: Option<String>,
    /// The motor is energised.
    pub enabled: Test,
    /// An alarm is active.
    pub fault: Test,
    /// The alarm's code; without it the register of `fault` is shown.
    pub alarm: Option<String>,
}

/// The alarm that a servo's own watchdog leaves.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WatchdogAlarm {
    /// Its code.
    pub code: u16,
    /// How it is reset.
    pub reset: Vec<Step>,
}

/// How a brake's current source is driven.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrakeRules {
    /// Model number, which selects one of `models`.
    pub model: Option<String>,
    /// Serial number.
    pub serial: Option<String>,
    /// Firmware version.
    pub firmware: Option<String>,
    /// Coil current, A.
    pub current_set: String,
    /// Steps that switch it on without current.
    pub prepare: Vec<Step>,
    /// Steps that switch it off.
    pub release: Vec<Step>,
    /// What it says of itself.
    pub status: BrakeStatusRules,
}

/// What a brake's current source says of itself.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrakeStatusRules {
    /// Coil current, A.
    pub current: String,
    /// Temperature, °C.
    pub temperature: String,
    /// A protection has tripped.
    pub tripped: Test,
    /// The output is on.
    pub enabled: Test,
}

impl Map {
    /// A register as the bus takes it, with a model's scale and limit.
    #[must_use]
    pub fn register(&self, name: &str, model: Option<&ModelRules>) -> Option<RegisterDef> {
        let register = self.registers.get(name)?;
        let scale = model.and_then(|model| model.scale.get(name)).copied().unwrap_or(register.scale);
        let kind = register.number();
        let (least, most) = kind.limits();
        let max = model.and_then(|model| model.max.get(name)).copied().or(register.max);
        Some(RegisterDef {
            name: format!("{} {name}", self.title).into(),
            address: register.address,
            kind,
            scale,
            unit: register.unit.clone().into(),
            access: match register.access {
                AccessRule::Read => Access::Read,
                AccessRule::ReadWrite => Access::ReadWrite,
            },
            min_raw: register.min.unwrap_or(least),
            max_raw: max.unwrap_or(most),
        })
    }

    /// An alarm's code and meaning.
    #[must_use]
    pub fn alarm_text(&self, code: u16) -> String {
        let meaning = self.alarms.iter().find(|(key, _)| alarm_code(key) == Some(code)).map(|(_, text)| text.as_str());
        format!("alarm {code:04X}h: {}", meaning.unwrap_or("see the alarm list of the manual"))
    }
}

/// An alarm's code as a key: `0x0020` or `32`.
fn alarm_code(key: &str) -> Option<u16> {
    key.strip_prefix("0x").map_or_else(|| key.parse().ok(), |hex| u16::from_str_radix(hex, 16).ok())
}

impl Register {
    /// How the wire stores it.
    #[must_use]
    pub fn number(&self) -> RegisterKind {
        let low = self.word_order != Some(WordOrder::HighFirst);
        match self.kind {
            NumberType::U16 => RegisterKind::U16,
            NumberType::I16 => RegisterKind::I16,
            NumberType::U32 if low => RegisterKind::U32LowFirst,
            NumberType::U32 => RegisterKind::U32HighFirst,
            NumberType::I32 if low => RegisterKind::I32LowFirst,
            NumberType::I32 => RegisterKind::I32HighFirst,
            NumberType::SignMagnitude => RegisterKind::SignMagnitude,
        }
    }
}

impl Step {
    /// The value that it writes.
    #[must_use]
    pub fn value(&self, quantities: &[(&'static str, f64)]) -> f64 {
        match &self.to {
            StepValue::Number(number) => *number,
            StepValue::Quantity(name) => {
                let value = quantities.iter().find(|(known, _)| known == name).map_or(0.0, |(_, value)| *value);
                let scaled = value * self.times;
                // A watchdog that counts in steps must not end before the lease.
                if name == "lease_s" { scaled.ceil() } else { scaled }
            }
        }
    }
}

#[cfg(test)]
mod tests;
