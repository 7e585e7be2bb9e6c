//! A Riden RD60xx that drives the brake's coil. Registers: [`wire::rd60xx`], `docs/wire/rd60xx.md`.

use wire::modbus::{ExceptionCode, MAX_READ_COUNT, Request};
use wire::rd60xx::{Map, Model, Protection, address};
use wire::register_map::RegisterDef;

use super::interface::{BrakeCoil, Reply, echo_write, read_words};

/// Registers of the device: 0 to the last preset.
const REGISTERS: usize = 120;
/// Time the device takes to answer, ns.
const PROCESSING_NS: u64 = 10_000_000;
/// Serial number and firmware (hundredths) it shows.
const SERIAL: u32 = 1_234;
const FIRMWARE: u16 = 141;
/// Supply voltage, V.
const SUPPLY_V: f64 = 65.0;
/// Temperature of the room, and rise inside the device per watt of output.
const ROOM_C: f64 = 25.0;
const RISE_C_PER_W: f64 = 0.1;
/// Values a preset holds (voltage, current, over-voltage, over-current), and how many presets there are.
const PRESET_LEN: u16 = 4;
const PRESETS: u16 = 10;

/// Registers that keep what is written to them and do nothing here: lock, date and time, options, backlight.
const INERT: [std::ops::RangeInclusive<u16>; 3] = [address::LOCK..=address::LOCK, 48..=53, 66..=72];

/// The emulated source.
#[derive(Debug, Clone)]
pub struct BrakeEmulator {
    unit: u8,
    map: Map,
    /// What was written; measured values are put in when they are read.
    registers: [u16; REGISTERS],
    protection: Protection,
    writes: u64,
    heated_by_c: f64,
    /// What it puts out over what it is set to; 1 in a sound one.
    runaway: f64,
}

impl BrakeEmulator {
    /// A device of this model at this unit number, switched off.
    pub fn new(unit: u8, model: Model) -> Self {
        let map = Map::new(model);
        let mut device = Self {
            unit,
            map,
            registers: [0; REGISTERS],
            protection: Protection::None,
            writes: 0,
            heated_by_c: 0.0,
            runaway: 1.0,
        };
        device.registers[usize::from(address::ID)] = model.id();
        device.registers[usize::from(address::SERIAL)] = (SERIAL >> 16) as u16;
        device.registers[usize::from(address::SERIAL) + 1] = SERIAL as u16;
        device.registers[usize::from(address::FIRMWARE)] = FIRMWARE;
        for preset in 0..PRESETS {
            let at = usize::from(address::PRESETS + preset * PRESET_LEN);
            device.registers[at + 2] = device.map.over_voltage.max_raw as u16;
            device.registers[at + 3] = device.map.over_current.max_raw as u16;
        }
        device
    }

    /// Unit number to which it answers.
    pub fn unit(&self) -> u8 {
        self.unit
    }

    /// Protection that has switched the output off.
    pub fn protection(&self) -> Protection {
        self.protection
    }

    /// Registers written since it was made.
    pub fn writes(&self) -> u64 {
        self.writes
    }

    /// Whether the output is on.
    pub fn is_enabled(&self) -> bool {
        self.registers[usize::from(address::ENABLE)] != 0
    }

    /// Makes its sensor show so much more than the coil has, °C.
    pub fn heat_by(&mut self, by_c: f64) {
        self.heated_by_c = by_c;
    }

    /// Makes it put out `factor` times the current that it is set to, as one does whose regulation has failed.
    pub fn run_away(&mut self, factor: f64, coil: &mut dyn BrakeCoil) {
        self.runaway = factor;
        self.drive(coil);
    }

    /// Answers a request. The time does not matter to this device, which has no watchdog of its own.
    pub fn handle(&mut self, _now_ns: u64, request: &Request, coil: &mut dyn BrakeCoil) -> Reply {
        let response = match request {
            Request::ReadHolding { address, count } => {
                let shown = self.shown(coil);
                read_words(*address, *count, MAX_READ_COUNT, |at| shown.get(usize::from(at)).copied())
            }
            Request::WriteSingle { address, value } => echo_write(request, self.write(*address, &[*value], coil)),
            Request::WriteMultiple { address, values } => echo_write(request, self.write(*address, values, coil)),
        };
        Reply::after(PROCESSING_NS, response)
    }

    /// Lets the protections look at the output.
    pub fn tick(&mut self, _now_ns: u64, coil: &mut dyn BrakeCoil) {
        if !self.is_enabled() {
            return;
        }
        let over_voltage_v = self.value(&self.map.over_voltage);
        let over_current_a = self.value(&self.map.over_current);
        let tripped = if coil.voltage_v() > over_voltage_v {
            Protection::OverVoltage
        } else if coil.current_a() > over_current_a {
            Protection::OverCurrent
        } else {
            return;
        };
        self.protection = tripped;
        self.registers[usize::from(address::ENABLE)] = 0;
        self.drive(coil);
    }

