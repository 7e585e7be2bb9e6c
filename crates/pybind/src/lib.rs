//! The native half of the Python package `gearmodel`: it converts and nothing else. Physics lives in the crate
//! `gearmodel`, logs in `riglog`.
//!
//! A file per idea: `pair`, `errors`, `increment` (the model); `recording`, `log`, `analysis`, `backlash` (the measurement); `array` (what goes in
//! and out); `error` (the one place that makes exceptions).

// Python's keyword arguments are Rust's positional ones.
#![allow(clippy::too_many_arguments)]

mod analysis;
mod array;
mod backlash;
mod error;
mod errors;
mod increment;
mod log;
mod pair;
mod recording;

use pyo3::prelude::*;

/// Native half of the package gearmodel; import gearmodel instead.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::analysis::{Analysis, analyse};
    #[pymodule_export]
    use crate::backlash::{MeasuredBacklash, backlash_from};
    #[pymodule_export]
    use crate::error::{GeometryError, LogError};
    #[pymodule_export]
    use crate::errors::Errors;
    #[pymodule_export]
    use crate::log::{Event, Log, read_log};
    #[pymodule_export]
    use crate::pair::GearPair;
    #[pymodule_export]
    use crate::recording::Recording;
}
