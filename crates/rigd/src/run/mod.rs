//! One run of the rig, from connecting to the finalised log.

pub mod acquire;
pub mod admission;
pub mod attend;
pub mod brake_sweep;
pub mod dialer;
pub mod halt;
pub mod job;
pub mod keys;
pub mod limits;
pub mod observer;
pub mod panic;
pub mod progress;
mod reconnect;
pub mod recorder;
pub mod registry;
pub mod rig;
pub mod senses;
pub mod sequence;
pub mod session;
pub mod set_up;
pub mod settle;
pub mod space;
pub mod stop;
pub mod stopping;
pub mod supervisor;

use gearmodel::Direction;

/// What a run shall measure.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Senses, in their order.
    pub directions: Vec<Direction>,
    /// Loads at the driven gear, N·m, in their order.
    pub loads_nm: Vec<f64>,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Whole revolutions of the driver to record, each.
    pub revolutions: f64,
    /// Sampling, Hz.
    pub rate_hz: f64,
    /// The operator accepts a drive that has no watchdog of its own.
    pub accept_no_watchdog: bool,
}
