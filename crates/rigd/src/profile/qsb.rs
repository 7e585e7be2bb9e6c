//! Two QSB readers in a profile: section `[counter.qsb]`, and what may be wrong with it.

use super::devices::CounterProfile;

/// A profile to start from.
pub const QSB_PROFILE: &str = include_str!("qsb.toml");

/// Its driver's name.
pub const DRIVER: &str = "qsb";

/// What is wrong with a counter's readers: key within `[counter]`, and what about it.
#[must_use]
pub fn faults(counter: &CounterProfile, taken: &[&str]) -> Vec<(&'static str, String)> {
    let qsb = match (&counter.qsb, counter.driver == DRIVER) {
        (None, false) => return Vec::new(),
        (Some(_), false) => return vec![("qsb", format!("goes with driver = \"{DRIVER}\" only"))],
        (None, true) => {
            let what = "is missing; for instance [counter.qsb] with output_port = \"/dev/ttyUSB3\", lines = [10000, 10000], quadrature = 4";
            return vec![("qsb", what.into())];
        }
        (Some(qsb), true) => qsb,
    };
    let mut faults = Vec::new();
    let mut refuse = |key, what: String| faults.push((key, what));
    if counter.port == "sim" || qsb.output_port == "sim" {
        let what = "= \"sim\" has a counter box; `rigd sim --qsb` serves two readers on ports of their own";
        refuse(if counter.port == "sim" { "port" } else { "qsb.output_port" }, what.into());
    } else if taken.contains(&qsb.output_port.as_str()) {
        refuse(
            "qsb.output_port",
            format!("= {:?} is also another device's: a reader has a line of its own", qsb.output_port),
        );
    }
    for lines in qsb.lines {
        if !(1..=10_000_000).contains(&lines) {
            refuse("qsb.lines", format!("= {lines} must be from 1 to 10000000 cycles a revolution"));
        }
    }
    if !matches!(qsb.quadrature, 1 | 2 | 4) {
        refuse("qsb.quadrature", format!("= {} must be 1, 2 or 4 counts a cycle", qsb.quadrature));
    }
    if !(1..=64).contains(&qsb.interval_ticks) {
        refuse(
            "qsb.interval_ticks",
            format!("= {} must be from 1 to 64 (512 to 8 lines a second)", qsb.interval_ticks),
        );
    }
    if !(0.0..=50.0).contains(&qsb.transit_difference_ms) {
        refuse("qsb.transit_difference_ms", format!("= {} must be from 0 to 50 ms", qsb.transit_difference_ms));
    }
    for counts in qsb.zero_counts.into_iter().flatten() {
        if i32::try_from(counts).is_err() {
            refuse("qsb.zero_counts", format!("= {counts} is beyond a reader's 32 bits"));
        }
    }
    faults
}
