//! The rig log: what a gear rig records, as an MCAP file that every MCAP tool can open.
//!
//! - [`LogWriter`] writes a log so that a killed process, a full disk or a power cut leaves a clean prefix of it.
//! - [`LogReader`] reads any log in file order, whole or cut off, a chunk at a time, and says whether it is whole.
//! - [`RotatingWriter`] splits a long log into parts without losing a sample; [`LogParts`] finds the parts of one log.
//! - [`audit()`] checks checksums, sequence and clock; [`Follower`] reads a log that is being written.
//! - [`recover()`] finalises what a killed writer left.
//! - [`info()`] says what is in a log; [`RunStream`] and [`read_runs`] give its runs as shaft angles.
//! - [`pair`] reads the gear pair that a log carries, or a file.
//!
//! Messages and their units are those of `proto/rig.proto`; times are ns since the Unix epoch.

mod audit;
mod batch;
mod completeness;
mod error;
mod follow;
mod info;
mod metadata;
pub mod pair;
mod parts;
pub mod proto;
mod reader;
mod record;
mod recorded;
mod recover;
mod run_stream;
mod run_visitor;
mod runs;
mod survey;
mod topic;
mod walk;
mod write;

pub use audit::{Audit, Finding, FindingKind, audit};
pub use batch::BatchBuilder;
pub use completeness::{Completeness, Defect};
pub use error::{BatchError, LogError};
pub use follow::{Follower, Following};
pub use info::{LogInfo, RunInfo, info};
pub use metadata::{AngleScale, EncoderMetadata, MetadataMap, RunMetadata};
pub use pair::PairError;
pub use parts::{LogParts, PartMetadata, part_path};
pub use reader::{LogReader, Record};
pub use recorded::{RecordedRun, read_runs};
pub use recover::{RecoveredFile, Recovery, recover, recover_directory};
pub use run_stream::RunStream;
pub use run_visitor::{RunVisitor, SampleBlock, StreamTotals};
pub use runs::{RunSpan, RunTotals};
pub use survey::{AttachmentInfo, ChannelInfo};
pub use topic::Topic;
pub use write::{LogStatistics, LogWriter, RotatingWriter, Rotation, WriterOptions};
