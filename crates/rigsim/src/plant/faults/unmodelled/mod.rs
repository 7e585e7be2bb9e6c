//! Faults that the diagnosis shall not know by name: what it must call unknown. All displace the output's reading.

use super::fault::Fault;

mod mount;
mod transients;
mod waves;

/// All of them.
pub const UNMODELLED_FAULTS: &[Fault] = &[
    waves::THREE_JAW_DISTORTION,
    waves::HUB_DISTORTION,
    waves::PICKUP,
    waves::AIR_CONDITIONING,
    waves::BELT_DRIVE,
    waves::LOOSE_COUPLING,
    waves::KEYWAY,
    waves::GROWING_WOBBLE,
    waves::BIT_WEIGHT,
    mount::MOUNT_CREEP,
    transients::KNOCKS,
    transients::GLITCH_BURSTS,
    mount::SETTLING_SEAT,
];
