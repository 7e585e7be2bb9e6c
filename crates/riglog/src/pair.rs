//! The gear pair in force: from a file, from a log, or built in.

use std::path::{Path, PathBuf};

use gearmodel::{GeometryError, NominalModel, PairFile, PairFileError};
use thiserror::Error;

/// The embedded gear pair: the source document's, with its documented errors.
pub const DEFAULT_PAIR: &str = include_str!("pair.toml");

/// Why a gear pair is refused.
#[derive(Debug, Error)]
pub enum PairError {
    /// The file could not be read.
    #[error("pair {path}: {source}; give a pair.toml, or leave --pair out for the built-in pair")]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The text is not a pair.
    #[error("pair {path}: {source}")]
    Text {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: PairFileError,
    },
    /// Such a pair cannot run.
    #[error("pair {path}: {source}")]
    Geometry {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: GeometryError,
    },
}

/// Reads `path`, or takes the built-in pair; the text is kept for the log.
///
/// # Errors
/// [`PairError`] names the file, the key and the limit.
pub fn load(path: Option<&Path>) -> Result<(String, NominalModel), PairError> {
    let (text, path) = match path {
        None => (DEFAULT_PAIR.to_owned(), Path::new("(built in)")),
        Some(path) => {
            let text = std::fs::read_to_string(path).map_err(|source| PairError::Read { path: path.into(), source })?;
            (text, path)
        }
    };
    let model = parse(&text, path)?;
    Ok((text, model))
}

/// A nominal model from the text of a `pair.toml`; `path` is for the error.
///
/// # Errors
/// [`PairError`].
pub fn parse(text: &str, path: &Path) -> Result<NominalModel, PairError> {
    Ok(parse_file(text, path)?.1)
}

/// The same with the file's content.
///
/// # Errors
/// [`PairError`].
pub fn parse_file(text: &str, path: &Path) -> Result<(PairFile, NominalModel), PairError> {
    let file = PairFile::parse(text).map_err(|source| PairError::Text { path: path.into(), source })?;
    let model = file.model().map_err(|source| PairError::Geometry { path: path.into(), source })?;
    Ok((file, model))
}

/// Reads the file at `path`.
///
/// # Errors
/// [`PairError`].
pub fn load_file(path: &Path) -> Result<(PairFile, NominalModel), PairError> {
    let text = std::fs::read_to_string(path).map_err(|source| PairError::Read { path: path.into(), source })?;
    parse_file(&text, path)
}
