//! A set of withheld cases as files.

use std::path::{Path, PathBuf};

use super::error::BlindError;
use super::family::{Family, of_case};
use super::generate::{self, Baselines};
use super::log;
use super::seal::Sealed;

/// What set is generated.
pub struct SetPlan {
    /// Seed of all draws.
    pub seed: u64,
    /// Only this family.
    pub family: Option<Family>,
    /// The nominal pair.
    pub pair_toml: String,
    /// What was measured for earlier cases.
    pub baselines: Baselines,
}

impl SetPlan {
    /// Generates case `number` in `directory`: its log, and its label under seal. Gives the log's path.
    ///
    /// # Errors
    /// [`BlindError`] for a case that cannot be drawn or written.
    pub fn generate(&self, directory: &Path, number: usize) -> Result<PathBuf, BlindError> {
        let case =
            generate::generate_case(self.seed, number, of_case(number, self.family), &self.pair_toml, &self.baselines)?;
        let sealed = Sealed::new(&case.label);
        let path = log::path(directory, number);
        log::write(&path, &case.campaign, &case.pair_toml, &sealed.hash())?;
        sealed.write(directory, number)?;
        Ok(path)
    }
}
