//! Benches for the daemon's device side, for tests alone: a cable with faults, and a stress test of a Modbus master on it.
//!
//! [`proxy`] passes bytes between a master and a device and harms them by a plan; [`bus_stress`] compares every value that the master
//! returns with what the device answered. The devices are the emulators of `rigsim`, the master is the daemon's.

pub mod bus_stress;
pub mod proxy;
