//! The gap between model and rig: where it lies, which effect causes it, how far it shrinks once that effect is added.
//!
//! | step | file | what comes out |
//! |---|---|---|
//! | all of them in order | `diagnose`, under `options` and `settings` | a diagnosis |
//! | residual against the nominal model, by segments | `nominal`, `reduce`, `line_phase`, `documented` | points, independent of the log's length |
//! | pieces joined, errors within the encoders' lines taken off | `runs`, `interpolation`, `line_errors` | runs |
//! | revolutions × angle bins | `grid`, `levels`, `local_speed` | residual and operating point of every place |
//! | knocks and tones taken off | `transients`, `tones`, `taken_off` | what angle does not carry |
//! | columns of all effects and unknown patterns | `design_matrix`, `columns`, `nuisance_patterns`, `ghosts` | sums from which every fit is made |
//! | what does not repeat | `noise`, `waves` | covariance by order, revolution and run |
//! | how probable is a set of effects | `normal_equations`, `evidence`, `search` | models with their posterior |
//! | search, steps, what runs on with time, shapes sharpened, until nothing changes | `solve/`, `steps`, `sectors`, `slow_tone` | the models that the residual allows |
//! | probabilities → held-out gap → verdict → unknown → budget | `report/`, `posterior`, `cross_validation` | the answer |
//! | where | `localisation` | tables and signature |
//! | what to do next | `experiment_design` | experiments |
//! | logs as points on one clock; logs with their model | `campaign_logs`, `logs` | what commands and the blind test share |
//! | a log against a model, without causes | `verify` | residual against the floor |
//!
//! Theory and measured figures: `docs/theory/diagnosis.md`.

mod campaign_logs;
pub mod design_matrix;
pub mod diagnosis;
pub mod evidence;
pub mod grid;
pub mod html;
pub mod line_phase;
pub mod logs;
pub mod noise;
mod nominal;
pub mod nuisance_patterns;
pub mod posterior;
pub mod reduce;
pub mod search;
pub mod settings;
mod slow_tone;
pub mod summary;
pub mod verify;

mod columns;
mod cross_validation;
mod diagnose;
mod documented;
mod experiment_design;
mod ghosts;
mod gram;
mod interpolation;
mod levels;
mod line_errors;
mod local_speed;
mod localisation;
mod normal_equations;
mod options;
mod pattern_words;
#[cfg(test)]
mod reference_tests;
mod report;
mod runs;
mod sectors;
mod solve;
mod steps;
mod taken_off;
mod tones;
mod transients;
mod waves;

pub use campaign_logs::{CampaignLogs, ReducedLogs};
pub use diagnose::{diagnose, diagnose_runs, diagnose_with_nominal};
pub use diagnosis::Diagnosis;
pub use nominal::Nominal;
pub use options::{GapError, Options};
pub use settings::Settings;
