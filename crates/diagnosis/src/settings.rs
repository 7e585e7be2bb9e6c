//! Every number that can change a verdict, with its meaning, unit and origin: one place for choices.
//!
//! A number is *derived* where it follows from another, a *resolution* where a finer one changes nothing but the time taken, and
//! *calibrated* where it was set so that probabilities hold on the campaigns named. What is no choice (sizes of transforms, words,
//! parts of pictures) stays where it is used. The table in `docs/theory/settings.md` is made from here.

use std::fmt;

use serde::Serialize;

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
const SIMULATED: Kind = Kind::Calibrated("simulated campaigns");
const RESOLUTION: Kind = Kind::Resolution;

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

mod inference;
mod measurement;
mod patterns;
mod report;

pub use inference::{DesignSettings, EvidenceSettings, NoiseSettings, SearchSettings, SharpeningSettings};
pub use measurement::{GridSettings, LineSettings, ReductionSettings, ToneSettings, TransientSettings};
pub use patterns::{GhostSettings, NuisanceSettings, RunningOnSettings, StepSettings};
pub use report::ReportSettings;

/// The steps of a diagnosis with the settings of each, in order.
macro_rules! steps {
    ($($(#[doc = $about:literal])+ $field:ident: $type:ident,)+) => {
        /// All settings of a diagnosis by step.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
        pub struct Settings {
            $($(#[doc = $about])+ pub $field: $type,)+
        }

        impl Settings {
            /// Steps with what they do and their settings.
            pub const TABLE: &'static [(&'static str, &'static str, &'static [Setting])] =
                &[$((stringify!($field), concat!($($about),+), $type::TABLE),)+];
        }
    };
}

steps! {
    /// Samples → points → runs.
    reduction: ReductionSettings,
    /// The encoders' lines: their number and the errors within them.
    lines: LineSettings,
    /// Points → revolutions × angle bins.
    grid: GridSettings,
    /// Knocks and lost readings.
    transients: TransientSettings,
    /// Tones in time.
    tones: ToneSettings,
    /// Columns of the candidates.
    design: DesignSettings,
    /// What does not repeat.
    noise: NoiseSettings,
    /// How probable a set of candidates is.
    evidence: EvidenceSettings,
    /// Search over sets.
    search: SearchSettings,
    /// Shapes between the points of their grids.
    sharpening: SharpeningSettings,
    /// Steps in the level.
    steps: StepSettings,
    /// Patterns that no effect of the library makes.
    nuisance: NuisanceSettings,
    /// Lines in the spectrum above the orders that every fit tries.
    ghosts: GhostSettings,
    /// Levels that run on with time.
    running_on: RunningOnSettings,
    /// From models to probabilities, names and sizes.
    report: ReportSettings,
}
