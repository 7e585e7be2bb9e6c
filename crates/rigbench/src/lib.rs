//! `rigbench` is what the daemon's device side is tested on, and is for tests alone: nothing depends on it. It stands on `rigd`,
//! whose Modbus master it drives, and on `rigsim`, whose devices answer: [`proxy`] passes bytes between the two and harms them by a
//! plan, [`bus_stress`] compares every value that the master returns with what the device answered.

pub mod bus_stress;
pub mod proxy;
