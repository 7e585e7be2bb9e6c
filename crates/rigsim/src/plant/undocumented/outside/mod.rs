//! Effects that the diagnosis shall not know by name: what it must call unknown.

use super::{Parameters, Undocumented};
use crate::plant::{Carrier, Oddity, Weight};

pub mod air_conditioning;
pub mod belt_drive;
pub mod bit_weight;
pub mod glitch_bursts;
pub mod growing_wobble;
pub mod hub_distortion;
pub mod keyway;
pub mod knocks;
pub mod loose_coupling;
pub mod mount_creep;
pub mod pickup;
pub mod settling_seat;
pub mod three_jaw_distortion;

/// All of them.
pub const OUTSIDE: &[Undocumented] = &[
    three_jaw_distortion::EFFECT,
    hub_distortion::EFFECT,
    pickup::EFFECT,
    air_conditioning::EFFECT,
    belt_drive::EFFECT,
    loose_coupling::EFFECT,
    keyway::EFFECT,
    growing_wobble::EFFECT,
    bit_weight::EFFECT,
    mount_creep::EFFECT,
    knocks::EFFECT,
    glitch_bursts::EFFECT,
    settling_seat::EFFECT,
];

/// A wave of an effect's own size `a_rad` and phase `phase_rad`.
fn wave(parameters: &Parameters, carrier: Carrier, order: f64, weight: Weight) -> Oddity {
    Oddity::Wave {
        carrier,
        order,
        amplitude_rad: parameters.number("a_rad"),
        phase_rad: parameters.number("phase_rad"),
        weight,
        square: false,
    }
}
