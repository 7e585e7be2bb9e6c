//! The emulated servo drive's parameters: what it has, what it keeps in EEPROM, what it accepts.

use std::collections::BTreeMap;

use wire::asda_b2::{self as drive, InputFunction};
use wire::modbus::ExceptionCode;
use wire::register_map::{Access, RegisterDef};

/// Firmware that P0-00 shows.
const FIRMWARE: i64 = 1042;

/// One parameter.
#[derive(Debug, Clone)]
struct Parameter {
    def: RegisterDef,
    /// In force, or the command last written.
    raw: i64,
    /// What the next power-up finds; `None` for one that is never stored.
    stored: Option<i64>,
    /// What the next power-up finds of one that is never stored.
    initial: i64,
}

/// All parameters by address of their low word.
#[derive(Debug, Clone)]
pub(super) struct Parameters(BTreeMap<u16, Parameter>);

impl Parameters {
    /// As a drive leaves commissioning for the rig: factory values, but speed mode, 38400 baud 8N2 and this unit number.
    pub fn commissioned(unit: u8) -> Self {
        let mut parameters = Self(BTreeMap::new());
        let inputs = [
            InputFunction::ServoOn.parameter(true),
            // The factory gives DI2 to DI4 to position and torque mode (CCLR, TCM0, TCM1).
            InputFunction::Other(0x04).parameter(true),
            InputFunction::Other(0x16).parameter(true),
            InputFunction::Other(0x17).parameter(true),
            InputFunction::AlarmReset.parameter(true),
            InputFunction::ReverseLimit.parameter(false),
            InputFunction::ForwardLimit.parameter(false),
            InputFunction::EmergencyStop.parameter(false),
            InputFunction::Disabled.parameter(true),
        ];
        let stored = [
            (drive::FIRMWARE, FIRMWARE),
            (drive::MONITOR_1_CODE, 0),
            (drive::MONITOR_2_CODE, 0),
            (drive::MONITOR_3_CODE, 0),
            (drive::CONTROL_MODE, i64::from(drive::MODE_SPEED)),
            (drive::SPEED_1, 10_000),
            (drive::SPEED_2, 20_000),
            (drive::SPEED_3, 30_000),
            (drive::RAMP_UP, 200),
            (drive::RAMP_DOWN, 200),
            (drive::RAMP_S_CURVE, 0),
            (drive::ZERO_SPEED, 100),
            (drive::TARGET_SPEED, 3000),
            (drive::MAX_SPEED, 3000),
            (drive::UNIT, i64::from(unit)),
            (drive::BAUD, 0x33),
            (drive::PROTOCOL, 0x66),
            (drive::FAULT_ACTION, 0),
            (drive::WATCHDOG, 0),
            (drive::COMMUNICATION_MODE, 0),
            (drive::RESPONSE_DELAY, 0),
        ];
        let volatile = [
            drive::ALARM,
            drive::MONITOR_1,
            drive::MONITOR_2,
            drive::MONITOR_3,
            drive::STATUS_MONITOR,
            drive::STATUS_MONITOR_CODE,
            drive::OUTPUTS,
            drive::AUXILIARY,
            drive::INPUT_SOURCE,
            drive::INPUTS,
        ];
        for (def, value) in stored {
            parameters.insert(def, value, true);
        }
        for (def, value) in drive::INPUT_FUNCTIONS.into_iter().zip(inputs) {
            parameters.insert(def, i64::from(value), true);
        }
        for def in volatile {
            parameters.insert(def, 0, false);
        }
        parameters
    }

    fn insert(&mut self, def: RegisterDef, raw: i64, is_stored: bool) {
        let parameter = Parameter { raw, stored: is_stored.then_some(raw), initial: raw, def };
        self.0.insert(parameter.def.address, parameter);
    }

    /// Raw content of the parameter whose low word stands here; 0 where there is none.
    pub fn raw(&self, address: u16) -> i64 {
        self.0.get(&address).map_or(0, |parameter| parameter.raw)
    }

    /// Raw content of the parameter that has a word here. Every parameter takes two words, low word first, whatever its size.
    pub fn find(&self, at: u16) -> Option<i64> {
        self.0.get(&(at & !1)).map(|parameter| parameter.raw)
    }

