//! Riden RD60xx programmable current source, which drives the brake's coil.
//!
//! The maker publishes no register list; this one follows two public implementations that agree,
//! <https://github.com/Baldanos/rd6006> (`registers.md`) and <https://github.com/ShayBox/Riden> (`riden.py`), and
//! `docs/wire/rd60xx.md`. Scales differ from model to model, so a [`Map`] is made for the model that register 0 names.

use std::fmt;

use thiserror::Error;

use crate::register_map::{Access, RegisterDef, RegisterKind};

/// Register addresses.
pub mod address {
    /// Model number, [`Model::from_id`](super::Model::from_id).
    pub const ID: u16 = 0;
    /// Serial number, two registers, high word first.
    pub const SERIAL: u16 = 1;
    /// Firmware version in hundredths.
    pub const FIRMWARE: u16 = 3;
    /// Inner temperature, sign and magnitude, °C.
    pub const TEMPERATURE: u16 = 4;
    /// Voltage limit.
    pub const VOLTAGE_SET: u16 = 8;
    /// Current limit.
    pub const CURRENT_SET: u16 = 9;
    /// Voltage at the output.
    pub const VOLTAGE_OUT: u16 = 10;
    /// Current at the output.
    pub const CURRENT_OUT: u16 = 11;
    /// Power at the output, two registers, high word first.
    pub const POWER_OUT: u16 = 12;
    /// Supply voltage.
    pub const VOLTAGE_IN: u16 = 14;
    /// Keypad lock, 1 locked.
    pub const LOCK: u16 = 15;
    /// Tripped protection, [`Protection`](super::Protection).
    pub const PROTECTION: u16 = 16;
    /// 0 constant voltage, 1 constant current.
    pub const REGULATION: u16 = 17;
    /// Output switch, 1 on.
    pub const ENABLE: u16 = 18;
    /// Writing n loads preset Mn.
    pub const PRESET_SELECT: u16 = 19;
    /// Temperature of the external probe, sign and magnitude, °C.
    pub const EXTERNAL_TEMPERATURE: u16 = 34;
    /// Voltage limit of the active preset M0; voltage, current, over-voltage and over-current of M0 to M9 follow.
    pub const PRESETS: u16 = 80;
    /// Over-voltage trip level of the active preset M0.
    pub const OVER_VOLTAGE: u16 = 82;
    /// Over-current trip level of the active preset M0.
    pub const OVER_CURRENT: u16 = 83;
}

/// Queries a second that the device keeps up with (below ten).
pub const MAX_QUERIES_HZ: f64 = 10.0;

/// Models by the number in register 0 (the maker adds a digit for the revision).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Model {
    /// 6006x: 60 V, 6 A.
    Rd6006,
    /// 60065: 60 V, 6 A, ten times finer.
    Rd6006P,
    /// 6012x: 60 V, 12 A.
    Rd6012,
    /// 6018x: 60 V, 18 A.
    Rd6018,
}

/// A device that is not one of the models known here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "register 0 reads {id}, which is no RD60xx model known here (60060 to 60065, 60120 to 60124, 60180 to 60189): its scales are unknown; check the port and the unit, or add the model"
)]
pub struct UnknownModel {
    /// What register 0 holds.
    pub id: u16,
}

impl Model {
    /// Model of a device whose register 0 holds `id`.
    ///
    /// # Errors
    /// [`UnknownModel`] for other numbers: with a guessed scale the current could be ten times the one wanted.
    pub fn from_id(id: u16) -> Result<Self, UnknownModel> {
        match id {
            60_060..=60_064 => Ok(Self::Rd6006),
            60_065 => Ok(Self::Rd6006P),
            60_120..=60_124 => Ok(Self::Rd6012),
            60_180..=60_189 => Ok(Self::Rd6018),
            _ => Err(UnknownModel { id }),
        }
    }

