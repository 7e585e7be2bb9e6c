//! The native half of the Python package `gearmodel`: it converts and nothing else. Physics lives in the crate
//! `gearmodel`, logs in `riglog`.
//!
//! A file per idea: `pair`, `errors`, `increment` (the model); `array` (what goes in and out); `error` (the one place
//! that makes exceptions).

mod array;
mod error;
mod errors;
mod increment;
mod pair;

use pyo3::prelude::*;

/// Native half of the package gearmodel; import gearmodel instead.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::error::{GeometryError, LogError};
    #[pymodule_export]
    use crate::errors::Errors;
    #[pymodule_export]
    use crate::pair::GearPair;
}
