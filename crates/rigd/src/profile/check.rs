//! Every fault of a profile at once, each with its line.
//!
//! The reader stops at the first fault; here each found fault is mended with the built-in profile's value and the rest is read on.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::de::DeTable;
use toml::{Table, Value};

use super::devices::{BrakeProfile, CounterProfile, ServoProfile};
use super::lines::{Fault, Lines};
use super::{Limits, LogPolicy, Profile, ProfileError, Sequence};
use crate::calibration::Calibration;
use crate::device::drivers::{BRAKES, COUNTERS, SERVOS, find};
use crate::device::map::{Map, MapError};
use crate::device::{DeviceKind, map, refused};
use crate::link;

/// Rounds after which a file is taken to be something else altogether.
const ROUNDS: usize = 200;

impl Profile {
    /// Reads and checks a profile and what it names.
    ///
    /// # Errors
    /// [`ProfileError`] names the file and every fault in it with line, key, value and what is accepted.
    pub fn load(path: &Path) -> Result<Self, ProfileError> {
        let text = std::fs::read_to_string(path).map_err(|source| ProfileError::Read { path: path.into(), source })?;
        let faults = faults(&text, path);
        if !faults.is_empty() {
            return Err(ProfileError::Faults { path: path.into(), faults });
        }
        let mut profile = Self::parse(&text, path)?;
        if let Some(calibration) = profile.calibration.clone() {
            profile.calibrate(&path.parent().unwrap_or(Path::new("")).join(calibration))?;
        }
        Ok(profile)
    }
}

/// Every fault of a profile's text; `path` tells where files that it names are looked for.
#[must_use]
pub fn faults(text: &str, path: &Path) -> Vec<Fault> {
    let (_, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        return errors.iter().map(|error| Fault::of(text, error)).collect();
    }
    let mut check = Check { lines: Lines::of(text), faults: Vec::new() };
    let mut table: Table = match toml::from_str(text) {
        Ok(table) => table,
        Err(error) => return vec![Fault::of(text, &error)],
    };
    let template = template();
    check.shape(&mut table, &template);
    check.values(table, &template, path);
    let mut faults = check.faults;
    faults.sort_by(|a, b| (a.line, &a.key).cmp(&(b.line, &b.key)));
    faults
}

/// The built-in profile: what is right where a file is wrong.
fn template() -> Table {
    section_of(&Profile::simulated())
}

fn section_of(value: &impl Serialize) -> Table {
    Table::try_from(value).unwrap_or_default()
}

struct Check {
    lines: Lines,
    faults: Vec<Fault>,
}

impl Check {
    /// Unknown, missing and mistyped keys, section by section, mended as they are found.
    fn shape(&mut self, table: &mut Table, template: &Table) {
        self.section::<ServoProfile>("servo", table, template);
        self.section::<BrakeProfile>("brake", table, template);
        self.section::<CounterProfile>("counter", table, template);
        self.section::<Limits>("limits", table, template);
        self.section::<Sequence>("sequence", table, template);
        self.section::<LogPolicy>("log", table, template);
        self.mend::<Profile>("", table, template);
    }

    fn section<T: DeserializeOwned>(&mut self, name: &str, table: &mut Table, template: &Table) {
        if let (Some(Value::Table(section)), Some(Value::Table(good))) = (table.get_mut(name), template.get(name)) {
            self.mend::<T>(name, section, good);
        }
    }