    fn value(&self, def: &RegisterDef) -> f64 {
        // Limits and settings are single registers inside the table.
        def.decode(&self.registers[usize::from(def.address)..][..1]).unwrap_or(f64::INFINITY)
    }

    /// All registers as a master sees them now.
    fn shown(&self, coil: &dyn BrakeCoil) -> [u16; REGISTERS] {
        let mut shown = self.registers;
        let map = &self.map;
        let (voltage_v, current_a) = (coil.voltage_v(), coil.current_a());
        let power_w = voltage_v * current_a;
        let limited = self.is_enabled() && current_a >= self.value(&map.current_set) - 0.5 * map.current_set.scale;
        let measured = [
            (&map.temperature, coil.temperature_c() + self.heated_by_c),
            (&map.internal_temperature, ROOM_C + RISE_C_PER_W * power_w),
            (&map.voltage_out, voltage_v),
            (&map.current_out, current_a),
            (&map.power_out, power_w),
            (&map.voltage_in, SUPPLY_V),
            (&map.protection, f64::from(self.protection.register())),
            (&map.regulation, f64::from(u8::from(limited))),
        ];
        for (def, value) in measured {
            // A meter shows the end of its range for what lies beyond it.
            let (min, max) = def.limits();
            let words = def.encode(value.clamp(min, max)).unwrap_or_default();
            shown[usize::from(def.address)..][..words.len()].copy_from_slice(&words);
        }
        shown
    }

    /// Writes consecutive registers, all or none.
    fn write(&mut self, start: u16, values: &[u16], coil: &mut dyn BrakeCoil) -> Result<(), ExceptionCode> {
        for (at, value) in (start..).zip(values) {
            self.check(at, *value)?;
        }
        for (at, value) in (start..).zip(values) {
            self.writes += 1;
            match at {
                address::PRESET_SELECT => self.load_preset(*value),
                address::ENABLE => {
                    self.registers[usize::from(at)] = *value;
                    self.protection = Protection::None;
                }
                _ => self.registers[usize::from(at)] = *value,
            }
        }
        self.drive(coil);
        Ok(())
    }

    fn check(&self, at: u16, value: u16) -> Result<(), ExceptionCode> {
        let in_preset = at.checked_sub(address::PRESETS).map(|offset| offset % PRESET_LEN);
        let map = &self.map;
        let max_raw = match (at, in_preset) {
            (address::VOLTAGE_SET, _) => map.voltage_set.max_raw,
            (address::CURRENT_SET, _) => map.current_set.max_raw,
            (address::ENABLE, _) => 1,
            (address::PRESET_SELECT, _) => i64::from(PRESETS) - 1,
            _ if INERT.iter().any(|range| range.contains(&at)) => i64::from(u16::MAX),
            (_, Some(_)) if usize::from(at) >= REGISTERS => return Err(ExceptionCode::IllegalDataAddress),
            (_, Some(0)) => map.voltage_set.max_raw,
            (_, Some(1)) => map.current_set.max_raw,
            (_, Some(2)) => map.over_voltage.max_raw,
            (_, Some(_)) => map.over_current.max_raw,
            _ => return Err(ExceptionCode::IllegalDataAddress),
        };
        if i64::from(value) <= max_raw { Ok(()) } else { Err(ExceptionCode::IllegalDataValue) }
    }

    /// Copies a preset's voltage and current to the settings and all of it to M0, the active preset.
    fn load_preset(&mut self, preset: u16) {
        let from = usize::from(address::PRESETS + preset * PRESET_LEN);
        let values = [0, 1, 2, 3].map(|n| self.registers[from + n]);
        self.registers[usize::from(address::VOLTAGE_SET)] = values[0];
        self.registers[usize::from(address::CURRENT_SET)] = values[1];
        self.registers[usize::from(address::PRESETS)..][..values.len()].copy_from_slice(&values);
    }

