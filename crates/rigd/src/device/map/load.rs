//! Where maps come from: built in, or a file, checked as a whole.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{BrakeRules, DRIVER, Map, ServoRules, check};
use crate::profile::lines::Fault;
use crate::profile::{BrakeProfile, ServoProfile};

/// Maps that come with the program.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("asda-b2", include_str!("asda-b2.toml")),
    ("dsy-rs", include_str!("dsy-rs.toml")),
    ("rd60xx", include_str!("rd60xx.toml")),
];

/// Why a map is refused.
#[derive(Debug, Error)]
pub enum MapError {
    /// The file could not be read.
    #[error("register map {path}: {source}; name a file that you may read, or one of the built-in maps")]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// It is not a map.
    #[error("register map {path} has {} faults: {}", faults.len(), list(faults))]
    Faults {
        /// The file.
        path: PathBuf,
        /// All of them.
        faults: Vec<Fault>,
    },
}

fn list(faults: &[Fault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

impl Map {
    /// A built-in map.
    #[must_use]
    pub fn built_in(name: &str) -> Option<Self> {
        let (_, text) = BUILT_IN.iter().find(|(known, _)| *known == name)?;
        Self::parse(text).ok()
    }

    /// Reads and checks a map.
    ///
    /// # Errors
    /// [`MapError`] with every fault and its line.
    pub fn load(path: &Path) -> Result<Self, MapError> {
        let text = std::fs::read_to_string(path).map_err(|source| MapError::Read { path: path.into(), source })?;
        Self::parse(&text).map_err(|faults| MapError::Faults { path: path.into(), faults })
    }

    /// Checks a map's text.
    ///
    /// # Errors
    /// Every fault, with its line.
    pub fn parse(text: &str) -> Result<Self, Vec<Fault>> {
        let map: Self = toml::from_str(text).map_err(|error| vec![Fault::of(text, &error)])?;
        let faults = check::check(&map, text);
        if faults.is_empty() { Ok(map) } else { Err(faults) }
    }

    /// The map that a driver's name, or a profile's file, stands for.
    ///
    /// # Errors
    /// What is wrong with it, or that there is none.
    pub fn named(driver: &str, file: Option<&Path>) -> Result<Self, String> {
        match file {
            Some(path) if driver == DRIVER => Self::load(path).map_err(|error| error.to_string()),
            Some(path) => Err(format!("map = {} goes with driver = \"{}\"", path.display(), DRIVER)),
            None if driver == DRIVER => Err("driver \"map\" needs map = \"FILE.toml\"".into()),
            None => Self::built_in(driver).ok_or_else(|| format!("no built-in register map '{driver}'")),
        }
    }

    /// The map of a servo, with its rules.
    pub(in crate::device) fn of_servo(profile: &ServoProfile) -> Result<(Self, ServoRules), String> {
        let map = Self::named(&profile.driver, profile.map.as_deref())?;
        let rules = map.servo.clone().ok_or_else(|| format!("the map '{}' is not of a servo", map.name))?;
        Ok((map, rules))
    }

    /// The map of a brake's current source, with its rules.
    pub(in crate::device) fn of_brake(profile: &BrakeProfile) -> Result<(Self, BrakeRules), String> {
        let map = Self::named(&profile.driver, profile.map.as_deref())?;
        let rules = map.brake.clone().ok_or_else(|| format!("the map '{}' is not of a brake's source", map.name))?;
        Ok((map, rules))
    }
}
