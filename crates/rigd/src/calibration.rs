//! The calibration of a rig as a file: what was found, when, how, and how well. `rigd calibrate` writes it, a profile names it, every log
//! carries it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Name of the attachment in logs.
pub const ATTACHMENT: &str = "calibration.toml";
/// Schema of the file.
const SCHEMA: &str = "rig.calibration/1";

/// A rig's calibration; each part has its own date.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Schema and its version.
    pub schema: String,
    /// The brake.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brake: Option<BrakeCalibration>,
    /// The input encoder's disc.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub encoder_input: Option<EncoderCalibration>,
    /// The output encoder's disc.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub encoder_output: Option<EncoderCalibration>,
    /// The zeros of both angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zero: Option<ZeroCalibration>,
}

/// The brake's torque over its current.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrakeCalibration {
    /// When, RFC 3339.
    pub date: String,
    /// On which rig.
    pub rig: String,
    /// How.
    pub method: String,
    /// Coverage factor of the uncertainties.
    pub coverage_factor: f64,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Temperature that the brake's driver showed at the end, °C.
    pub temperature_c: f64,
    /// While the current rises from 0: [A, N·m at the brake's shaft, ± N·m].
    pub rising: Vec<[f64; 3]>,
    /// While it falls from the largest current.
    pub falling: Vec<[f64; 3]>,
}

/// Errors of one encoder's disc.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EncoderCalibration {
    /// When, RFC 3339.
    pub date: String,
    /// On which rig.
    pub rig: String,
    /// How.
    pub method: String,
    /// Coverage factor of the uncertainties.
    pub coverage_factor: f64,
    /// The disc reads θ + Σ eps sin(order · θ − phase): [order, eps rad, phase rad, ± rad].
    pub orders: Vec<[f64; 4]>,
    /// Orders that the mountings do not tell.
    pub untold_orders: Vec<u32>,
    /// What is left between the mountings, RMS, rad.
    pub residual_rms_rad: f64,
    /// The logs.
    pub logs: Vec<String>,
}

/// The zeros of both angles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZeroCalibration {
    /// When, RFC 3339.
    pub date: String,
    /// On which rig.
    pub rig: String,
    /// How.
    pub method: String,
    /// Coverage factor of the uncertainties.
    pub coverage_factor: f64,
    /// θ1 as read at the gears' zero, rad.
    pub input_rad: f64,
    /// Its uncertainty, rad.
    pub input_uncertainty_rad: f64,
    /// θ2 as read at the gears' zero, rad.
    pub output_rad: f64,
    /// Its uncertainty, rad.
    pub output_uncertainty_rad: f64,
    /// What is left of TE, RMS, rad.
    pub residual_rms_rad: f64,
    /// Input counts at the index, output counts at the index, of each log, less whole turns.
    pub index_counts: Vec<[i64; 2]>,
    /// The logs.
    pub logs: Vec<String>,
}

/// Why a calibration is refused.
#[derive(Debug, Error)]
pub enum CalibrationFileError {
    /// The file cannot be read or written.
    #[error("calibration {}: {source}; `rigd calibrate` writes one", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The text is no calibration.
    #[error("calibration {}: {source}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, key and reason.
        source: Box<toml::de::Error>,
    },
    /// A value cannot be.
    #[error("calibration {}: {key} = {value} must be {expected}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// The key.
        key: &'static str,
        /// What was found.
        value: String,
        /// What is accepted.
        expected: &'static str,
    },
}

impl Default for Calibration {
    fn default() -> Self {
        Self { schema: SCHEMA.into(), brake: None, encoder_input: None, encoder_output: None, zero: None }
    }
}

impl Calibration {
    /// Reads and checks a calibration; its text is for the log.
    ///
    /// # Errors
    /// [`CalibrationFileError`] names file, key, value and what is accepted.
    pub fn load(path: &Path) -> Result<(Self, String), CalibrationFileError> {
        let file = |source| CalibrationFileError::File { path: path.into(), source };
        let text = std::fs::read_to_string(path).map_err(file)?;
        Ok((Self::parse(&text, path)?, text))
    }

    /// Checks a calibration's text; `path` is for the error.
    ///
    /// # Errors
    /// As [`Calibration::load`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, CalibrationFileError> {
        let calibration: Self = toml::from_str(text)
            .map_err(|source| CalibrationFileError::Parse { path: path.into(), source: Box::new(source) })?;
        calibration.check(path)?;
        Ok(calibration)
    }

    fn check(&self, path: &Path) -> Result<(), CalibrationFileError> {
        let refuse =
            |key, value: String, expected| Err(CalibrationFileError::Value { path: path.into(), key, value, expected });
        if self.schema != SCHEMA {
            return refuse("schema", self.schema.clone(), "rig.calibration/1");
        }
        let Some(brake) = &self.brake else { return Ok(()) };
        for (key, branch) in [("brake.rising", &brake.rising), ("brake.falling", &brake.falling)] {
            let sound = branch.iter().flatten().all(|value| value.is_finite() && *value >= 0.0);
            let rises = branch.windows(2).all(|pair| pair[1][0] > pair[0][0] && pair[1][1] > pair[0][1]);
            if branch.len() < 2 || !sound || !rises {
                let expected = "two points or more of finite numbers >= 0, current and torque both increasing";
                return refuse(key, format!("{branch:?}"), expected);
            }
        }
        Ok(())
    }

    /// The calibration at `path`, or an empty one where there is no file yet.
    ///
    /// # Errors
    /// As [`Calibration::load`].
    pub fn load_or_new(path: &Path) -> Result<Self, CalibrationFileError> {
        match Self::load(path) {
            Err(CalibrationFileError::File { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
                Ok(Self::default())
            }
            loaded => loaded.map(|(calibration, _)| calibration),
        }
    }

    /// Writes the file, at once or not at all.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn save(&self, path: &Path) -> Result<(), CalibrationFileError> {
        let file = |source| CalibrationFileError::File { path: path.into(), source };
        let beside = path.with_extension("toml.new");
        std::fs::write(&beside, toml::to_string(self).unwrap_or_default()).map_err(file)?;
        std::fs::rename(&beside, path).map_err(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn calibration() -> Calibration {
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
        Calibration { brake: Some(brake), ..Calibration::default() }
    }

    #[test]
    fn a_calibration_comes_back() {
        let directory = tempfile::TempDir::new().unwrap();
        let path = directory.path().join("calibration.toml");
        assert_eq!(Calibration::load_or_new(&path).unwrap(), Calibration::default());
        calibration().save(&path).unwrap();
        let (again, text) = Calibration::load(&path).unwrap();
        assert_eq!(again, calibration());
        assert!(text.contains("2026-11-22"));
    }

    #[test]
    fn a_curve_that_falls_is_refused_by_key() {
        let mut wrong = calibration();
        wrong.brake.as_mut().unwrap().falling[1][1] = 0.1;
        let said = Calibration::parse(&toml::to_string(&wrong).unwrap(), Path::new("c.toml")).unwrap_err().to_string();
        assert!(said.contains("c.toml") && said.contains("brake.falling"), "{said}");
        let said = Calibration::parse("schema = \"x\"", Path::new("c.toml")).unwrap_err().to_string();
        assert!(said.contains("rig.calibration/1"), "{said}");
    }
}
