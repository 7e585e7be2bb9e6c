//! `blindtest` makes withheld data, campaigns on the simulated rig whose faults nobody is told, and scores whoever names them. It
//! stands where both sides meet: on `rigsim`, whose faults it draws and whose truths it seals, on `riglog`, in whose logs they come,
//! and on `diagnosis`, which it asks by the way that people take; `gearmodel` gives it the nominal pair and nothing of its effects.
//! Above it, `rigd` has it behind `rigd sim --withhold` and `rigd blindtest`.
//!
//! | step | file |
//! |---|---|
//! | what can be drawn, and how often | [`family`] |
//! | noise, sampling and discs of a case | `conditions` |
//! | a sound rig with the gears of a nominal pair | [`plant_of_pair`] |
//! | which effects, how large, where | [`generate`], [`size`] |
//! | driving the rig | [`campaign`] |
//! | the log without a trace of the draw | [`mod@log`] |
//! | the truth, sealed by a salted hash | [`label`], [`seal`] |
//! | cases as files | [`set`] |
//! | asking the diagnosis | [`query`] |
//! | one answer against its label | [`case_score`], `signature` |
//! | many answers: rates, calibration, power, coverage | [`score`], [`calibration`] |
//! | the report | [`report`], [`page`] |

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
