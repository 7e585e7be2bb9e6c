//! The output encoder is latched later than the input: two readers with a clock each, or a filter in one of them.

use super::super::PlantSpec;

/// Latches the output 60 µs late, 31 µrad at 5 rpm and a ratio of 1.
pub fn apply(spec: &mut PlantSpec) {
    spec.encoders.time_skew_s = 60e-6;
}
