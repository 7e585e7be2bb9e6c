//! The one place where errors of the model, of the log and of the binding become Python exceptions.

use std::path::Path;

use gearmodel::sensitivity::Parameter;
use pyo3::exceptions::{PyOSError, PyTypeError, PyValueError};
use pyo3::{PyErr, create_exception};

create_exception!(
    gearmodel,
    GeometryError,
    PyValueError,
    "A gear pair that cannot be made, cannot run, or is not described by finite numbers.\n\nThe text names the quantity, \
     its value and unit, the limit, and what to do next."
);
create_exception!(
    gearmodel,
    LogError,
    PyValueError,
    "A rig log that cannot be understood.\n\nThe text names the file, the place in it, and what to do next. A file that \
     cannot be opened raises the OSError that the operating system gives."
);

/// An exception about to be raised. Everything that a binding may fail with converts into it with `?`.
pub struct Raised(PyErr);

/// What a binding returns.
pub type Result<T> = std::result::Result<T, Raised>;

impl From<Raised> for PyErr {
    fn from(raised: Raised) -> Self {
        raised.0
    }
}

impl From<PyErr> for Raised {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

impl From<gearmodel::GeometryError> for Raised {
    fn from(error: gearmodel::GeometryError) -> Self {
        Self(GeometryError::new_err(error.to_string()))
    }
}

impl From<gearmodel::PairFileError> for Raised {
    fn from(error: gearmodel::PairFileError) -> Self {
        Self(GeometryError::new_err(error.to_string()))
    }
}

impl From<gearmodel::contact::ContactError> for Raised {
    fn from(error: gearmodel::contact::ContactError) -> Self {
        use gearmodel::contact::ContactError;
        Self(match error {
            ContactError::NotFinite { .. } | ContactError::Load { .. } => PyValueError::new_err(error.to_string()),
            _ => GeometryError::new_err(error.to_string()),
        })
    }
}

impl From<gearmodel::ParseDirectionError> for Raised {
    fn from(error: gearmodel::ParseDirectionError) -> Self {
        Self(PyValueError::new_err(error.to_string()))
    }
}

impl From<InputError> for Raised {
    fn from(error: InputError) -> Self {
        Self(match error {
            InputError::NotNumbers { .. } => PyTypeError::new_err(error.to_string()),
            InputError::Teeth { .. } | InputError::Lobes { .. } => GeometryError::new_err(error.to_string()),
            _ => PyValueError::new_err(error.to_string()),
        })
    }
}

impl From<riglog::LogError> for Raised {
    fn from(error: riglog::LogError) -> Self {
        Self(match &error {
            riglog::LogError::Io { source, .. } => os_error(source, error.to_string()),
            _ => LogError::new_err(error.to_string()),
        })
    }
}

impl From<gearmodel::measure::MeasureError> for Raised {
    fn from(error: gearmodel::measure::MeasureError) -> Self {
        Self(PyValueError::new_err(error.to_string()))
    }
}

impl From<gearmodel::measure::SpectrumError> for Raised {
    fn from(error: gearmodel::measure::SpectrumError) -> Self {
        Self(PyValueError::new_err(error.to_string()))
    }
}

impl From<gearmodel::tolerance::ToleranceError> for Raised {
    fn from(error: gearmodel::tolerance::ToleranceError) -> Self {
        use gearmodel::tolerance::ToleranceError;
        match error {
            ToleranceError::Range(range) => range.into(),
            _ => Self(PyValueError::new_err(error.to_string())),
        }
    }
}

impl From<gearmodel::recording::RecordingError> for Raised {
    fn from(error: gearmodel::recording::RecordingError) -> Self {
        Self(PyValueError::new_err(error.to_string()))
    }
}

/// An argument that the model never sees.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// Text, complex numbers, times or objects where real numbers are needed.
    #[error("{field} holds {found}: real numbers are needed, an array or anything numpy.asarray makes one of")]
    NotNumbers {
        /// The argument.
        field: &'static str,
        /// What it is made of.
        found: String,
    },
    /// Nested sequences of different lengths, or what numpy does not understand.
    #[error("{field} is no array: {reason}")]
    NoArray {
        /// The argument.
        field: &'static str,
        /// What numpy says.
        reason: String,
    },
    /// NaN or infinity where a condition is needed.
    #[error("{name} is {value}: a finite number is needed")]
    NotFinite {
        /// The argument.
        name: &'static str,
        /// The value given.
        value: f64,
    },
    /// A count below 0, or beyond any.
    #[error("{field} is {given}: a whole number of at least 0 is needed, within what computers count")]
    Count {
        /// The argument.
        field: &'static str,
        /// The number given.
        given: i128,
    },
    /// A matrix or a single number where a list is needed.
    #[error("{field} has {dimensions} dimensions: 1 is needed")]
    Dimensions {
        /// The argument.
        field: &'static str,
        /// Its dimensions.
        dimensions: usize,
    },
    /// There are two gears.
    #[error("gear {given} does not exist: write 1 (driver) or 2 (driven)")]
    Gear {
        /// The number given.
        given: i64,
    },
    /// A tooth number that is no whole number, or that none of the model holds.
    #[error("gear {gear} has {given} teeth: whole numbers from 5 to 10000 are accepted")]
    Teeth {
        /// 1 = driver, 2 = driven.
        gear: u8,
        /// The number given.
        given: String,
    },
    /// A number of lobes that is no whole number.
    #[error("gear {gear} has {given} lobes: a whole number of at least 1 is needed")]
    Lobes {
        /// 1 = driver, 2 = driven.
        gear: u8,
        /// The number given.
        given: f64,
    },
    /// A method that does not exist.
    #[error("method {given:?} is unknown: write \"common_normal\", \"exact\" or \"published\"")]
    Method {
        /// The text given.
        given: String,
    },
    /// An order beyond what the grid resolves.
    #[error("highest_order = {given} is outside 1 to {limit}: {bins} bins a turn resolve no more; take more bins")]
    HighestOrder {
        /// The order given.
        given: i64,
        /// The highest possible.
        limit: usize,
        /// Bins a turn.
        bins: usize,
    },
    /// An axis that does not exist.
    #[error("axis {given:?} is unknown: write \"input\", \"output\" or \"mesh\"")]
    Axis {
        /// The text given.
        given: String,
    },
    /// A shaft that does not exist.
    #[error("shaft {given:?} is unknown: write \"input\" or \"output\"")]
    Shaft {
        /// The text given.
        given: String,
    },
    /// A tooth number below 0, which no gear has.
    #[error("tooth {given} does not exist: teeth count from 0")]
    Tooth {
        /// The number given.
        given: i64,
    },
    /// An objective that does not exist.
    #[error("objective {given:?} is unknown: write \"backlash\", \"te_ccw\", \"te_cw\" or \"te_both\"")]
    Objective {
        /// The text given.
        given: String,
    },
    /// A freedom of assembly that does not exist.
    #[error(
        "{gear} = {given}: write \"hub\" (turned by any angle), \"fixed\", or the steps a turn by which it can be indexed"
    )]
    Freedom {
        /// The argument.
        gear: &'static str,
        /// What was given.
        given: String,
    },
    /// The printed equations know no load.
    #[error(
        "load_nm = {load_nm} N.m with method \"published\": the printed equations know no load; take \"common_normal\" \
         or \"exact\", or load_nm = 0"
    )]
    PublishedLoad {
        /// The load given.
        load_nm: f64,
    },
    /// The printed equations know eccentricities alone.
    #[error(
        "tooth_errors or displacement_mm with method \"published\": the printed equations know eccentricities alone; take \
         \"common_normal\" or \"exact\""
    )]
    PublishedErrors,
    /// A parameter that does not exist.
    #[error("parameter {given:?} is unknown: write one of {known}")]
    Parameter {
        /// The text given.
        given: String,
        /// The parameters there are.
        known: String,
    },
    /// A figure that does not exist.
    #[error(
        "of = {given:?} is unknown: write \"te_pp\", \"te_rms\", \"te_mean\", \"backlash_pp\" or \"backlash_mean\""
    )]
    Figure {
        /// The text given.
        given: String,
    },
    /// A method that sweeps do not have.
    #[error("method {given:?} is unknown to sweeps: write \"common_normal\" or \"exact\"")]
    SweptMethod {
        /// The text given.
        given: String,
    },
    /// A parameter of another kind of pair.
    #[error("parameter {given:?} does not belong to a pair of kind {kind:?}")]
    ForeignParameter {
        /// The parameter.
        given: &'static str,
        /// The kind of pair.
        kind: &'static str,
    },
    /// A load that is not a number.
    #[error("load_nm is {load_nm}: a finite torque in N.m is needed")]
    Load {
        /// The load given.
        load_nm: f64,
    },
}

/// The OSError of a failure to read or write a file, with the file's name in it.
pub fn file_error(path: &Path, error: &std::io::Error) -> PyErr {
    os_error(error, format!("{}: {error}", path.display()))
}

/// OSError, as the subclass that its number stands for (FileNotFoundError, PermissionError...).
fn os_error(source: &std::io::Error, text: String) -> PyErr {
    match source.raw_os_error() {
        Some(number) => PyOSError::new_err((number, text)),
        None => PyErr::from(std::io::Error::new(source.kind(), text)),
    }
}

impl InputError {
    /// A name that is none of the model's parameters.
    pub fn unknown_parameter(given: &str) -> Self {
        Self::Parameter { given: given.to_owned(), known: Parameter::ALL.map(Parameter::name).join(", ") }
    }
}
