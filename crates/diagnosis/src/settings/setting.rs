//! A number that was chosen: where it comes from, and the form in which each is written once.

use std::fmt;

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Follows from something else.
    Derived(&'static str),
    /// A finer one changes nothing but the time taken.
    Resolution,
    /// Set so that probabilities hold there.
    Calibrated(&'static str),
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Derived(from) => write!(f, "derived: {from}"),
            Self::Resolution => f.write_str("resolution"),
            Self::Calibrated(on) => write!(f, "calibrated: {on}"),
        }
    }
}

/// What was drawn for calibration.
pub(super) const SIMULATED: Kind = Kind::Calibrated("simulated campaigns");
pub(super) const RESOLUTION: Kind = Kind::Resolution;

/// A row of the table of settings.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Field.
    pub name: &'static str,
    /// Default as it is written.
    pub default: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Origin.
    pub kind: Kind,
    /// Meaning.
    pub meaning: &'static str,
}

/// A struct of settings with its defaults and its table, each number written once: `field: type = default, "unit", kind;`.
macro_rules! settings {
    ($(#[doc = $about:literal])+ $name:ident {
        $($(#[doc = $meaning:literal])+ $field:ident: $type:ty = $default:expr, $unit:literal, $kind:expr;)+
    }) => {
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, PartialEq, Serialize)]
        pub struct $name {
            $($(#[doc = $meaning])+ pub $field: $type,)+
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)+ }
            }
        }

        impl $name {
            /// Its fields in order.
            pub const TABLE: &'static [Setting] = &[$(Setting {
                name: stringify!($field),
                default: stringify!($default),
                unit: $unit,
                kind: $kind,
                meaning: concat!($($meaning),+),
            },)+];
        }
    };
}
