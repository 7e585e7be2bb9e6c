//! The rig's profile: which devices, on which ports, within which limits. TOML, checked before anything moves.

pub mod check;
pub mod devices;
pub mod lines;
pub mod qsb;

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::calibration::{Calibration, CalibrationFileError};
pub use devices::{BrakeProfile, CounterProfile, QsbProfile, ServoProfile};
use lines::Fault;

/// The embedded profile: emulated hardware in this process.
pub const SIM_PROFILE: &str = include_str!("sim.toml");

/// Slower than this nothing is turned, rpm of the driver: a revolution would take hours.
pub const SLOWEST_RPM: f64 = 0.01;

/// A rig's profile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// The profile's name, stated in every log as its backend.
    pub name: String,
    /// Where the registers and limits were taken from.
    #[serde(default)]
    pub source: String,
    /// The rig's calibration, beside the profile; `rigd calibrate` writes it. Its brake curve replaces the one below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<PathBuf>,
    /// The calibration's text as it was read, for the log.
    #[serde(skip)]
    pub calibration_toml: Option<String>,
    /// The servo drive.
    pub servo: ServoProfile,
    /// The powder brake and its current source.
    pub brake: BrakeProfile,
    /// The box that counts both encoders.
    pub counter: CounterProfile,
    /// What is refused before motion and supervised during it.
    pub limits: Limits,
    /// How a run goes.
    pub sequence: Sequence,
    /// How the log is kept.
    pub log: LogPolicy,
}

/// Limits, refused before motion and supervised during it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Largest speed of the driver gear, rpm.
    pub speed_rpm: f64,
    /// Largest load at the driven gear, N·m.
    pub load_nm: f64,
    /// Largest slip power of the brake, W.
    pub slip_power_w: f64,
    /// Largest temperature of the brake's driver or brake, °C.
    pub brake_temperature_c: f64,
    /// Largest departure of TE from the model, mrad; beyond it the teeth are taken to have crashed.
    pub te_excursion_mrad: f64,
    /// Longest silence of the encoders, ms.
    pub encoder_silence_ms: f64,
}

/// How a run goes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sequence {
    /// Speed while looking for the index, rpm of the driver.
    pub home_rpm: f64,
    /// Time at speed and load before recording, s.
    pub settle_s: f64,
    /// Turns of the driver at speed and load before recording.
    pub settle_turns: f64,
    /// Time until the brake's torque has arrived, s.
    pub load_s: f64,
    /// A motion command is valid for this long, s.
    pub lease_s: f64,
    /// Period of the drives' polling, ms.
    pub poll_ms: f64,
}

/// How the log is kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogPolicy {
    /// A chunk is closed after this time, ms.
    pub chunk_ms: u32,
    /// The file is synced to disk after this time, ms.
    pub sync_ms: u32,
    /// The log goes on in a new file at this size, MB; 0 is never.
    #[serde(default)]
    pub rotate_mb: f64,
    /// The log goes on in a new file after this time, minutes; 0 is never.
    #[serde(default)]
    pub rotate_minutes: f64,
    /// Under this much free space the run warns, MB.
    #[serde(default = "warn_free_mb")]
    pub warn_free_mb: f64,
    /// Under this much free space no run begins, and one under way stops in order, MB.
    #[serde(default = "stop_free_mb")]
    pub stop_free_mb: f64,
}

/// Ten hours at 18 kHz, and some.
fn warn_free_mb() -> f64 {
    2000.0
}

/// Far more than what is queued and the end of a log need.
fn stop_free_mb() -> f64 {
    100.0
}

impl LogPolicy {
    /// When the log goes on in a new file.
    #[must_use]
    pub fn rotation(&self) -> riglog::Rotation {
        const BYTES_PER_MB: f64 = 1e6;
        riglog::Rotation {
            bytes: (self.rotate_mb > 0.0).then_some((self.rotate_mb * BYTES_PER_MB) as u64),
            period: (self.rotate_minutes > 0.0).then(|| Duration::from_secs_f64(self.rotate_minutes * 60.0)),
        }
    }
}

/// Why a profile is refused.
#[derive(Debug, Error)]
pub enum ProfileError {
    /// The file could not be read.
    #[error("profile {path}: {source}; `rigd sim --pty-dir DIR` writes an example to start from")]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The file is not a profile.
    #[error("profile {path}: {source}")]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, key and reason.
        source: Box<toml::de::Error>,
    },
    /// All that is wrong with it, as `rigd profile check` tells it.
    #[error("profile {path}: {}", listed(.faults))]
    Faults {
        /// The file.
        path: PathBuf,
        /// Each with its line.
        faults: Vec<Fault>,
    },
    /// Its calibration.
    #[error(transparent)]
    Calibration(#[from] CalibrationFileError),
    /// A value is outside its range.
    #[error("profile {path}: {key} = {value} must be {expected}")]
    Value {
        /// The file.
        path: PathBuf,
        /// Key with its section.
        key: &'static str,
        /// What was found.
        value: String,
        /// What is accepted.
        expected: String,
    },
}