    /// What writing `values` from `start` on would change: (address, raw content), checked.
    ///
    /// Errors: exception 2 where there is no writable parameter, exception 3 for a content the drive does not accept.
    pub fn changes(&self, start: u16, values: &[u16]) -> Result<Vec<(u16, i64)>, ExceptionCode> {
        let mut changes: Vec<(u16, i64)> = Vec::new();
        for (offset, value) in (0u16..).zip(values) {
            let at = start.checked_add(offset).ok_or(ExceptionCode::IllegalDataAddress)?;
            let low = at & !1;
            let parameter = self.0.get(&low).ok_or(ExceptionCode::IllegalDataAddress)?;
            if parameter.def.access == Access::Read {
                return Err(ExceptionCode::IllegalDataAddress);
            }
            let before = match changes.last() {
                Some((address, raw)) if *address == low => *raw,
                _ => parameter.raw,
            };
            let raw = with_word(&parameter.def, before, at != low, *value);
            match changes.last_mut() {
                Some((address, pending)) if *address == low => *pending = raw,
                _ => changes.push((low, raw)),
            }
        }
        let accepted = changes.iter().all(|(address, raw)| {
            self.0.get(address).is_some_and(|parameter| (parameter.def.min_raw..=parameter.def.max_raw).contains(raw))
        });
        if accepted { Ok(changes) } else { Err(ExceptionCode::IllegalDataValue) }
    }

    /// Sets a parameter; true when that cost a write of the EEPROM.
    pub fn set(&mut self, address: u16, raw: i64, ram_only: bool) -> bool {
        let Some(parameter) = self.0.get_mut(&address) else {
            return false;
        };
        parameter.raw = raw;
        let stores = parameter.stored.is_some() && !ram_only;
        if stores {
            parameter.stored = Some(raw);
        }
        stores
    }

    /// Power-up: everything is what was stored.
    pub fn forget(&mut self) {
        for parameter in self.0.values_mut() {
            parameter.raw = parameter.stored.unwrap_or(parameter.initial);
        }
    }
}

/// `raw` with one of its two words replaced, in the parameter's own type. The second word of a 16-bit parameter has to be 0.
fn with_word(def: &RegisterDef, raw: i64, high: bool, word: u16) -> i64 {
    let (low_word, high_word) = if high { (raw as u16, word) } else { (word, (raw >> 16) as u16) };
    if def.words() == 2 {
        // Both words are there, so decoding cannot fail.
        def.decode_raw(&[low_word, high_word]).unwrap_or(raw)
    } else if high {
        raw + (i64::from(word) << 16)
    } else {
        def.decode_raw(&[low_word]).unwrap_or(raw)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_make_the_parameters_own_type() {
        let parameters = Parameters::commissioned(1);
        let speed = drive::SPEED_1.address;
        assert_eq!(parameters.changes(speed, &[0xFFCE, 0xFFFF]), Ok(vec![(speed, -50)]));
        // One word alone replaces one word.
        assert_eq!(parameters.changes(speed, &[50]), Ok(vec![(speed, 50)]));
        assert_eq!(parameters.changes(speed, &[0, 1]), Err(ExceptionCode::IllegalDataValue));
        let auxiliary = drive::AUXILIARY.address;
        assert_eq!(parameters.changes(auxiliary, &[0xFFF8]), Ok(vec![(auxiliary, -8)]));
        assert_eq!(parameters.changes(auxiliary, &[5, 1]), Err(ExceptionCode::IllegalDataValue));
    }

    #[test]
    fn a_span_covers_neighbours() {
        let parameters = Parameters::commissioned(1);
        let start = drive::FAULT_ACTION.address;
        assert_eq!(parameters.changes(start, &[1, 0, 2, 0]), Ok(vec![(start, 1), (drive::WATCHDOG.address, 2)]));
        assert_eq!(parameters.changes(0x01FE, &[0]), Err(ExceptionCode::IllegalDataAddress));
        assert_eq!(parameters.changes(drive::OUTPUTS.address, &[0]), Err(ExceptionCode::IllegalDataAddress));
        assert_eq!(parameters.changes(0xFFFF, &[0, 0]), Err(ExceptionCode::IllegalDataAddress));
    }

    #[test]
    fn what_is_not_stored_is_forgotten() {
        let mut parameters = Parameters::commissioned(1);
        assert!(parameters.set(drive::RAMP_UP.address, 300, false));
        assert!(!parameters.set(drive::RAMP_DOWN.address, 400, true));
        assert!(!parameters.set(drive::AUXILIARY.address, 5, false));
        parameters.forget();
        assert_eq!(parameters.raw(drive::RAMP_UP.address), 300);
        assert_eq!(parameters.raw(drive::RAMP_DOWN.address), 200);
        assert_eq!(parameters.raw(drive::AUXILIARY.address), 0);
    }
}
