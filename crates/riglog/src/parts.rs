//! The parts of a log that was split while it was written: which files belong together, and in which order.
//!
//! Part 1 has the log's name, `x.mcap`; the next ones are `x.part2.mcap` and so on. What makes them one is not the name but the
//! record `rig.part`: all carry the log's id and their number, and sample numbers go on from part to part.

use std::path::{Path, PathBuf};

use crate::{
    completeness::Defect,
    error::LogError,
    metadata::MetadataMap,
    reader::open,
    walk::{Event, Walk},
};

/// Metadata record `rig.part`, at the head of each part of a log that may be split.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartMetadata {
    /// UUID of the log, the same in every part.
    pub log_id: String,
    /// The part's number, from 1.
    pub part: u32,
    /// Number of the first sample that may stand in it: as many were written before.
    pub first_sample: u64,
}

impl PartMetadata {
    /// The record's name in the file.
    pub const NAME: &'static str = "rig.part";
    /// The record at the end of a part that is followed by another: key `next` is its file's name.
    pub const CONTINUED: &'static str = "rig.continued";

    /// The record's content.
    #[must_use]
    pub fn to_map(&self) -> MetadataMap {
        [
            ("log_id", self.log_id.clone()),
            ("part", self.part.to_string()),
            ("first_sample", self.first_sample.to_string()),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
    }

    /// Reads a record; `None` where it names no log or no number: such a file is a log of its own.
    #[must_use]
    pub fn from_map(map: &MetadataMap) -> Option<Self> {
        Some(Self {
            log_id: map.get("log_id").filter(|id| !id.is_empty())?.clone(),
            part: map.get("part")?.trim().parse().ok().filter(|part| *part > 0)?,
            first_sample: map.get("first_sample").and_then(|text| text.trim().parse().ok()).unwrap_or(0),
        })
    }
}

/// The file of part `part` of the log at `path`, whichever part that names.
#[must_use]
pub fn part_path(path: &Path, part: u32) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let base = base_name(&name);
    path.with_file_name(if part <= 1 { format!("{base}.mcap") } else { format!("{base}.part{part}.mcap") })
}

/// A file's name without `.mcap` and without the number of its part.
fn base_name(name: &str) -> &str {
    let stem = name.strip_suffix(".mcap").unwrap_or(name);
    match stem.rsplit_once(".part") {
        Some((base, number)) if !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()) => base,
        _ => stem,
    }
}

/// The files of one log, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogParts {
    log_id: Option<String>,
    files: Vec<(u32, PathBuf)>,
}

impl LogParts {
    /// The log that the file at `path` belongs to, with the parts that lie beside it. A file that is no part, or cannot be read, is a
    /// log of its own.
    ///
    /// # Errors
    /// The file cannot be read or is no MCAP file.
    pub fn of(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref();
        let Some(this) = head(path)? else { return Ok(Self { log_id: None, files: vec![(1, path.to_owned())] }) };
        let mut files = vec![(this.part, path.to_owned())];
        let own = path.file_name().unwrap_or_default();
        let base = base_name(&own.to_string_lossy()).to_owned();
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // Where the directory cannot be listed, the parts that were named are all there is.
        for entry in std::fs::read_dir(parent).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let text = name.to_string_lossy();
            if name == own || !text.ends_with(".mcap") || base_name(&text) != base {
                continue;
            }
            let beside = path.with_file_name(&name);
            if let Ok(Some(other)) = head(&beside)
                && other.log_id == this.log_id
            {
                files.push((other.part, beside));
            }
        }
        let mut parts = Self { log_id: Some(this.log_id), files };
        parts.tidy();
        Ok(parts)
    }

    /// The logs that these files belong to, each once, in the order in which they were named first.
    ///
    /// # Errors
    /// As [`LogParts::of`].
    pub fn group(paths: &[impl AsRef<Path>]) -> Result<Vec<Self>, LogError> {
        let mut logs: Vec<Self> = Vec::new();
        for path in paths {
            let log = Self::of(path)?;
            let same = |other: &&mut Self| match (&other.log_id, &log.log_id) {
                (Some(one), Some(two)) => one == two,
                _ => canonical(&other.files[0].1) == canonical(&log.files[0].1),
            };
            match logs.iter_mut().find(same) {
                Some(known) => {
                    known.files.extend(log.files);
                    known.tidy();
                }
                None => logs.push(log),
            }
        }
        Ok(logs)
    }

    /// One file, taken as a whole log.
    #[must_use]
    pub fn alone(path: impl AsRef<Path>) -> Self {
        Self { log_id: None, files: vec![(1, path.as_ref().to_owned())] }
    }

    /// The files, in order.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|(_, path)| path.as_path())
    }

    /// The first file that there is; its name stands for the log.
    #[must_use]
    pub fn first(&self) -> &Path {
        self.files.first().map_or(Path::new(""), |(_, path)| path)
    }

    /// The parts' numbers, where the log was split.
    #[must_use]
    pub fn is_split(&self) -> bool {
        self.files.len() > 1
    }

    /// The first part that is missing; `continued` says whether the last one is followed by another.
    pub(crate) fn missing(&self, continued: bool) -> Option<Defect> {
        self.log_id.as_ref()?;
        let numbers = || self.files.iter().map(|(part, _)| *part);
        let gap = (1..).zip(numbers()).find(|(expected, found)| expected != found).map(|(expected, _)| expected);
        let last = numbers().next_back().unwrap_or(0);
        gap.or(continued.then_some(last + 1)).map(|part| Defect::MissingPart { part })
    }

    fn tidy(&mut self) {
        self.files.sort();
        let mut seen = std::collections::BTreeSet::new();
        // A copy of a part under another name is the same part.
        self.files.retain(|(part, _)| seen.insert(*part));
    }
}

fn canonical(path: &Path) -> PathBuf {
    // A path that cannot be resolved cannot be opened either, and says so there.
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// The record `rig.part` of a file; it stands before every message.
fn head(path: &Path) -> Result<Option<PartMetadata>, LogError> {
    let (source, bytes) = open(path)?;
    let mut walk = Walk::new(source, bytes, path)?;
    while let Some(event) = walk.next()? {
        match event {
            Event::Metadata { name, map } if name == PartMetadata::NAME => return Ok(PartMetadata::from_map(&map)),
            Event::Message { .. } => break,
            _ => {}
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_parts_lead_to_each_other() {
        let first = Path::new("runs/20261102T093000Z_ccw_5Nm_5rpm.mcap");
        let third = part_path(first, 3);
        assert_eq!(third, Path::new("runs/20261102T093000Z_ccw_5Nm_5rpm.part3.mcap"));
        assert_eq!(part_path(&third, 1), first);
        assert_eq!(base_name("a.part.mcap"), "a.part", "no number, no part");
        assert_eq!(base_name("a.partly.mcap"), "a.partly");
    }

    #[test]
    fn records_come_back_and_nonsense_is_no_part() {
        let part = PartMetadata { log_id: "x".into(), part: 7, first_sample: 1 << 40 };
        assert_eq!(PartMetadata::from_map(&part.to_map()), Some(part.clone()));
        for (key, value) in [("part", "0"), ("part", "two"), ("log_id", "")] {
            let mut map = part.to_map();
            map.insert(key.into(), value.into());
            assert_eq!(PartMetadata::from_map(&map), None, "{key} = {value}");
        }
    }
}
