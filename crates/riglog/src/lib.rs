//! riglog
