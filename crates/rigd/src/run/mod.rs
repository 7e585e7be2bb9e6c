//! One run of the rig, from connecting to the finalised log.

pub mod acquire;
pub mod admission;
pub mod brake_sweep;
pub mod connected_rig;
pub mod dialer;
pub mod job;
pub mod keys;
pub mod limits;
pub mod observer;
pub mod panic;
pub mod plan;
pub mod progress;
mod reconnect;
pub mod recorder;
pub mod registry;
pub mod run_job;
pub mod senses;
pub mod sequence;
pub mod session;
pub mod set_up;
pub mod settle;
pub mod space;
pub mod stop;
pub mod stop_reason;
pub mod stopping;
pub mod supervisor;