    /// Number that a usual device of this model shows in register 0.
    pub fn id(self) -> u16 {
        match self {
            Self::Rd6006 => 60_062,
            Self::Rd6006P => 60_065,
            Self::Rd6012 => 60_121,
            Self::Rd6018 => 60_181,
        }
    }

    /// Step of the voltage registers, V.
    pub fn voltage_step_v(self) -> f64 {
        if self == Self::Rd6006P { 0.001 } else { 0.01 }
    }

    /// Step of the current registers, A.
    pub fn current_step_a(self) -> f64 {
        match self {
            Self::Rd6006 => 0.001,
            Self::Rd6006P => 0.0001,
            Self::Rd6012 | Self::Rd6018 => 0.01,
        }
    }

    /// Step of the power registers, W.
    pub fn power_step_w(self) -> f64 {
        if self == Self::Rd6006P { 0.001 } else { 0.01 }
    }

    /// Highest voltage that can be set, V.
    pub fn max_voltage_v(self) -> f64 {
        60.0
    }

    /// Highest current that can be set, A.
    pub fn max_current_a(self) -> f64 {
        match self {
            Self::Rd6006 | Self::Rd6006P => 6.0,
            Self::Rd6012 => 12.0,
            Self::Rd6018 => 18.0,
        }
    }
}

impl fmt::Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rd6006 => "RD6006",
            Self::Rd6006P => "RD6006P",
            Self::Rd6012 => "RD6012",
            Self::Rd6018 => "RD6018",
        })
    }
}

/// Protection that has switched the output off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Protection {
    /// 0: none.
    None,
    /// 1: over-voltage.
    OverVoltage,
    /// 2: over-current.
    OverCurrent,
    /// A code that the public lists do not explain.
    Other(u16),
}

impl Protection {
    /// From register 16.
    pub fn from_register(value: u16) -> Self {
        match value {
            0 => Self::None,
            1 => Self::OverVoltage,
            2 => Self::OverCurrent,
            other => Self::Other(other),
        }
    }

    /// Content of register 16.
    pub fn register(self) -> u16 {
        match self {
            Self::None => 0,
            Self::OverVoltage => 1,
            Self::OverCurrent => 2,
            Self::Other(code) => code,
        }
    }
}

/// The registers with the scales of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// The model.
    pub model: Model,
    /// Temperature of the external probe, °C; the probe sits on the brake's housing.
    pub temperature: RegisterDef,
    /// Temperature inside the device, °C.
    pub internal_temperature: RegisterDef,
    /// Voltage limit, V.
    pub voltage_set: RegisterDef,
    /// Current limit, A.
    pub current_set: RegisterDef,
    /// Voltage at the output, V.
    pub voltage_out: RegisterDef,
    /// Current at the output, A.
    pub current_out: RegisterDef,
    /// Power at the output, W.
    pub power_out: RegisterDef,
    /// Supply voltage, V.
    pub voltage_in: RegisterDef,
    /// Tripped protection.
    pub protection: RegisterDef,
    /// 1 while the current limit rules.
    pub regulation: RegisterDef,
    /// Output switch.
    pub enable: RegisterDef,
    /// Over-voltage trip level, V.
    pub over_voltage: RegisterDef,
    /// Over-current trip level, A.
    pub over_current: RegisterDef,
}

impl Map {
    /// First register of the block from the inner temperature to the external probe, which one request reads.
    pub const BLOCK_ADDRESS: u16 = address::TEMPERATURE;
    /// Registers of that block.
    pub const BLOCK_LEN: u16 = address::EXTERNAL_TEMPERATURE + 2 - address::TEMPERATURE;

