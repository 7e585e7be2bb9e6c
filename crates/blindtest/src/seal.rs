//! Seals a label: a salted hash goes into the log, the label with its salt into a file that only the scoring opens.

use std::io::Write as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::error::BlindError;
use super::label::Label;

/// Directory of the labels beside the logs.
const DIRECTORY: &str = "sealed";

/// A label under seal. The text is what was hashed, to the letter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sealed {
    salt: String,
    label: String,
}

impl Sealed {
    /// Seals a label with a salt that no seed tells.
    #[must_use]
    pub fn new(label: &Label) -> Self {
        let salt = format!("{}{}", uuid::Uuid::new_v4().simple(), uuid::Uuid::new_v4().simple());
        // A label is plain data: it has a text.
        Self { salt, label: serde_json::to_string(label).unwrap_or_default() }
    }

    /// sha256 of salt and label, hexadecimal.
    #[must_use]
    pub fn hash(&self) -> String {
        let digest = Sha256::new().chain_update(&self.salt).chain_update(&self.label).finalize();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Writes the file of case `number` in `directory`; only its owner may read it.
    ///
    /// # Errors
    /// [`BlindError::File`].
    pub fn write(&self, directory: &Path, number: usize) -> Result<(), BlindError> {
        let path = path(directory, number);
        let failed = |source| BlindError::File { path: path.clone(), source };
        std::fs::create_dir_all(directory.join(DIRECTORY)).map_err(failed)?;
        let text = serde_json::to_string(self).map_err(|error| failed(error.into()))?;
        let mut file = std::fs::OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(0o600)
            .open(&path)
            .map_err(failed)?;
        writeln!(file, "{text}").map_err(failed)
    }

    /// Opens the seal of case `number` and checks it against the hash in the log.
    ///
    /// # Errors
    /// [`BlindError`] for a label that is missing, cannot be read, or is not the one that was sealed.
    pub fn open(directory: &Path, number: usize, hash: &str) -> Result<Label, BlindError> {
        let path = path(directory, number);
        let text = std::fs::read_to_string(&path).map_err(|source| BlindError::File { path: path.clone(), source })?;
        let refuse = |reason: String| BlindError::Label { path: path.clone(), reason };
        let sealed: Self = serde_json::from_str(&text).map_err(|error| refuse(error.to_string()))?;
        if sealed.hash() != hash {
            return Err(refuse("its hash is not the one in the log: it was changed after sealing".into()));
        }
        serde_json::from_str(&sealed.label).map_err(|error| refuse(error.to_string()))
    }
}

fn path(directory: &Path, number: usize) -> PathBuf {
    directory.join(DIRECTORY).join(format!("case-{number:04}.json"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::Family;

    fn label() -> Label {
        Label {
            seed: 3,
            case: 2,
            family: Family::Null,
            effects: Vec::new(),
            rms_rad: 0.0,
            exclude: Vec::new(),
            white_rad: 1e-5,
            run_out_rad: 1e-6,
            rate_hz: 1000.0,
        }
    }

    #[test]
    fn a_seal_opens_for_its_own_label_only() {
        let directory = tempfile::tempdir().unwrap();
        let sealed = Sealed::new(&label());
        sealed.write(directory.path(), 2).unwrap();
        assert_eq!(Sealed::open(directory.path(), 2, &sealed.hash()).unwrap(), label());
        let changed = Sealed { label: sealed.label.replace("\"seed\":3", "\"seed\":4"), ..sealed.clone() };
        changed.write(directory.path(), 2).unwrap();
        let said = Sealed::open(directory.path(), 2, &sealed.hash()).unwrap_err().to_string();
        assert!(said.contains("changed after sealing"), "{said}");
        assert!(Sealed::open(directory.path(), 3, &sealed.hash()).is_err());
    }

    #[test]
    fn the_same_label_hashes_differently_each_time() {
        assert_ne!(Sealed::new(&label()).hash(), Sealed::new(&label()).hash());
        assert_eq!(Sealed::new(&label()).hash().len(), 64);
    }
}
