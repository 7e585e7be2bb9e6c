//! Counters that latch late or miss edges.

use super::fault::Fault;
use super::parameters::Parameters;
use super::signature::Signature;

/// The output encoder is latched later than the input, by two readers with a clock each or by a filter in one of them: 60 µs,
/// 31 µrad at 5 rpm and a ratio of 1.
pub const TIME_SKEW: Fault = Fault {
    name: "time_skew",
    summary: "output latched 60 µs late",
    usual: |_| Parameters::of(&[("dt_s", 60e-6)]),
    vary: |_, usual, rng| usual.times("dt_s", rng.sign()),
    amounts: &[("dt_s", 1.0)],
    develops: false,
    signature: Some(Signature { speed_exponent: Some(1.0), ..Signature::STEADY_ODD }),
    same_trace_as: None,
    apply: |spec, parameters| spec.encoders.time_skew_s += parameters.number("dt_s"),
};

/// The output's counter misses edges now and then, always to the same side: 24 counts (21 µrad) at random, 0.7 times a driver
/// revolution.
pub const COUNT_LOSS: Fault = Fault {
    name: "count_loss",
    summary: "output counter loses 24 counts about every 1.4 revolutions",
    usual: |_| Parameters::of(&[("counts", 24.0), ("per_rev", 0.7)]),
    vary: |_, usual, rng| usual.times("counts", rng.sign()).with("per_rev", rng.spread(0.1, 1.0)),
    amounts: &[("counts", 1.0)],
    develops: true,
    signature: None,
    same_trace_as: None,
    apply: |spec, parameters| {
        let loss = &mut spec.encoders.output_count_loss;
        loss.losses_per_rev = parameters.number("per_rev");
        // A counter loses whole counts.
        let counts = parameters.number("counts");
        loss.counts = counts.abs().max(1.0).round().copysign(counts) as i64;
    },
};