    /// Reads a section until it reads, and mends what it stumbles over.
    fn mend<T: DeserializeOwned>(&mut self, section: &str, table: &mut Table, good: &Table) {
        for _ in 0..ROUNDS {
            let Err(error) = T::deserialize(Value::Table(table.clone())) else { return };
            let message = error.message().to_owned();
            let quoted =
                |lead: &str| message.strip_prefix(lead).and_then(|rest| rest.split('`').next()).map(ToOwned::to_owned);
            if let Some(key) = quoted("unknown field `") {
                let known: Vec<&str> = good.keys().map(String::as_str).collect();
                self.fault(section, &key, &format!("is no key here; there are {}", known.join(", ")));
                table.remove(&key);
            } else if let Some(key) = quoted("missing field `") {
                self.fault(section, &key, &format!("is missing; for instance {}", shown(good.get(&key))));
                let Some(value) = good.get(&key) else { return };
                table.insert(key, value.clone());
            } else if let Some(key) = culprit::<T>(table, good) {
                self.fault(section, &key, &format!("= {}: {message}", shown(table.get(&key))));
                match good.get(&key) {
                    Some(value) => table.insert(key, value.clone()),
                    None => table.remove(&key),
                };
            } else {
                self.fault(section, "", &message);
                return;
            }
        }
    }

    fn fault(&mut self, section: &str, key: &str, what: &str) {
        let path: Vec<&str> = [section, key].into_iter().filter(|part| !part.is_empty()).collect();
        self.faults.push(self.lines.fault(&path, what));
    }

    /// Values out of range, drivers and maps that there are not, ports that do not go together.
    fn values(&mut self, mut table: Table, template: &Table, path: &Path) {
        for _ in 0..ROUNDS {
            let Ok(profile) = Profile::deserialize_table(&table) else { return };
            match profile.check(path) {
                Err(ProfileError::Value { key, value, expected, .. }) => {
                    self.fault("", key, &format!("= {value} must be {expected}"));
                    if !copy(key, template, &mut table) {
                        return;
                    }
                }
                Err(other) => {
                    self.fault("", "", &other.to_string());
                    return;
                }
                Ok(()) => {
                    self.devices(&profile);
                    self.calibration(&profile, path);
                    return;
                }
            }
        }
    }

    fn devices(&mut self, profile: &Profile) {
        let (servo, brake, counter) = (&profile.servo, &profile.brake, &profile.counter);
        let unknown = [
            ("servo", find(SERVOS, DeviceKind::Servo, &servo.driver).err()),
            ("brake", find(BRAKES, DeviceKind::Brake, &brake.driver).err()),
            ("counter", find(COUNTERS, DeviceKind::Counter, &counter.driver).err()),
        ];
        for (section, error) in unknown {
            if let Some(error) = error {
                let name = if section == "counter" { refused::reason(&counter.driver) } else { None };
                self.fault(section, "driver", &name.unwrap_or_else(|| format!("is unknown: {error}")));
            }
        }
        for (section, driver, map) in [("servo", &servo.driver, &servo.map), ("brake", &brake.driver, &brake.map)] {
            match (driver.as_str(), map) {
                (map::DRIVER, None) => {
                    self.fault(section, "map", "is missing: driver \"map\" needs map = \"FILE.toml\"");
                }
                (map::DRIVER, Some(file)) => self.map(section, file),
                (_, Some(file)) => {
                    self.fault(
                        section,
                        "map",
                        &format!("= {} goes with driver = \"{}\" only", file.display(), map::DRIVER),
                    );
                }
                (_, None) => {}
            }
        }
        let lines = [
            ("servo", &servo.port, servo.baud, &servo.format),
            ("brake", &brake.port, brake.baud, &brake.format),
            ("counter", &counter.port, counter.baud, &counter.format),
        ];
        for (n, (section, port, baud, format)) in lines.iter().enumerate() {
            if let Err(error) = link::check_format(format) {
                self.fault(section, "format", &format!("= {format:?}: line: {error}"));
            }
            if !(300..=12_000_000).contains(baud) {
                self.fault(section, "baud", &format!("= {baud} must be from 300 to 12000000 bit/s"));
            }
            let shared = lines[..n].iter().find(|(_, other, ..)| other == port && port.as_str() != "sim");
            if let Some((other, ..)) = shared {
                self.fault(section, "port", &format!("= {port:?} is also the {other}'s: give each device a line of its own (their speeds and silences differ, and one that hangs must not silence the other)"));
            }
        }
        for (key, what) in super::qsb::faults(counter, &[&servo.port, &brake.port, &counter.port]) {
            self.fault("counter", key, &what);
        }
        for (section, unit) in [("servo", servo.unit), ("brake", brake.unit)] {
            if !(1..=247).contains(&unit) {
                self.fault(
                    section,
                    "unit",
                    &format!("= {unit} must be from 1 to 247 (0 is a broadcast, which nobody answers)"),
                );
            }
        }
        let last = brake.rising.last().map_or(0.0, |point| point[0]);
        if brake.current_limit_a > last {
            self.fault(
                "brake",
                "current_limit_a",
                &format!("= {} is beyond the last point of brake.rising, {last} A", brake.current_limit_a),
            );
        }
    }

