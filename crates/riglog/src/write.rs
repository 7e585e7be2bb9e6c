//! Writing a log so that whatever kills the writer leaves a clean prefix of it.

pub(crate) mod encoder;
mod options;
mod output;
mod rotate;
mod store;
mod sync;
mod writer;

pub(crate) use writer::sync_directory_of;

pub use options::{LogStatistics, WriterOptions};
pub use rotate::{RotatingWriter, Rotation};
pub use writer::LogWriter;
