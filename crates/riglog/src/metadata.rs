//! The metadata records of a rig log: what was run, and how counts become angles.

use std::{collections::BTreeMap, f64::consts::TAU};

use crate::error::LogError;

/// The keys and values of one metadata record.
pub type MetadataMap = BTreeMap<String, String>;

/// Metadata record with a salted hash of a label that is withheld, and its one key.
pub(crate) const SEALED: &str = "rig.sealed";
pub(crate) const SEALED_KEY: &str = "sha256";

/// Metadata record `rig.run`: what was run, where and by whom.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunMetadata {
    /// UUID of the run.
    pub run_id: String,
    /// When it was started, RFC 3339.
    pub started: String,
    /// Program and version.
    pub software: String,
    /// Name of the computer.
    pub host: String,
    /// `sim`, or the name of the profile.
    pub backend: String,
    /// Who ran it.
    pub operator: String,
    /// Free text.
    pub note: String,
    /// `ccw`, `cw` or `both`.
    pub direction: String,
    /// Load set-points in N·m, in the order of the runs.
    pub load_nm: Vec<f64>,
    /// Speed set-points in rpm, in the order of the runs.
    pub speed_rpm: Vec<f64>,
    /// Revolutions of the driver in a run; `None` where the file does not say.
    pub revolutions: Option<f64>,
}

impl RunMetadata {
    /// The record's name in the file.
    pub const NAME: &'static str = "rig.run";

    /// The record's content.
    pub fn to_map(&self) -> MetadataMap {
        let text = |value: &str| value.to_owned();
        [
            ("run_id", text(&self.run_id)),
            ("started", text(&self.started)),
            ("software", text(&self.software)),
            ("host", text(&self.host)),
            ("backend", text(&self.backend)),
            ("operator", text(&self.operator)),
            ("note", text(&self.note)),
            ("direction", text(&self.direction)),
            ("load_nm", join(&self.load_nm)),
            ("speed_rpm", join(&self.speed_rpm)),
            ("revolutions", self.revolutions.map_or_else(String::new, |n| n.to_string())),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
    }

    /// Reads a record. Nothing here is needed to understand the samples, so keys that are missing
    /// or hold no number come back empty instead of closing the file to its reader.
    pub fn from_map(map: &MetadataMap) -> Self {
        let text = |key: &str| map.get(key).cloned().unwrap_or_default();
        Self {
            run_id: text("run_id"),
            started: text("started"),
            software: text("software"),
            host: text("host"),
            backend: text("backend"),
            operator: text("operator"),
            note: text("note"),
            direction: text("direction"),
            load_nm: split(&text("load_nm")),
            speed_rpm: split(&text("speed_rpm")),
            revolutions: text("revolutions").trim().parse().ok(),
        }
    }
}

/// Metadata record `rig.encoders`: how counts become angles.
///
/// θ = sign · 2π · (counts − index_counts) / counts_per_rev, positive in the pair's ccw sense.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EncoderMetadata {
    /// Counts a revolution of the input encoder, after interpolation.
    pub input_counts_per_rev: u64,
    /// Counts a revolution of the output encoder, after interpolation.
    pub output_counts_per_rev: u64,
    /// Lines of the input encoder's disc.
    pub input_lines: u64,
    /// Lines of the output encoder's disc.
    pub output_lines: u64,
    /// Input counts at θ1 = 0.
    pub input_index_counts: i64,
    /// Output counts at θ2 = 0.
    pub output_index_counts: i64,
    /// +1 or −1: sense of the input counts against θ1.
    pub input_sign: i8,
    /// +1 or −1: sense of the output counts against θ2.
    pub output_sign: i8,
}

impl EncoderMetadata {
    /// The record's name in the file.
    pub const NAME: &'static str = "rig.encoders";

    /// The record's content.
    pub fn to_map(&self) -> MetadataMap {
        [
            ("input_counts_per_rev", self.input_counts_per_rev.to_string()),
            ("output_counts_per_rev", self.output_counts_per_rev.to_string()),
            ("input_lines", self.input_lines.to_string()),
            ("output_lines", self.output_lines.to_string()),
            ("input_index_counts", self.input_index_counts.to_string()),
            ("output_index_counts", self.output_index_counts.to_string()),
            ("input_sign", self.input_sign.to_string()),
            ("output_sign", self.output_sign.to_string()),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
    }

    /// Reads a record.
    ///
    /// # Errors
    /// A key is missing or holds something else than it must: angles would be wrong, so this one is strict.
    pub fn from_map(map: &MetadataMap) -> Result<Self, LogError> {
        Ok(Self {
            input_counts_per_rev: positive(map, "input_counts_per_rev")?,
            output_counts_per_rev: positive(map, "output_counts_per_rev")?,
            input_lines: positive(map, "input_lines")?,
            output_lines: positive(map, "output_lines")?,
            input_index_counts: whole(map, "input_index_counts", "a whole number")?,
            output_index_counts: whole(map, "output_index_counts", "a whole number")?,
            input_sign: sign(map, "input_sign")?,
            output_sign: sign(map, "output_sign")?,
        })
    }

    /// Counts of the input encoder to θ1.
    pub fn theta1(&self) -> AngleScale {
        AngleScale::new(self.input_sign, self.input_index_counts, self.input_counts_per_rev)
    }

    /// Counts of the output encoder to θ2.
    pub fn theta2(&self) -> AngleScale {
        AngleScale::new(self.output_sign, self.output_index_counts, self.output_counts_per_rev)
    }
}

/// Turns the counts of one encoder into the angle of its shaft. Whoever does so by this type gets
/// the same bits, live and on replay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleScale {
    signed_tau_rad: f64,
    counts_per_rev: f64,
    index_counts: i64,
}