    /// The calibration is looked for beside the profile, as a run does.
    fn calibration(&mut self, profile: &Profile, path: &Path) {
        let Some(file) = &profile.calibration else { return };
        if let Err(error) = Calibration::load(&path.parent().unwrap_or(Path::new("")).join(file)) {
            self.fault("", "calibration", &error.to_string());
        }
    }

    fn map(&mut self, section: &str, file: &Path) {
        match Map::load(file) {
            Ok(_) => {}
            Err(MapError::Faults { path, faults }) => {
                for fault in faults {
                    self.fault(section, "map", &format!("{}: {fault}", path.display()));
                }
            }
            Err(error) => self.fault(section, "map", &error.to_string()),
        }
    }
}

/// The key whose value keeps a section from being read.
fn culprit<T: DeserializeOwned>(table: &Table, good: &Table) -> Option<String> {
    let before = T::deserialize(Value::Table(table.clone())).err()?.message().to_owned();
    table
        .keys()
        .find(|key| {
            let mut tried = table.clone();
            match good.get(*key) {
                Some(value) => tried.insert((*key).clone(), value.clone()),
                None => tried.remove(*key),
            };
            T::deserialize(Value::Table(tried)).err().is_none_or(|error| error.message() != before)
        })
        .cloned()
}

/// Copies a key `section.name` from one table to another.
fn copy(key: &str, from: &Table, to: &mut Table) -> bool {
    let Some((section, name)) = key.split_once('.') else { return false };
    let value = from.get(section).and_then(|section| section.get(name)).cloned();
    match (value, to.get_mut(section)) {
        (Some(value), Some(Value::Table(section))) => section.insert(name.to_owned(), value).is_some(),
        _ => false,
    }
}

