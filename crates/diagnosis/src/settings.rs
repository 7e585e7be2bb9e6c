//! Every number that can change a verdict, with its meaning, unit and origin: one place for choices.
//!
//! A number is *derived* where it follows from another, a *resolution* where a finer one changes nothing but the time taken, and
//! *calibrated* where it was set so that probabilities hold on the campaigns named. What is no choice (sizes of transforms, words,
//! parts of pictures) stays where it is used. The table in `docs/theory/settings.md` is made from here.

use serde::Serialize;

#[macro_use]
mod setting;

mod inference;
mod measurement;
mod patterns;
mod report;

pub use inference::{DesignSettings, EvidenceSettings, NoiseSettings, SearchSettings, SharpeningSettings};
pub use measurement::{GridSettings, LineSettings, ReductionSettings, ToneSettings, TransientSettings};
pub use patterns::{GhostSettings, NuisanceSettings, RunningOnSettings, StepSettings};
pub use report::ReportSettings;
pub use setting::{Kind, Setting};

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
