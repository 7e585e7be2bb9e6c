//! What is in a log.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use gearmodel::Direction;

use crate::{
    completeness::Completeness,
    error::LogError,
    metadata::{EncoderMetadata, MetadataMap, RunMetadata},
    run_stream::RunStream,
    survey::{AttachmentInfo, ChannelInfo},
};

/// A run and how much was recorded in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunInfo {
    /// The driver's sense.
    pub direction: Direction,
    /// Load set-point.
    pub load_nm: f64,
    /// Speed set-point.
    pub speed_rpm: f64,
    /// Turns of the driver between first and last sample; `None` where the encoders are not known.
    pub revolutions: Option<f64>,
    /// Samples in the log.
    pub samples: u64,
    /// Samples that are missing.
    pub losses: u64,
}

/// What is in a log.
#[derive(Debug, Clone, PartialEq)]
pub struct LogInfo {
    /// The file; the first one of a log that was split.
    pub path: PathBuf,
    /// All files of the log, in order.
    pub parts: Vec<PathBuf>,
    /// Their size.
    pub bytes: u64,
    /// The program that wrote it.
    pub library: String,
    /// Every metadata record as it stands in the file.
    pub metadata: BTreeMap<String, MetadataMap>,
    /// The record `rig.run`.
    pub run: Option<RunMetadata>,
    /// The record `rig.encoders`.
    pub encoders: Option<EncoderMetadata>,
    /// The attachments.
    pub attachments: Vec<AttachmentInfo>,
    /// The channels.
    pub channels: Vec<ChannelInfo>,
    /// The runs.
    pub runs: Vec<RunInfo>,
    /// Samples in runs.
    pub samples: u64,
    /// Samples missing in runs.
    pub losses: u64,
    /// Samples in the file, those outside of runs included.
    pub samples_in_file: u64,
    /// Samples missing in the file, those outside of runs included.
    pub losses_in_file: u64,
    /// From the first to the last message, in log time.
    pub duration_s: f64,
    /// Whether the log is whole.
    pub completeness: Completeness,
}

/// Reads a whole log and says what is in it.
///
/// # Errors
/// The file is no rig log, or a record in it makes no sense.
pub fn info(path: impl AsRef<Path>) -> Result<LogInfo, LogError> {
    let stream = RunStream::open(path)?;
    let totals = stream.count()?;
    let survey = stream.survey();
    let has_encoders = survey.encoders.is_some();
    let runs = totals
        .runs
        .iter()
        .map(|(span, run)| RunInfo {
            direction: span.direction,
            load_nm: span.load_nm,
            speed_rpm: span.speed_rpm,
            revolutions: has_encoders.then_some(run.revolutions),
            samples: run.samples,
            losses: run.losses,
        })
        .collect();
    const S_PER_NS: f64 = 1e-9;
    Ok(LogInfo {
        path: stream.parts().first().to_owned(),
        parts: stream.parts().paths().map(Path::to_owned).collect(),
        bytes: survey.bytes,
        library: survey.library.clone(),
        metadata: survey.metadata.clone(),
        run: survey.run.clone(),
        encoders: survey.encoders,
        attachments: survey.attachments.clone(),
        channels: survey.channels.clone(),
        runs,
        samples: totals.samples(),
        losses: totals.losses(),
        samples_in_file: totals.samples_in_file,
        losses_in_file: totals.losses_in_file,
        duration_s: survey.bounds_ns.map_or(0.0, |(first, last)| (last - first) as f64 * S_PER_NS),
        completeness: totals.completeness,
    })
}
