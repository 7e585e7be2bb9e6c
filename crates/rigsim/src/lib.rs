//! `rigsim` is the simulated rig: a plant in the time domain behind emulated devices that answer the real devices' bytes. It
//! stands on `wire` alone and on no crate that knows the gear model or its diagnosis, so that plant and model can agree only by
//! being right; continuous integration checks this with `cargo tree`. Above it, `rigd` puts it in the place of a real rig,
//! `blindtest` draws withheld faults on it, and `rigbench` borrows its devices.
//!
//! | part | module |
//! |---|---|
//! | physics, and the faults that the nominal model does not know | [`plant`] |
//! | devices in the languages of the real ones | [`emulator`] |
//! | plant and devices on one clock, and hands on them | [`simulated_rig`], [`commands`] |
//! | their bytes over pipes in a process or terminals that any master can open | [`serve`], [`pty`] |
//! | a table of the true shaft speeds | [`shaft_record`] |
//! | the run that started the process | [`starter`] |

pub mod commands;
pub mod emulator;
pub mod plant;
pub mod pty;
pub mod serve;
pub mod shaft_record;
pub mod simulated_rig;
pub mod starter;