fn shown(value: Option<&Value>) -> String {
    let text = value.map(ToString::to_string).unwrap_or_default();
    if text.len() > 60 { "(see the built-in profile)".into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::super::SIM_PROFILE;
    use super::super::qsb::QSB_PROFILE;
    use super::*;

    fn of(text: &str) -> Vec<Fault> {
        faults(text, Path::new("lab.toml"))
    }

    #[test]
    fn the_built_in_profile_has_none() {
        assert_eq!(of(SIM_PROFILE), []);
    }

    #[test]
    fn all_are_told_at_once_each_with_its_line() {
        let wrong = SIM_PROFILE
            .replace("lease_s = 1.0", "leese_s = 1.0")
            .replace("baud = 38400", "baud = \"fast\"")
            .replace("chunk_ms = 100", "chunk_ms = 5000")
            .replace("speed_rpm = 60.0", "speed_rpm = -3.0")
            .replace("driver = \"rd60xx\"", "driver = \"rd70\"")
            .replace("format = \"8N2\"", "format = \"9N2\"")
            .replace("load_nm = 20.0 ", "");
        let found = of(&wrong);
        let said: Vec<String> = found.iter().map(ToString::to_string).collect();
        for (key, part) in [
            ("sequence.leese_s", "is no key"),
            ("sequence.lease_s", "missing"),
            ("servo.baud", "fast"),
            ("log.chunk_ms", "5000"),
            ("limits.speed_rpm", "-3"),
            ("brake.driver", "rd70"),
            ("servo.format", "9N2"),
        ] {
            let fault = found.iter().find(|fault| fault.key == key && fault.what.contains(part));
            let fault = fault.unwrap_or_else(|| panic!("{key} {part}: {said:#?}"));
            let at = wrong.lines().nth(fault.line - 1).unwrap_or_default();
            let name = key.rsplit('.').next().unwrap_or_default();
            assert!(at.contains(name) || at.starts_with('['), "{key}: line {} is {at:?}", fault.line);
        }
    }

    #[test]
    fn broken_syntax_is_told_with_its_line() {
        let found = of("name = \"x\nservo = 3\n");
        assert!(!found.is_empty() && found[0].line == 1, "{found:?}");
    }

    #[test]
    fn encoders_that_cannot_serve_are_refused_with_the_reason() {
        let found = of(&SIM_PROFILE.replace("counter-box", "briter-rs485"));
        assert!(found.iter().any(|fault| fault.key == "counter.driver" && fault.what.contains("µrad")), "{found:?}");
    }

    #[test]
    fn a_calibration_that_is_not_there_is_told() {
        let found = of(&format!("calibration = \"no-such.toml\"\n{SIM_PROFILE}"));
        assert!(found.len() == 1 && found[0].key == "calibration" && found[0].line == 1, "{found:?}");
        assert!(found[0].what.contains("no-such.toml") && found[0].what.contains("rigd calibrate"), "{found:?}");
    }

    #[test]
    fn two_devices_do_not_share_a_line() {
        let text = SIM_PROFILE.replacen("port = \"sim\" ", "port = \"/dev/ttyUSB0\" ", 1);
        let text =
            text.replacen("driver = \"rd60xx\"\nport = \"sim\"", "driver = \"rd60xx\"\nport = \"/dev/ttyUSB0\"", 1);
        let found = of(&text);
        assert!(found.iter().any(|fault| fault.key == "brake.port" && fault.what.contains("servo")), "{found:?}");
    }

    #[test]
    fn the_profile_of_two_readers_has_no_fault_and_states_its_source() {
        assert_eq!(faults(QSB_PROFILE, Path::new("qsb.toml")), []);
        let profile = Profile::parse(QSB_PROFILE, Path::new("qsb.toml")).expect("a profile");
        assert!(profile.source.contains("QSB command list"), "{}", profile.source);
        let qsb = profile.counter.qsb.as_ref().expect("readers");
        assert_eq!((qsb.counts_per_rev(), qsb.rate_hz()), ([40_000; 2], 512.0));
        assert_eq!(Profile::parse(&profile.to_toml(), Path::new("x")).expect("own TOML"), profile);
    }

    #[test]
    fn every_wrong_value_of_two_readers_is_told_with_its_key() {
        let output = "output_port = \"/dev/serial/by-id/usb-qsb-output\"";
        for (from, to, key) in [
            ("quadrature = 4", "quadrature = 3", "counter.qsb.quadrature"),
            ("interval_ticks = 1", "interval_ticks = 0", "counter.qsb.interval_ticks"),
            ("lines = [10000, 10000]", "lines = [10000, 0]", "counter.qsb.lines"),
            ("transit_difference_ms = 1.0", "transit_difference_ms = -1.0", "counter.qsb.transit_difference_ms"),
            ("# zero_counts = [0, 0]", "zero_counts = [0, 9000000000]", "counter.qsb.zero_counts"),
            (output, "output_port = \"/dev/serial/by-id/usb-qsb-input\"", "counter.qsb.output_port"),
            (output, "output_port = \"sim\"", "counter.qsb.output_port"),
            ("driver = \"qsb\"", "driver = \"counter-box\"", "counter.qsb"),
        ] {
            let text = QSB_PROFILE.replacen(from, to, 1);
            assert_ne!(text, QSB_PROFILE, "{from}");
            let found = faults(&text, Path::new("qsb.toml"));
            assert!(found.len() == 1 && found[0].key == key && found[0].line > 1, "{to}: {found:?}");
        }
    }
}
