//! The gap between model and rig: where it lies, which effect causes it, how far it shrinks once that effect is added.
//!
//! | step | file | what comes out |
//! |---|---|---|
//! | residual against the nominal model, by stretches | `nominal`, `reduce`, `line_phase` | points, independent of the log's length |
//! | revolutions × angle bins | `grid` | residual and station of every place |
//! | columns of all effects and unknown patterns | `pool`, `columns`, `unknown` | sums from which every fit is made |
//! | what does not repeat | `noise` | covariance by order, revolution and run |
//! | how probable is a set of effects | `normal`, `evidence`, `search` | models with their posterior |
//! | tones, steps, knocks, what runs on with time | `events`, `knocks`, `sectors`, `slow_tone` | what angle does not carry |
//! | probabilities, groups | `attribute` | verdict |
//! | the gap on runs not used for the fit | `shrink` | how far it closes |
//! | where | `locate` | tables and signature |
//! | what to do next | `next` | experiments |
//! | logs as points on one clock; logs with their model | `campaign_logs`, `logs` | what commands and the blind test share |
//! | a log against a model, without causes | `verify` | residual against the floor |
//!
//! Theory and measured figures: `docs/theory/diagnosis.md`.

pub mod attribute;
mod campaign_logs;
pub mod diagnosis;
pub mod evidence;
pub mod grid;
pub mod html;
pub mod line_phase;
pub mod logs;
pub mod noise;
mod nominal;
pub mod pool;
pub mod reduce;
pub mod search;
mod slow_tone;
pub mod summary;
pub mod unknown;
pub mod verify;

mod columns;
mod documented;
mod engine;
mod events;
mod ghosts;
mod gram;
mod interpolation;
mod knocks;
mod locate;
mod next;
mod normal;
mod sectors;
mod shrink;
mod waves;

pub use campaign_logs::{CampaignLogs, ReducedLogs};
pub use diagnosis::Diagnosis;
pub use engine::{GapError, Options, diagnose, diagnose_runs, diagnose_with_nominal};
pub use nominal::Nominal;
