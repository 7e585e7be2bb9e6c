//! The native half of the Python package `gearmodel`: it converts and nothing else. Physics lives in the crate
//! `gearmodel`, logs in `riglog`.
//!
//! A file per idea: `pair`, `errors`, `tooth_errors`, `outline`, `study` (the model); `recording`, `log`, `analysis`, `backlash` (the measurement); `array` (what goes in
//! and out); `error` (the one place that makes exceptions).

// Python's keyword arguments are Rust's positional ones, and come owned.
#![allow(clippy::too_many_arguments, clippy::needless_pass_by_value)]

mod analysis;
mod array;
mod backlash;
mod diagnosis;
mod error;
mod errors;
mod log;
mod outline;
mod pair;
mod recording;
mod study;
mod tooth_errors;

use pyo3::prelude::*;

/// Native half of the package gearmodel; import gearmodel instead.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::analysis::{Analysis, analyse};
    #[pymodule_export]
    use crate::backlash::{MeasuredBacklash, backlash_from};
    #[pymodule_export]
    use crate::diagnosis::{NativeDiagnosis, diagnose, diagnose_logs};
    #[pymodule_export]
    use crate::error::{GeometryError, LogError};
    #[pymodule_export]
    use crate::errors::Errors;
    #[pymodule_export]
    use crate::log::{Event, Log, read_log};
    #[pymodule_export]
    use crate::outline::{outline_dxf, outline_svg};
    #[pymodule_export]
    use crate::pair::GearPair;
    #[pymodule_export]
    use crate::pair::loaded::LoadedPair;
    #[pymodule_export]
    use crate::pair::phases::{PhaseValue, Phases};
    #[pymodule_export]
    use crate::recording::Recording;
    #[pymodule_export]
    use crate::study::sweep;
    #[pymodule_export]
    use crate::tooth_errors::{Profile, ToothDamage, ToothErrors};
}
