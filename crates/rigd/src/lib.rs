//! The rig's daemon: drives servo and brake, records both encoders without losing a sample, and computes live transmission
//! error and backlash.
//!
//! Reading order: [`cli`] (what a person asks for) → [`run`] (a session from connecting to the finalised log) → [`device`]
//! (drivers) over [`link`] (bytes) → [`analysis`] (TE and backlash, the same for live and replay) → [`summary`], [`plot`].
//! [`simulated`] puts the rig of the crate `rigsim`, which answers the same bytes, in the place of a real one.

pub mod analysis;
pub mod calibration;
pub mod campaign;
pub mod chart;
pub mod cli;
pub mod clock;
pub mod device;
pub mod doctor;
pub mod link;
pub mod plot;
pub mod present;
pub mod profile;
pub mod quantity;
pub mod replay;
pub mod run;
pub mod service;
pub mod simulated;
pub mod summary;
