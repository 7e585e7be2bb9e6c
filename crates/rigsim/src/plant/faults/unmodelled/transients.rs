//! Events that pass: knocks that ring out, bursts of wrong readings.

use crate::plant::faults::fault::Fault;
use crate::plant::faults::parameters::Parameters;
use crate::plant::reading_error::ReadingError;

/// Somebody knocks against the rig now and then; the mount of the output encoder rings out.
pub const KNOCKS: Fault = Fault {
    name: "knocks",
    summary: "knocks against the rig, ringing out",
    usual: |_| Parameters::of(&[("a_rad", 4e-4), ("per_minute", 4.0), ("decay_s", 0.2), ("ring_hz", 6.0)]),
    vary: |_, usual, rng| {
        usual
            .with("per_minute", rng.spread(2.0, 8.0))
            .with("decay_s", rng.spread(0.1, 0.5))
            .with("ring_hz", rng.spread(2.0, 12.0))
    },
    amounts: &[("a_rad", 1.0)],
    develops: true,
    signature: None,
    same_trace_as: None,
    apply: |spec, parameters| {
        spec.reading_errors.push(ReadingError::Knocks {
            per_minute: parameters.number("per_minute"),
            size_rad: parameters.number("a_rad"),
            decay_s: parameters.number("decay_s"),
            ring_hz: parameters.number("ring_hz"),
        });
    },
};

/// The output's interpolator loses its lock for moments: bursts of wrong readings.
pub const GLITCH_BURSTS: Fault = Fault {
    name: "glitch_bursts",
    summary: "bursts of wrong readings",
    usual: |_| Parameters::of(&[("a_rad", 3e-4), ("per_minute", 4.0), ("length_s", 0.2)]),
    vary: |_, usual, rng| usual.with("per_minute", rng.spread(2.0, 8.0)).with("length_s", rng.spread(0.05, 0.3)),
    amounts: &[("a_rad", 1.0)],
    develops: true,
    signature: None,
    same_trace_as: None,
    apply: |spec, parameters| {
        spec.reading_errors.push(ReadingError::Bursts {
            per_minute: parameters.number("per_minute"),
            length_s: parameters.number("length_s"),
            size_rad: parameters.number("a_rad"),
        });
    },
};
