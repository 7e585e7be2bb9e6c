//! Both encoders: what their counts are as angles, and where their zero is, by an index or without one.

use gearmodel::GearPair;
use riglog::proto::Level;
use riglog::{AngleScale, EncoderMetadata};
use wire::{SampleFlags, Samples};

use crate::device::{CounterIdentity, DeviceError, DeviceKind, Zero};

/// An index that comes back further off than this part of a line is not the same index: counts were lost, or a disc has slipped.
const INDEX_TOLERANCE_LINES: f64 = 0.25;

/// The encoders, as messages call them.
const NAMES: [&str; 2] = ["input", "output"];

/// Both encoders.
pub(super) struct Encoders {
    metadata: EncoderMetadata,
    theta1: AngleScale,
    theta2: AngleScale,
    /// What the zero is taken from.
    zero: Zero,
    homed: bool,
    /// The encoders' metadata are in the log, so that the index has to stay at the counts that they say.
    zero_written: bool,
    /// Logged counts minus the counter's own.
    counts_offset: [i64; 2],
    /// Last counts.
    counts: [i64; 2],
    /// Index latches: seen, and the counter value there.
    index_counts: [Option<i64>; 2],
    /// How far each disc is turned on its shaft, deg.
    mounted_deg: [f64; 2],
}

/// What a homing found, for the log.
#[derive(Debug, Default)]
pub(super) struct Homed {
    /// Of each index that came by again.
    pub checks: Vec<(Level, String)>,
    /// The first time: what the log says of the encoders from now on.
    pub metadata: Option<EncoderMetadata>,
}

impl Default for Encoders {
    /// Counts as they come until the counter has said what they are.
    fn default() -> Self {
        let metadata = EncoderMetadata {
            input_counts_per_rev: 1,
            output_counts_per_rev: 1,
            input_lines: 1,
            output_lines: 1,
            input_index_counts: 0,
            output_index_counts: 0,
            input_sign: 1,
            output_sign: 1,
        };
        Self {
            theta1: metadata.theta1(),
            theta2: metadata.theta2(),
            metadata,
            zero: Zero::Index,
            homed: false,
            zero_written: false,
            counts_offset: [0; 2],
            counts: [0; 2],
            index_counts: [None; 2],
            mounted_deg: [0.0; 2],
        }
    }
}

impl Encoders {
    /// As the counter describes them; before the stream starts. Those of a counter that comes back must be the same.
    ///
    /// # Errors
    /// [`DeviceError::Unexpected`] for another counter or another encoder than the log was begun with.
    pub fn describe(&mut self, identity: &CounterIdentity, signs: [i8; 2], port: &str) -> Result<(), DeviceError> {
        if self.zero_written {
            let known = [self.metadata.input_counts_per_rev, self.metadata.output_counts_per_rev];
            if known == identity.counts_per_rev {
                return Ok(());
            }
            return Err(DeviceError::Unexpected {
                device: DeviceKind::Counter,
                port: port.to_owned(),
                found: format!("{:?} counts a revolution", identity.counts_per_rev),
                expected: format!("{known:?}, as when the log was begun (begin a new one for other encoders)"),
            });
        }
        self.zero = identity.zero;
        self.metadata = EncoderMetadata {
            input_counts_per_rev: identity.counts_per_rev[0],
            output_counts_per_rev: identity.counts_per_rev[1],
            input_lines: u64::from(identity.lines[0]),
            output_lines: u64::from(identity.lines[1]),
            input_index_counts: 0,
            output_index_counts: 0,
            input_sign: signs[0],
            output_sign: signs[1],
        };
        self.rescale();
        Ok(())
    }

    /// The discs are turned on their shafts by this, deg: their indices pass so much later than usual.
    pub fn mount(&mut self, mounted_deg: [f64; 2]) {
        self.mounted_deg = mounted_deg;
    }

    fn rescale(&mut self) {
        self.theta1 = self.metadata.theta1();
        self.theta2 = self.metadata.theta2();
    }

    /// What the log says of them, once it does.
    pub fn written(&self) -> Option<EncoderMetadata> {
        self.zero_written.then_some(self.metadata)
    }

    /// The zero of both angles is known.
    pub fn is_homed(&self) -> bool {
        self.homed
    }

    /// The zero is an index that has to be looked for.
    pub fn has_index(&self) -> bool {
        self.zero == Zero::Index
    }

    /// θ1 of these counts, rad.
    pub fn theta1_rad(&self, counts: i64) -> f64 {
        self.theta1.angle_rad(counts)
    }

    /// θ2 of these counts, rad.
    pub fn theta2_rad(&self, counts: i64) -> f64 {
        self.theta2.angle_rad(counts)
    }

    /// Both angles at the last counts, rad.
    pub fn angles_rad(&self) -> [f64; 2] {
        [self.theta1_rad(self.counts[0]), self.theta2_rad(self.counts[1])]
    }

    /// Turns of the driver, + = ccw, that so many counts of the input are; `None` while nobody knows.
    pub fn input_turns(&self, counts: i64) -> Option<f64> {
        let per_rev = self.metadata.input_counts_per_rev;
        (per_rev != 0).then(|| counts as f64 * f64::from(self.metadata.input_sign) / per_rev as f64)
    }

    /// Counts of the counter are logged so much higher.
    pub fn counts_offset(&self) -> [i64; 2] {
        self.counts_offset
    }