fn listed(faults: &[Fault]) -> String {
    let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
    lines.join("\n  ")
}

impl Profile {
    /// The embedded profile of the simulated rig.
    ///
    /// # Panics
    /// Never: a test parses the embedded text.
    #[must_use]
    pub fn simulated() -> Self {
        #[expect(clippy::expect_used, reason = "the embedded text is parsed by a test")]
        Self::parse(SIM_PROFILE, Path::new("(embedded)")).expect("the embedded profile is valid")
    }

    /// Takes over the calibration at `path`.
    ///
    /// # Errors
    /// [`ProfileError::Calibration`] names the file and what is wrong with it.
    pub fn calibrate(&mut self, path: &Path) -> Result<(), ProfileError> {
        let (calibration, text) = Calibration::load(path)?;
        self.apply(&calibration);
        self.calibration_toml = Some(text);
        Ok(())
    }

    /// Puts what a run needs of a calibration into the profile.
    pub fn apply(&mut self, calibration: &Calibration) {
        if let Some(brake) = &calibration.brake {
            let points = |branch: &[[f64; 3]]| branch.iter().map(|point| [point[0], point[1]]).collect();
            self.brake.rising = points(&brake.rising);
            self.brake.falling = points(&brake.falling);
        }
    }

    /// Checks a profile's text; `path` is for the error.
    ///
    /// # Errors
    /// As [`Profile::load`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, ProfileError> {
        let profile: Self = toml::from_str(text)
            .map_err(|source| ProfileError::Parse { path: path.into(), source: Box::new(source) })?;
        profile.check(path)?;
        Ok(profile)
    }

    fn check(&self, path: &Path) -> Result<(), ProfileError> {
        let refuse = |key: &'static str, value: String, expected: String| {
            Err(ProfileError::Value { path: path.into(), key, value, expected })
        };
        // Wide enough for any rig, and narrow enough that no time computed from them is longer than a clock can hold.
        for (key, value, least, most) in [
            ("servo.reduction", self.servo.reduction, 1e-3, 1e5),
            ("servo.accel_ms", self.servo.accel_ms, 1e-3, 1e6),
            ("servo.decel_ms", self.servo.decel_ms, 1e-3, 1e6),
            ("brake.voltage_v", self.brake.voltage_v, 1e-3, 1e4),
            ("brake.current_limit_a", self.brake.current_limit_a, 1e-6, 1e3),
            ("brake.step_up", self.brake.step_up, 1e-3, 1e4),
            ("limits.speed_rpm", self.limits.speed_rpm, SLOWEST_RPM, 1e5),
            ("limits.load_nm", self.limits.load_nm, 1e-6, 1e6),
            ("limits.slip_power_w", self.limits.slip_power_w, 1e-6, 1e6),
            ("limits.brake_temperature_c", self.limits.brake_temperature_c, 1.0, 1e3),
            ("limits.te_excursion_mrad", self.limits.te_excursion_mrad, 1e-6, 1e4),
            ("limits.encoder_silence_ms", self.limits.encoder_silence_ms, 1.0, 6e4),
            ("sequence.home_rpm", self.sequence.home_rpm, SLOWEST_RPM, 1e5),
            ("sequence.settle_s", self.sequence.settle_s, 1e-3, 3600.0),
            ("sequence.settle_turns", self.sequence.settle_turns, 1e-3, 1e3),
            ("sequence.load_s", self.sequence.load_s, 1e-3, 3600.0),
            ("sequence.poll_ms", self.sequence.poll_ms, 1.0, 5e3),
        ] {
            if !(least..=most).contains(&value) {
                return refuse(key, value.to_string(), format!("from {least} to {most}"));
            }
        }
        let lease = self.sequence.lease_s;
        let shortest = 2.0 * self.sequence.poll_ms / 1e3;
        if !(lease >= shortest && lease <= 10.0) {
            return refuse("sequence.lease_s", lease.to_string(), format!("from {shortest} (two polls) to 10 s"));
        }
        if self.sequence.home_rpm > self.limits.speed_rpm {
            return refuse(
                "sequence.home_rpm",
                self.sequence.home_rpm.to_string(),
                format!("at most limits.speed_rpm = {}", self.limits.speed_rpm),
            );
        }
        if !(1..=100).contains(&self.log.chunk_ms) {
            return refuse("log.chunk_ms", self.log.chunk_ms.to_string(), "from 1 to 100 ms".into());
        }
        if !(10..=1000).contains(&self.log.sync_ms) {
            return refuse("log.sync_ms", self.log.sync_ms.to_string(), "from 10 to 1000 ms".into());
        }
        for (keys, late_ms, repeated_ms) in [
            (["servo.late_ms", "servo.repeated_ms"], self.servo.late_ms, self.servo.repeated_ms),
            (["brake.late_ms", "brake.repeated_ms"], self.brake.late_ms, self.brake.repeated_ms),
        ] {
            if !(10.0..=5000.0).contains(&late_ms) {
                return refuse(keys[0], late_ms.to_string(), "from 10 to 5000 ms".into());
            }
            if !(0.0..=late_ms).contains(&repeated_ms) {
                return refuse(keys[1], repeated_ms.to_string(), format!("from 0 to late_ms = {late_ms}"));
            }
        }
        for (key, value) in [
            ("counter.input_mounted_deg", self.counter.input_mounted_deg),
            ("counter.output_mounted_deg", self.counter.output_mounted_deg),
        ] {
            if !(-360.0..=360.0).contains(&value) {
                return refuse(key, value.to_string(), "from -360 to 360".into());
            }
        }
        // A million minutes are two years; a part under 10 kB would be mostly head.
        for (key, value, least, most) in [
            ("log.rotate_mb", self.log.rotate_mb, 0.01, 1e6),
            ("log.rotate_minutes", self.log.rotate_minutes, 0.01, 1e6),
            ("log.warn_free_mb", self.log.warn_free_mb, 0.0, 1e9),
            ("log.stop_free_mb", self.log.stop_free_mb, 0.0, 1e9),
        ] {
            if value != 0.0 && !(least..=most).contains(&value) {
                return refuse(key, value.to_string(), format!("0, or from {least} to {most}"));
            }
        }
        for (key, sign) in [
            ("servo.sense", self.servo.sense),
            ("counter.input_sign", self.counter.input_sign),
            ("counter.output_sign", self.counter.output_sign),
        ] {
            if sign.abs() != 1 {
                return refuse(key, sign.to_string(), "1 or -1".into());
            }
        }
        for (key, branch) in [("brake.rising", &self.brake.rising), ("brake.falling", &self.brake.falling)] {
            let finite = branch.iter().flatten().all(|value| value.is_finite() && *value >= 0.0);
            let increasing = branch.windows(2).all(|pair| pair[1][0] > pair[0][0] && pair[1][1] > pair[0][1]);
            if branch.len() < 2 || !finite || !increasing {
                return refuse(
                    key,
                    format!("{branch:?}"),
                    "two points or more, current and torque both increasing from >= 0".into(),
                );
            }
        }
        Ok(())
    }

    /// From a table that was read already.
    fn deserialize_table(table: &toml::Table) -> Result<Self, toml::de::Error> {
        Self::deserialize(toml::Value::Table(table.clone()))
    }

    /// Period of the drives' polling.
    #[must_use]
    pub fn poll_period(&self) -> Duration {
        Duration::from_secs_f64(self.sequence.poll_ms / 1e3)
    }

    /// Whether all devices are emulated within this process.
    #[must_use]
    pub fn in_process(&self) -> bool {
        [&self.servo.port, &self.brake.port, &self.counter.port].iter().all(|port| port.as_str() == "sim")
    }

    /// The profile as TOML.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::BrakeCalibration;

    #[test]
    fn embedded_profile_is_valid_and_round_trips() {
        let profile = Profile::simulated();
        assert!(profile.in_process());
        let again = Profile::parse(&profile.to_toml(), Path::new("x")).expect("own TOML");
        assert_eq!(profile, again);
    }

    #[test]
    fn a_calibration_changes_the_brake() {
        let brake = BrakeCalibration {
            date: "2026-11-22T06:00:00Z".into(),
            rig: "lab".into(),
            method: "servo torque".into(),
            coverage_factor: 2.0,
            speed_rpm: 25.0,
            temperature_c: 31.0,
            rising: vec![[0.0, 0.3, 0.05], [0.5, 10.0, 0.1]],
            falling: vec![[0.0, 0.3, 0.05], [0.5, 11.0, 0.1]],
        };
        let mut profile = Profile::simulated();
        profile.apply(&Calibration { brake: Some(brake), ..Calibration::default() });
        assert_eq!(profile.brake.rising, [[0.0, 0.3], [0.5, 10.0]]);
        let near = |current: Option<f64>| (current.unwrap() - 0.25).abs() < 1e-12;
        assert!(near(profile.brake.current_a(5.15)));
        // Down from more current the torque lies on the other branch.
        assert!(near(profile.brake.current_from_a(5.65, 0.4)));
        assert!(near(profile.brake.current_from_a(5.15, 0.1)));
    }

    #[test]
    fn refusals_name_key_value_and_limit() {
        let wrong = SIM_PROFILE.replace("chunk_ms = 100", "chunk_ms = 5000");
        let said = Profile::parse(&wrong, Path::new("lab.toml")).expect_err("too long").to_string();
        assert!(
            said.contains("lab.toml")
                && said.contains("log.chunk_ms")
                && said.contains("5000")
                && said.contains("100 ms"),
            "{said}"
        );
        let unknown = SIM_PROFILE.replace("lease_s", "leese_s");
        let said = Profile::parse(&unknown, Path::new("lab.toml")).expect_err("unknown key").to_string();
        assert!(said.contains("leese_s"), "{said}");
    }
}
