//! Writing a log so that whatever kills the writer leaves a clean prefix of it.

mod store;
mod sync;
mod writer;

pub use writer::{LogStatistics, LogWriter, WriterOptions};
