//! The simulated rig: a plant in the time domain behind emulated devices that answer the real devices' bytes.
//!
//! [`plant`] is the physics and shares no code with the model that is checked against it: this crate depends on no crate that
//! knows one, which continuous integration checks. [`emulator`] speaks the devices' languages; [`simulated_rig`] holds both on one clock;
//! [`serve`] carries their bytes over pipes in a process or, with [`pty`], over terminals that any master can open.

pub mod commands;
pub mod emulator;
pub mod plant;
pub mod pty;
pub mod serve;
pub mod shaft_record;
pub mod simulated_rig;
pub mod starter;