    /// Registers of `model`.
    pub fn new(model: Model) -> Self {
        let (volts, amps) = (model.voltage_step_v(), model.current_step_a());
        let raw_max = |value: f64, step: f64| (value / step).round() as i64;
        // The trip levels may stand a little above the ranges (the keypad offers 62 V and 6.2 A on the RD6006).
        let (max_v, max_a) = (model.max_voltage_v(), model.max_current_a());
        let reading =
            |name, address, scale, unit| RegisterDef::new(name, address, RegisterKind::U16, scale, unit, Access::Read);
        let degrees =
            |name, address| RegisterDef::new(name, address, RegisterKind::SignMagnitude, 1.0, "degC", Access::Read);
        let setting = |name, address, scale, unit, max: f64| {
            RegisterDef::new(name, address, RegisterKind::U16, scale, unit, Access::ReadWrite)
                .limited(0, raw_max(max, scale))
        };
        Self {
            model,
            temperature: degrees("brake temperature", address::EXTERNAL_TEMPERATURE),
            internal_temperature: degrees("device temperature", address::TEMPERATURE),
            voltage_set: setting("voltage limit", address::VOLTAGE_SET, volts, "V", max_v),
            current_set: setting("current limit", address::CURRENT_SET, amps, "A", max_a),
            voltage_out: reading("output voltage", address::VOLTAGE_OUT, volts, "V"),
            current_out: reading("output current", address::CURRENT_OUT, amps, "A"),
            power_out: RegisterDef::new(
                "output power",
                address::POWER_OUT,
                RegisterKind::U32HighFirst,
                model.power_step_w(),
                "W",
                Access::Read,
            ),
            voltage_in: reading("supply voltage", address::VOLTAGE_IN, 0.01, "V"),
            protection: reading("protection", address::PROTECTION, 1.0, ""),
            regulation: reading("regulation", address::REGULATION, 1.0, ""),
            enable: setting("output switch", address::ENABLE, 1.0, "", 1.0),
            over_voltage: setting("over-voltage trip", address::OVER_VOLTAGE, volts, "V", max_v * 62.0 / 60.0),
            over_current: setting("over-current trip", address::OVER_CURRENT, amps, "A", max_a * 62.0 / 60.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_by_number() {
        for model in [Model::Rd6006, Model::Rd6006P, Model::Rd6012, Model::Rd6018] {
            assert_eq!(Model::from_id(model.id()), Ok(model));
            let map = Map::new(model);
            assert!(map.current_set.encode(model.max_current_a()).is_ok());
            assert!(map.current_set.encode(model.max_current_a() * 1.01).is_err());
            assert!(map.over_current.encode(model.max_current_a() * 1.02).is_ok());
        }
        assert!(Model::from_id(5015).unwrap_err().to_string().contains("5015"));
    }

    #[test]
    fn scales_of_the_6006() {
        let map = Map::new(Model::Rd6006);
        assert_eq!(map.current_set.encode(0.425).unwrap(), [425]);
        assert_eq!(map.voltage_set.encode(24.0).unwrap(), [2400]);
        assert_eq!(map.power_out.decode(&[0, 1020]).unwrap(), 10.2);
        assert_eq!(map.temperature.decode(&[1, 5]).unwrap(), -5.0);
    }

    #[test]
    fn one_block_covers_all_that_is_supervised() {
        let map = Map::new(Model::Rd6006);
        let mut block = vec![0; usize::from(Map::BLOCK_LEN)];
        block[usize::from(address::ENABLE - Map::BLOCK_ADDRESS)] = 1;
        block[usize::from(address::EXTERNAL_TEMPERATURE + 1 - Map::BLOCK_ADDRESS)] = 41;
        block[usize::from(address::CURRENT_OUT - Map::BLOCK_ADDRESS)] = 500;
        assert_eq!(map.enable.decode_from(Map::BLOCK_ADDRESS, &block).unwrap(), 1.0);
        assert_eq!(map.current_out.decode_from(Map::BLOCK_ADDRESS, &block).unwrap(), 0.5);
        assert_eq!(map.temperature.decode_from(Map::BLOCK_ADDRESS, &block).unwrap(), 41.0);
    }
}
