//! The output encoder's mount and seat: one creeps, the other settles after a reversal.

use crate::plant::faults::fault::Fault;
use crate::plant::faults::parameters::Parameters;
use crate::plant::reading_error::ReadingError;

/// The output encoder's mount creeps steadily, turning or not.
pub const MOUNT_CREEP: Fault = Fault {
    name: "mount_creep",
    summary: "output encoder's mount creeps 0.2 µrad a second",
    usual: |_| Parameters::of(&[("rad_per_s", 2e-7)]),
    vary: |_, usual, rng| usual.times("rad_per_s", rng.sign()),
    amounts: &[("rad_per_s", 1.0)],
    develops: true,
    signature: None,
    same_trace_as: None,
    apply: |spec, parameters| {
        spec.reading_errors.push(ReadingError::Drift { rad_per_s: parameters.number("rad_per_s") });
    },
};

/// After a reversal into one sense the output encoder's seat settles over a turn or two; after the other it does not.
pub const SETTLING_SEAT: Fault = Fault {
    name: "settling_seat",
    summary: "encoder's seat settles after reversals to cw",
    usual: |_| Parameters::of(&[("a_rad", 1e-4), ("travel_rad", 9.0), ("sense", -1.0)]),
    vary: |_, usual, rng| {
        usual.times("a_rad", rng.sign()).with("travel_rad", rng.spread(5.0, 15.0)).with("sense", rng.sign())
    },
    amounts: &[("a_rad", 1.0)],
    develops: true,
    signature: None,
    same_trace_as: None,
    apply: |spec, parameters| {
        spec.reading_errors.push(ReadingError::Settling {
            sense: parameters.number("sense"),
            size_rad: parameters.number("a_rad"),
            travel_rad: parameters.number("travel_rad"),
        });
    },
};