impl AngleScale {
    fn new(sign: i8, index_counts: i64, counts_per_rev: u64) -> Self {
        Self { signed_tau_rad: f64::from(sign) * TAU, counts_per_rev: counts_per_rev as f64, index_counts }
    }

    /// The shaft's angle in rad: θ = sign · 2π · (counts − index_counts) / counts_per_rev.
    #[inline]
    pub fn angle_rad(&self, counts: i64) -> f64 {
        // Counts of a foreign file may span the whole range of i64.
        let from_index = counts.wrapping_sub(self.index_counts);
        self.signed_tau_rad * from_index as f64 / self.counts_per_rev
    }
}

fn whole(map: &MetadataMap, key: &'static str, expected: &'static str) -> Result<i64, LogError> {
    let value = map.get(key);
    value.and_then(|text| parse_whole(text)).ok_or_else(|| refusal(map, key, expected))
}

/// Other programs write whole numbers as `4096.0`; up to 2⁵³ that says the same.
fn parse_whole(text: &str) -> Option<i64> {
    const EXACT: f64 = 9_007_199_254_740_992.0;
    let text = text.trim();
    text.parse().ok().or_else(|| {
        let value: f64 = text.parse().ok()?;
        (value.fract() == 0.0 && value.abs() <= EXACT).then_some(value as i64)
    })
}

fn positive(map: &MetadataMap, key: &'static str) -> Result<u64, LogError> {
    const EXPECTED: &str = "a whole number of at least 1";
    let value = whole(map, key, EXPECTED)?;
    u64::try_from(value).ok().filter(|&n| n > 0).ok_or_else(|| refusal(map, key, EXPECTED))
}

fn sign(map: &MetadataMap, key: &'static str) -> Result<i8, LogError> {
    const EXPECTED: &str = "1 or -1";
    match whole(map, key, EXPECTED)? {
        1 => Ok(1),
        -1 => Ok(-1),
        _ => Err(refusal(map, key, EXPECTED)),
    }
}

fn refusal(map: &MetadataMap, key: &'static str, expected: &'static str) -> LogError {
    LogError::Metadata { record: EncoderMetadata::NAME, key, value: map.get(key).cloned(), expected }
}

/// Several set-points stand in one value, separated by commas; `{}` of an f64 reads back exactly.
fn join(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

fn split(text: &str) -> Vec<f64> {
    text.split(',').filter_map(|part| part.trim().parse().ok()).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Encoders of the kind that the simulated rig has.
    pub(crate) fn encoders() -> EncoderMetadata {
        EncoderMetadata {
            input_counts_per_rev: 7_200_000,
            output_counts_per_rev: 7_200_000,
            input_lines: 18_000,
            output_lines: 18_000,
            input_index_counts: 1234,
            output_index_counts: -77,
            input_sign: 1,
            output_sign: -1,
        }
    }

    #[test]
    fn encoders_come_back_as_they_went() {
        let encoders = encoders();
        assert_eq!(EncoderMetadata::from_map(&encoders.to_map()).unwrap(), encoders);
    }

    #[test]
    fn encoders_that_give_no_angle_are_refused_by_key_and_value() {
        for (key, value) in [
            ("input_counts_per_rev", "0"),
            ("output_lines", "-5"),
            ("input_sign", "2"),
            ("output_index_counts", "0.5"),
            ("input_lines", "many"),
        ] {
            let mut map = encoders().to_map();
            map.insert(key.into(), value.into());
            let text = EncoderMetadata::from_map(&map).unwrap_err().to_string();
            assert!(text.contains(key) && text.contains(value), "{text}");
            map.remove(key);
            let text = EncoderMetadata::from_map(&map).unwrap_err().to_string();
            assert!(text.contains(key) && text.contains("nothing"), "{text}");
        }
    }

    #[test]
    fn whole_numbers_written_as_decimals_are_taken() {
        let mut map = encoders().to_map();
        map.insert("input_sign".into(), "-1.0".into());
        assert_eq!(EncoderMetadata::from_map(&map).unwrap().input_sign, -1);
    }

    #[test]
    fn the_index_is_zero_and_a_revolution_is_two_pi() {
        let encoders = encoders();
        assert_eq!(encoders.theta1().angle_rad(1234), 0.0);
        assert_eq!(encoders.theta1().angle_rad(1234 + 7_200_000), TAU);
        assert_eq!(encoders.theta2().angle_rad(-77 + 7_200_000), -TAU);
    }

    proptest! {
        #[test]
        fn set_points_come_back_bit_by_bit(load_nm in prop::collection::vec(-1e6f64..1e6, 0..5), revs in 0.0f64..100.0) {
            let run = RunMetadata { load_nm, revolutions: Some(revs), ..Default::default() };
            prop_assert_eq!(RunMetadata::from_map(&run.to_map()), run);
        }
    }
}
