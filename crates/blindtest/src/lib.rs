//! Withheld data: campaigns on the simulated rig whose faults nobody is told, and the scoring of whoever names them.
//!
//! | step | file |
//! |---|---|
//! | what can be drawn, and how often | `family` |
//! | noise, sampling and discs of a case | `conditions` |
//! | a sound rig with the gears of a nominal pair | `plant_of_pair` |
//! | which effects, how large, where | `generate`, `size` |
//! | driving the rig | `campaign` |
//! | the log without a trace of the draw | `log` |
//! | the label, sealed by a salted hash | `seal` |
//! | cases as files | `set` |
//! | asking the diagnosis | `query` |
//! | one answer against its label | `case_score`, `signature` |
//! | many answers: rates, calibration, power, coverage | `score`, `calibration` |
//! | the report | `report`, `page` |

pub mod calibration;
pub mod campaign;
pub mod case_score;
mod conditions;
#[cfg(test)]
mod convention_tests;
mod error;
pub mod family;
pub mod generate;
pub mod label;
pub mod log;
pub mod page;
pub mod plant_of_pair;
pub mod query;
pub mod report;
pub mod score;
pub mod seal;
pub mod set;
mod signature;
pub mod size;

pub use error::BlindError;
