//! A withheld campaign as a rig log: what `rigd run` would have recorded, and no trace of the draw.

use std::path::{Path, PathBuf};

use riglog::proto::{self, RigState, Timestamp};
use riglog::{BatchBuilder, EncoderMetadata, LogReader, LogWriter, Record, RunMetadata, WriterOptions};

use super::campaign::{State, WithheldCampaign};
use super::error::BlindError;

/// When withheld campaigns begin, ns since the Unix epoch: 2026-01-01T00:00:00Z.
const EPOCH_NS: u64 = 1_767_225_600_000_000_000;
/// Samples a message.
const BATCH: usize = 1000;
/// A chunk is closed after this much log time, ms: nobody waits for the samples.
const CHUNK_MS: u32 = 10_000;

/// Path of the log of case `number`.
#[must_use]
pub fn path(directory: &Path, number: usize) -> PathBuf {
    directory.join(format!("case-{number:04}.mcap"))
}

/// Writes the log of a campaign with the nominal pair and the hash of what is withheld.
///
/// # Errors
/// [`BlindError::Log`].
pub fn write(path: &Path, campaign: &WithheldCampaign, pair_toml: &str, hash: &str) -> Result<(), BlindError> {
    let options =
        WriterOptions { chunk_period_ms: CHUNK_MS, ..WriterOptions::new(concat!("rigd ", env!("CARGO_PKG_VERSION"))) };
    let mut writer = LogWriter::create(path, options)?;
    let mut metadata = RunMetadata {
        run_id: uuid::Uuid::new_v4().to_string(),
        started: "2026-01-01T00:00:00Z".into(),
        software: concat!("rigd ", env!("CARGO_PKG_VERSION")).into(),
        backend: "sim".into(),
        direction: "both".into(),
        ..RunMetadata::default()
    };
    for run in &campaign.runs {
        metadata.load_nm.push(run.plan.load_nm);
        metadata.speed_rpm.push(run.plan.speed_rpm);
    }
    writer.run_metadata(&metadata)?;
    writer.sealed(hash)?;
    writer.attach(EPOCH_NS, "pair.toml", "application/toml", pair_toml.as_bytes())?;
    writer.encoders(&EncoderMetadata {
        input_counts_per_rev: campaign.counts_per_rev[0],
        output_counts_per_rev: campaign.counts_per_rev[1],
        input_lines: campaign.lines[0].into(),
        output_lines: campaign.lines[1].into(),
        input_index_counts: campaign.index_counts[0],
        output_index_counts: campaign.index_counts[1],
        input_sign: 1,
        output_sign: 1,
    })?;

    let period_ns = (1e9 / campaign.rate_hz).round() as u64;
    let time_ns = |sample: usize| EPOCH_NS + sample as u64 * period_ns;
    let mut batch = BatchBuilder::new(BATCH);
    let mut states = campaign.states.iter().peekable();
    for (sample, &[input, output]) in campaign.counts.iter().enumerate() {
        if let Some(state) = states.next_if(|state| state.sample <= sample) {
            // What came before a change of phase stands before it in the file, too.
            if let Some(rest) = batch.take() {
                angles(&mut writer, &rest)?;
            }
            writer.state(time_ns(sample), time_ns(sample), &rig_state(state, time_ns(sample)))?;
        }
        if let Some(full) = batch.push(sample as u64, time_ns(sample), input, output) {
            angles(&mut writer, &full)?;
        }
    }
    if let Some(rest) = batch.take() {
        angles(&mut writer, &rest)?;
    }
    writer.finish()?;
    Ok(())
}

fn angles(writer: &mut LogWriter, batch: &proto::AngleBatch) -> Result<(), BlindError> {
    Ok(writer.angles(batch.last_time_ns().unwrap_or(batch.t0_ns), batch.t0_ns, batch)?)
}

fn rig_state(state: &State, time_ns: u64) -> RigState {
    let run = state.run;
    let load_nm = run.map_or(0.0, |run| run.load_nm);
    RigState {
        timestamp: Some(Timestamp::from_ns(time_ns)),
        phase: state.phase.into(),
        direction: run.map_or(proto::Direction::Unspecified, |run| proto::Direction::from(run.direction)).into(),
        speed_setpoint_rpm: run.map_or(0.0, |run| run.speed_rpm),
        speed_rpm: state.speed_rpm,
        load_setpoint_nm: load_nm,
        load_nm,
        brake_current_a: state.brake_current_a,
        brake_temperature_c: state.brake_temperature_c,
        samples: state.sample as u64,
        ..RigState::default()
    }
}

/// The hash that a withheld log carries.
///
/// # Errors
/// [`BlindError`] for a log that cannot be read or carries none.
pub fn sealed_hash(path: &Path) -> Result<String, BlindError> {
    for record in LogReader::open(path)? {
        if let Record::Sealed(hash) = record? {
            return Ok(hash);
        }
    }
    Err(BlindError::Label { path: path.into(), reason: "the log carries no rig.sealed".into() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{self, WithheldPlan};
    use rigsim::plant::PlantSpec;

    #[test]
    fn the_log_holds_every_sample_and_run_and_nothing_else() {
        let mut plan = WithheldPlan::usual(500.0);
        plan.runs.truncate(3);
        plan.revolutions = 1.0;
        let campaign = campaign::run(&PlantSpec::default(), &plan, 3).unwrap();
        let directory = tempfile::tempdir().unwrap();
        let file = path(directory.path(), 0);
        write(&file, &campaign, "kind = \"x\"", "abc").unwrap();
        assert_eq!(sealed_hash(&file).unwrap(), "abc");
        let runs = riglog::read_runs(&file).unwrap();
        assert_eq!(runs.len(), 3);
        for (read, span) in runs.iter().zip(&campaign.runs) {
            assert_eq!((read.direction, read.load_nm), (span.plan.direction, span.plan.load_nm));
            assert_eq!((read.samples, read.losses), ((span.to - span.from) as u64, 0));
            assert_eq!([read.theta1_rad[7], read.theta2_rad[7]], campaign.angles_rad(span.from + 7));
        }
        // Nothing in the file but what a rig knows.
        let attachments: Vec<String> =
            riglog::info(&file).unwrap().attachments.iter().map(|attachment| attachment.name.clone()).collect();
        assert_eq!(attachments, ["pair.toml"]);
    }
}