    /// The last counts of a batch, as logged.
    pub fn stand_at(&mut self, counts: [i64; 2]) {
        self.counts = counts;
    }

    /// Takes the indices that passed before a batch.
    pub fn latch(&mut self, batch: &Samples) {
        for (which, seen, counts) in [
            (0, batch.flags.has(SampleFlags::INPUT_INDEX), batch.input_index_counts),
            (1, batch.flags.has(SampleFlags::OUTPUT_INDEX), batch.output_index_counts),
        ] {
            if seen {
                self.index_counts[which] = Some(counts.wrapping_add(self.counts_offset[which]));
            }
        }
    }

    /// Both index pulses have been seen.
    pub fn index_seen(&self) -> bool {
        self.index_counts.iter().all(Option::is_some)
    }

    /// The encoder whose index has not been seen.
    pub fn missing_index(&self) -> Option<&'static str> {
        NAMES.into_iter().zip(self.index_counts).find(|(_, latched)| latched.is_none()).map(|(which, _)| which)
    }

    /// Forgets the index: one that passed before counts were lost is no zero.
    pub fn forget_index(&mut self) {
        self.index_counts = [None; 2];
        self.homed = false;
    }

    /// Puts an index where encoders that have none are at zero, and says where that is; `None` once they have a zero, for what has lost
    /// it since cannot find it again.
    pub fn assume_index(&mut self) -> Option<String> {
        if self.zero_written {
            return None;
        }
        let (zero, said) = match self.zero {
            Zero::Counts(counts) => (counts, "the profile says (counter.qsb.zero_counts)"),
            Zero::Begin | Zero::Index => (self.counts, "the run began"),
        };
        self.index_counts = zero.map(Some);
        Some(format!("these encoders have no index: both angles are zero at counts {zero:?}, where {said}"))
    }

    /// Takes the index as zero of both angles; from the second time on the index is checked against the first, and stays where the log
    /// says that it is. `None` where an index has not been seen.
    ///
    /// The driven gear's index repeats every turn; the turn is taken that puts TE within half a turn of zero.
    pub fn home(&mut self, pair: &GearPair) -> Option<Homed> {
        let [Some(input), Some(output)] = self.index_counts else { return None };
        let usual = [self.usual_index(0, input), self.usual_index(1, output)];
        let mut homed = Homed::default();
        if self.zero_written {
            homed.checks = self.check_index(usual);
        } else {
            [self.metadata.input_index_counts, self.metadata.output_index_counts] = usual;
        }
        self.rescale();
        let [theta1, theta2] = self.angles_rad();
        let turns = ((theta2 - pair.theta2(theta1)) / std::f64::consts::TAU).round() as i64;
        let turned = turns * i64::from(self.metadata.output_sign) * self.metadata.output_counts_per_rev as i64;
        self.homed = true;
        if self.zero_written {
            self.shift(1, -turned);
            return Some(homed);
        }
        self.metadata.output_index_counts += turned;
        self.rescale();
        self.zero_written = true;
        homed.metadata = Some(self.metadata);
        Some(homed)
    }

    /// Latched counts of an index as they would be with the disc in its usual place.
    ///
    /// A disc turned by φ passes its index where the shaft stands at φ, so that θ = sign · 2π · (counts − index) / n + φ.
    fn usual_index(&self, which: usize, latched: i64) -> i64 {
        let (sign, counts_per_rev) = match which {
            0 => (self.metadata.input_sign, self.metadata.input_counts_per_rev),
            _ => (self.metadata.output_sign, self.metadata.output_counts_per_rev),
        };
        latched - (f64::from(sign) * self.mounted_deg[which] / 360.0 * counts_per_rev as f64).round() as i64
    }

    /// Where the indices are now against where the log says: within a fraction of a line the zero stays as it was; anything else
    /// moves the counts, so that the index stays at its counts and the angles keep their meaning.
    fn check_index(&mut self, latched: [i64; 2]) -> Vec<(Level, String)> {
        let encoders = self.metadata;
        let known = [
            (encoders.input_index_counts, encoders.input_counts_per_rev, encoders.input_lines),
            (encoders.output_index_counts, encoders.output_counts_per_rev, encoders.output_lines),
        ];
        let mut said = Vec::new();
        for (which, (name, (index, per_rev, lines))) in NAMES.into_iter().zip(known).enumerate() {
            let off = (latched[which] - index).rem_euclid(per_rev as i64);
            let off = if off > per_rev as i64 / 2 { off - per_rev as i64 } else { off };
            let tolerance = INDEX_TOLERANCE_LINES * per_rev as f64 / lines.max(1) as f64;
            let arcsec = off as f64 / per_rev as f64 * 1_296_000.0;
            if off.unsigned_abs() as f64 <= tolerance {
                let what = format!("{name} encoder: index at its place, {off} counts ({arcsec:.2} arcsec) off");
                said.push((Level::Info, what));
                continue;
            }
            self.shift(which, -off);
            let what = format!(
                "{name} encoder: index {off} counts ({arcsec:.1} arcsec) off; the counts are moved so that it stays at its place (the counter began anew, counts were lost, or the disc has slipped)"
            );
            said.push((Level::Warning, what));
        }
        said
    }

    /// Moves an encoder's logged counts from here on.
    fn shift(&mut self, which: usize, by: i64) {
        self.counts_offset[which] += by;
        self.counts[which] += by;
        self.index_counts[which] = self.index_counts[which].map(|counts| counts + by);
    }
}
