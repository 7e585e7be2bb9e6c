//! Reads a log while it is being written: what a live display looks at. It holds no lock and can hold up nobody.

use std::{
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};

use crate::{
    completeness::Completeness,
    error::LogError,
    parts::{PartMetadata, part_path},
    reader::{Record, decode, open},
    walk::{Event, Walk},
};

/// Follows a growing log, and into its next parts.
pub struct Follower {
    path: PathBuf,
    walk: Walk<BufReader<File>>,
    /// The file says that another follows it.
    continued: bool,
}

/// How a log stands that is being followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Following {
    /// It may still grow.
    Growing,
    /// It has its end.
    Ended,
}

impl Follower {
    /// Follows the log at `path` from its beginning.
    ///
    /// # Errors
    /// The file cannot be read, or is no MCAP file (yet).
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref().to_owned();
        let (source, bytes) = open(&path)?;
        let walk = Walk::new(source, bytes, &path)?;
        Ok(Self { path, walk, continued: false })
    }

    /// The file that is read now.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives every record since the last call to `take`. A record that makes no sense is left out: the audit tells of it.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn poll(&mut self, mut take: impl FnMut(Record)) -> Result<Following, LogError> {
        loop {
            let bytes = std::fs::metadata(&self.path).map_err(LogError::io("read", &self.path))?.len();
            self.walk.resume(bytes)?;
            while let Some(event) = self.walk.next()? {
                if let Event::Metadata { name, .. } = &event {
                    self.continued |= name == PartMetadata::CONTINUED;
                }
                if let Ok(record) = decode(event, &self.path) {
                    take(record);
                }
            }
            if !matches!(self.walk.completeness(), Some(Completeness::Complete)) {
                return Ok(Following::Growing);
            }
            if !self.continued {
                return Ok(Following::Ended);
            }
            // The next part was made before this one was ended.
            let next = part_path(&self.path, self.part().saturating_add(1));
            *self = Self::open(next)?;
        }
    }

    fn part(&self) -> u32 {
        let name = self.path.file_stem().unwrap_or_default().to_string_lossy();
        name.rsplit_once(".part").and_then(|(_, number)| number.parse().ok()).unwrap_or(1)
    }
}
