//! Writing a log so that whatever kills the writer leaves a clean prefix of it.

mod options;
mod output;
mod store;
mod sync;
mod writer;

pub use options::{LogStatistics, WriterOptions};
pub use writer::LogWriter;