    fn drive(&self, coil: &mut dyn BrakeCoil) {
        let current_a = self.value(&self.map.current_set) * self.runaway;
        coil.set_drive(self.is_enabled(), current_a, self.value(&self.map.voltage_set));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::modbus::Response;

    #[derive(Default)]
    struct Coil {
        enabled: bool,
        current_a: f64,
        voltage_v: f64,
        limits: (f64, f64),
        temperature_c: f64,
    }

    impl BrakeCoil for Coil {
        fn set_drive(&mut self, enabled: bool, current_limit_a: f64, voltage_limit_v: f64) {
            (self.enabled, self.limits) = (enabled, (current_limit_a, voltage_limit_v));
        }
        fn current_a(&self) -> f64 {
            self.current_a
        }
        fn voltage_v(&self) -> f64 {
            self.voltage_v
        }
        fn temperature_c(&self) -> f64 {
            self.temperature_c
        }
    }

    fn device() -> BrakeEmulator {
        BrakeEmulator::new(1, Model::Rd6006)
    }

    fn set(device: &mut BrakeEmulator, coil: &mut Coil, address: u16, value: u16) -> Response {
        device.handle(0, &Request::WriteSingle { address, value }, coil).response.unwrap()
    }

    fn get(device: &mut BrakeEmulator, coil: &mut Coil, address: u16, count: u16) -> Vec<u16> {
        match device.handle(0, &Request::ReadHolding { address, count }, coil).response {
            Some(Response::Registers(values)) => values,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn drives_the_coil_within_its_settings() {
        let (mut device, mut coil) = (device(), Coil::default());
        set(&mut device, &mut coil, address::VOLTAGE_SET, 2400);
        set(&mut device, &mut coil, address::CURRENT_SET, 425);
        assert!(!coil.enabled);
        set(&mut device, &mut coil, address::ENABLE, 1);
        assert!(coil.enabled);
        assert_eq!(coil.limits, (0.425, 24.0));
    }

    #[test]
    fn a_source_whose_regulation_fails_puts_out_more_than_it_says_it_is_set_to() {
        let (mut device, mut coil) = (device(), Coil::default());
        set(&mut device, &mut coil, address::CURRENT_SET, 300);
        set(&mut device, &mut coil, address::ENABLE, 1);
        device.run_away(2.0, &mut coil);
        assert_eq!(coil.limits.0, 0.6);
        assert_eq!(get(&mut device, &mut coil, address::CURRENT_SET, 1), [300]);
    }

    #[test]
    fn measures_in_one_block() {
        let (mut device, mut coil) = (device(), Coil::default());
        set(&mut device, &mut coil, address::CURRENT_SET, 500);
        set(&mut device, &mut coil, address::ENABLE, 1);
        (coil.current_a, coil.voltage_v, coil.temperature_c) = (0.5, 12.0, -3.0);
        let map = Map::new(Model::Rd6006);
        let block = get(&mut device, &mut coil, Map::BLOCK_ADDRESS, Map::BLOCK_LEN);
        let value = |def: &RegisterDef| def.decode_from(Map::BLOCK_ADDRESS, &block).unwrap();
        assert_eq!(value(&map.current_out), 0.5);
        assert_eq!(value(&map.voltage_out), 12.0);
        assert_eq!(value(&map.power_out), 6.0);
        assert_eq!(value(&map.temperature), -3.0);
        assert_eq!(value(&map.regulation), 1.0);
        assert_eq!(value(&map.enable), 1.0);
    }

    #[test]
    fn refuses_unknown_registers_and_bad_values() {
        let (mut device, mut coil) = (device(), Coil::default());
        let address_error = Response::Exception(ExceptionCode::IllegalDataAddress);
        let value_error = Response::Exception(ExceptionCode::IllegalDataValue);
        assert_eq!(set(&mut device, &mut coil, address::CURRENT_SET, 6001), value_error);
        assert_eq!(set(&mut device, &mut coil, address::ENABLE, 2), value_error);
        assert_eq!(set(&mut device, &mut coil, address::VOLTAGE_OUT, 1), address_error);
        assert_eq!(set(&mut device, &mut coil, 120, 1), address_error);
        let past_end = Request::ReadHolding { address: 119, count: 2 };
        assert_eq!(device.handle(0, &past_end, &mut coil).response, Some(address_error.clone()));
        // All or none: the good first value is not taken when the second is bad.
        let both = Request::WriteMultiple { address: address::VOLTAGE_SET, values: vec![1200, 9999] };
        assert_eq!(device.handle(0, &both, &mut coil).response, Some(value_error));
        assert_eq!(get(&mut device, &mut coil, address::VOLTAGE_SET, 2), [0, 0]);
        let wrap = Request::ReadHolding { address: 0xFFFF, count: 2 };
        assert_eq!(device.handle(0, &wrap, &mut coil).response, Some(address_error));
    }

    #[test]
    fn a_protection_switches_off_and_says_which() {
        let (mut device, mut coil) = (device(), Coil::default());
        set(&mut device, &mut coil, address::OVER_VOLTAGE, 3000);
        set(&mut device, &mut coil, address::ENABLE, 1);
        coil.voltage_v = 29.0;
        device.tick(0, &mut coil);
        assert!(coil.enabled);
        coil.voltage_v = 31.0;
        device.tick(0, &mut coil);
        assert!(!coil.enabled);
        assert_eq!(get(&mut device, &mut coil, address::PROTECTION, 3), [1, 0, 0]);
        set(&mut device, &mut coil, address::ENABLE, 1);
        assert_eq!(device.protection(), Protection::None);
    }

    #[test]
    fn presets_load_into_the_settings() {
        let (mut device, mut coil) = (device(), Coil::default());
        let preset = Request::WriteMultiple { address: address::PRESETS + 8, values: vec![1000, 250, 1100, 300] };
        assert!(matches!(device.handle(0, &preset, &mut coil).response, Some(Response::WroteMultiple { .. })));
        set(&mut device, &mut coil, address::PRESET_SELECT, 2);
        assert_eq!(get(&mut device, &mut coil, address::VOLTAGE_SET, 2), [1000, 250]);
        assert_eq!(get(&mut device, &mut coil, address::OVER_VOLTAGE, 2), [1100, 300]);
    }
}
