//! Everything that can be wrong with a register map beyond its syntax, each with its line.

use super::{AccessRule, Kind, Map, NumberType, Step, StepValue, Test, alarm_code};
use crate::profile::lines::{Fault, Lines};

/// Quantities of a run that steps may name.
pub const QUANTITIES: [&str; 4] = ["accel_ms", "decel_ms", "lease_s", "voltage_v"];

/// Every fault of a map.
pub fn check(map: &Map, text: &str) -> Vec<Fault> {
    let lines = Lines::of(text);
    let mut check = Check { map, lines: &lines, faults: Vec::new() };
    check.head();
    check.registers();
    match (map.kind, &map.servo, &map.brake) {
        (Kind::Servo, Some(_), None) => check.servo(),
        (Kind::Brake, None, Some(_)) => check.brake(),
        (kind, ..) => check.fault(&["kind"], format!("is {kind:?}: give the section of that name, and no other")),
    }
    check.faults
}

struct Check<'a> {
    map: &'a Map,
    lines: &'a Lines,
    faults: Vec<Fault>,
}

impl Check<'_> {
    fn fault(&mut self, path: &[&str], what: impl Into<String>) {
        self.faults.push(self.lines.fault(path, what));
    }

    fn head(&mut self) {
        if self.map.source.iter().all(|source| source.trim().is_empty()) {
            self.fault(&["source"], "is empty: say where the registers were taken from (manual, revision, page)");
        }
        let line = &self.map.line;
        for (key, value, most) in [("silence_ms", line.silence_ms, 1000.0), ("patience_ms", line.patience_ms, 5000.0)] {
            if !(value.is_finite() && (0.0..=most).contains(&value)) {
                self.fault(&["line", key], format!("= {value} must be from 0 to {most} ms"));
            }
        }
        if !(1..=10).contains(&line.attempts) {
            self.fault(&["line", "attempts"], format!("= {} must be from 1 to 10", line.attempts));
        }
        for [first, words] in &line.readable {
            if *words == 0 || *words > 125 || u32::from(*first) + u32::from(*words) > 0x1_0000 {
                self.fault(
                    &["line", "readable"],
                    format!("[{first:#06x}, {words}] must hold 1 to 125 registers below 0x10000"),
                );
            }
        }
        for key in self.map.alarms.keys().filter(|key| alarm_code(key).is_none()) {
            self.fault(&["alarms", key], "is not a code: write 0x0020 or 32");
        }
    }

    fn registers(&mut self) {
        for (name, register) in &self.map.registers {
            let path = ["registers", name.as_str()];
            let double = matches!(register.kind, NumberType::U32 | NumberType::I32);
            if double != register.word_order.is_some() {
                let what = if double {
                    "has two words: give word_order = \"low-first\" or \"high-first\""
                } else {
                    "has no words to order: leave word_order out"
                };
                self.fault(&path, what);
            }
            if !(register.scale.is_finite() && register.scale != 0.0) {
                self.fault(&path, format!("scale = {} must be a finite number other than 0", register.scale));
            }
            let (least, most) = register.number().limits();
            let (min, max) = (register.min.unwrap_or(least), register.max.unwrap_or(most));
            if min > max || min < least || max > most {
                self.fault(&path, format!("limits {min} to {max} must lie in {least} to {most} and rise"));
            }
            if u32::from(register.address) + u32::from(register.number().words()) > 0x1_0000 {
                self.fault(&path, format!("address {:#06x} runs past the last register", register.address));
            }
            let same = self
                .map
                .registers
                .iter()
                .find(|(other, def)| other.as_str() < name.as_str() && def.address == register.address);
            if let Some((other, _)) = same {
                self.fault(&path, format!("has the address {:#06x} of '{other}'", register.address));
            }
        }
        for model in &self.map.models {
            if model.ids[0] > model.ids[1] {
                self.fault(&["models"], format!("'{}': ids {:?} must rise", model.name, model.ids));
            }
            for name in model.scale.keys().chain(model.max.keys()) {
                self.known(&["models"], name);
            }
        }
    }

    fn known(&mut self, path: &[&str], name: &str) -> bool {
        let known = self.map.registers.contains_key(name);
        if !known {
            let names: Vec<&str> = self.map.registers.keys().map(String::as_str).collect();
            self.fault(path, format!("names '{name}', which is not under [registers] ({})", names.join(", ")));
        }
        known
    }

    fn steps(&mut self, path: &[&str], steps: &[Step]) {
        for step in steps {
            if !self.known(path, &step.set) {
                continue;
            }
            if self.map.registers[&step.set].access == AccessRule::Read {
                self.fault(path, format!("writes '{}', whose access is not read-write", step.set));
            }
            match &step.to {
                StepValue::Quantity(name) if !QUANTITIES.contains(&name.as_str()) => {
                    self.fault(
                        path,
                        format!("sets '{}' to '{name}', which is none of {}", step.set, QUANTITIES.join(", ")),
                    );
                }
                StepValue::Number(value) => {
                    let refused = self.map.register(&step.set, None).and_then(|def| def.encode(*value).err());
                    if let Some(reason) = refused {
                        self.fault(path, reason.to_string());
                    }
                }
                StepValue::Quantity(_) => {}
            }
        }
    }

    fn test(&mut self, path: &[&str], test: &Test) {
        self.known(path, &test.register);
        if test.equals.is_some() && test.at_least.is_some() {
            self.fault(path, "has both equals and at_least: keep one");
        }
    }

    fn unit(&mut self, path: &[&str], name: &str, unit: &str) {
        if self.known(path, name) && self.map.registers[name].unit != unit {
            self.fault(path, format!("names '{name}' in '{}', wanted in '{unit}'", self.map.registers[name].unit));
        }
    }

    fn servo(&mut self) {
        let Some(servo) = &self.map.servo else { return };
        for name in servo.firmware.iter().chain(&servo.status.alarm) {
            self.known(&["servo"], name);
        }
        self.unit(&["servo", "speed_set"], &servo.speed_set, "rpm");
        self.unit(&["servo", "max_speed"], &servo.max_speed, "rpm");
        self.unit(&["servo", "status", "speed"], &servo.status.speed, "rpm");
        if let Some(torque) = &servo.status.torque {
            self.unit(&["servo", "status", "torque"], torque, "%");
        }
        let reset = servo.own_watchdog_alarm.as_ref().map_or(&[][..], |alarm| &alarm.reset);
        for (key, steps) in [
            ("before_alarm_reset", &servo.before_alarm_reset[..]),
            ("prepare", &servo.prepare),
            ("watchdog", &servo.watchdog),
            ("watchdog_off", &servo.watchdog_off),
            ("enable", &servo.enable),
            ("disable", &servo.disable),
            ("own_watchdog_alarm", reset),
        ] {
            self.steps(&["servo", key], steps);
        }
        if servo.enable.is_empty() || servo.disable.is_empty() {
            self.fault(&["servo"], "needs steps under enable and under disable");
        }
        for step in &servo.watchdog {
            if self.map.registers.get(&step.set).is_some_and(|register| !register.read_back) {
                self.fault(
                    &["servo", "watchdog"],
                    format!("'{}' must read back: an unproven watchdog is none", step.set),
                );
            }
        }
        for test in &servo.require {
            self.test(&["servo", "require"], test);
        }
        self.test(&["servo", "status", "enabled"], &servo.status.enabled);
        self.test(&["servo", "status", "fault"], &servo.status.fault);
    }

    fn brake(&mut self) {
        let Some(brake) = &self.map.brake else { return };
        for name in brake.model.iter().chain(&brake.serial).chain(&brake.firmware) {
            self.known(&["brake"], name);
        }
        if brake.model.is_none() && !self.map.models.is_empty() {
            self.fault(&["brake"], "has models but no register 'model' to tell them by");
        }
        self.unit(&["brake", "current_set"], &brake.current_set, "A");
        self.unit(&["brake", "status", "current"], &brake.status.current, "A");
        self.unit(&["brake", "status", "temperature"], &brake.status.temperature, "degC");
        self.steps(&["brake", "prepare"], &brake.prepare);
        self.steps(&["brake", "release"], &brake.release);
        self.test(&["brake", "status", "tripped"], &brake.status.tripped);
        self.test(&["brake", "status", "enabled"], &brake.status.enabled);
    }
}
