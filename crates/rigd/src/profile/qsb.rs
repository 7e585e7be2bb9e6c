//! What a profile says of two QSB readers: section `[counter.qsb]`.

use serde::{Deserialize, Serialize};

use super::CounterProfile;

/// A profile to start from.
pub const QSB_PROFILE: &str = include_str!("qsb.toml");

/// Its driver's name.
pub const DRIVER: &str = "qsb";

/// Two readers, one a serial line; `counter.port` is the input's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QsbProfile {
    /// Port of the output's reader.
    pub output_port: String,
    /// Cycles a revolution of input and output encoder.
    pub lines: [u32; 2],
    /// Counts a cycle: 1, 2 or 4.
    pub quadrature: u8,
    /// A line every so many 1/512 s.
    #[serde(default = "interval_ticks")]
    pub interval_ticks: u16,
    /// By how much the shortest ways of the two readers' lines to the host may differ, ms: a USB frame.
    #[serde(default = "transit_difference_ms")]
    pub transit_difference_ms: f64,
    /// Counts of both readers where both angles are zero, since the readers were switched on. Left out, a run's zero is where it begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zero_counts: Option<[i64; 2]>,
}

fn interval_ticks() -> u16 {
    1
}

fn transit_difference_ms() -> f64 {
    1.0
}

impl QsbProfile {
    /// Counts a revolution of both encoders.
    #[must_use]
    pub fn counts_per_rev(&self) -> [u64; 2] {
        self.lines.map(|lines| u64::from(lines) * u64::from(self.quadrature))
    }

    /// Lines a second.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        512.0 / f64::from(self.interval_ticks.max(1))
    }
}

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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::check::faults;
    use super::*;

    #[test]
    fn the_shipped_profile_has_no_fault_and_states_its_source() {
        assert_eq!(faults(QSB_PROFILE, Path::new("qsb.toml")), []);
        let profile = super::super::Profile::parse(QSB_PROFILE, Path::new("qsb.toml")).expect("a profile");
        assert!(profile.source.contains("QSB command list"), "{}", profile.source);
        let qsb = profile.counter.qsb.as_ref().expect("readers");
        assert_eq!((qsb.counts_per_rev(), qsb.rate_hz()), ([40_000; 2], 512.0));
        assert_eq!(super::super::Profile::parse(&profile.to_toml(), Path::new("x")).expect("own TOML"), profile);
    }

    #[test]
    fn every_wrong_value_is_told_with_its_key() {
        let output = "output_port = \"/dev/serial/by-id/usb-qsb-output\"";
        for (from, to, key) in [
            ("quadrature = 4", "quadrature = 3", "counter.qsb.quadrature"),
            ("interval_ticks = 1", "interval_ticks = 0", "counter.qsb.interval_ticks"),
            ("lines = [10000, 10000]", "lines = [10000, 0]", "counter.qsb.lines"),
            ("transit_difference_ms = 1.0", "transit_difference_ms = -1.0", "counter.qsb.transit_difference_ms"),
            ("# zero_counts = [0, 0]", "zero_counts = [0, 9000000000]", "counter.qsb.zero_counts"),
            (output, "output_port = \"/dev/serial/by-id/usb-qsb-input\"", "counter.qsb.output_port"),
            (output, "output_port = \"sim\"", "counter.qsb.output_port"),
            ("driver = \"qsb\"", "driver = \"counter-box\"", "counter.qsb"),
        ] {
            let text = QSB_PROFILE.replacen(from, to, 1);
            assert_ne!(text, QSB_PROFILE, "{from}");
            let found = faults(&text, Path::new("qsb.toml"));
            assert!(found.len() == 1 && found[0].key == key && found[0].line > 1, "{to}: {found:?}");
        }
    }
}
