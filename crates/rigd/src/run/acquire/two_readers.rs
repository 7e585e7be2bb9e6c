//! What two readers lack that a counter box has: an index to be the zero, and one clock for both encoders.

use gearmodel::measure::AngleGrid;
use riglog::proto::Level;

use super::{Acquisition, Entry, Recording};
use crate::device::{Clocks, Zero};
use crate::summary::TimeSkew;

/// Zero and clocks of encoders that two readers read; of a counter box, an index and no clocks.
#[derive(Debug, Default)]
pub(super) struct TwoReaders {
    /// What the zero is taken from.
    pub(super) zero: Zero,
    /// The clocks, latest.
    clocks: Option<Clocks>,
    /// What they were worth in TE at the runs so far.
    skew: Option<TimeSkew>,
}

impl Acquisition {
    /// Whether the encoders' zero is an index that has to be looked for.
    #[must_use]
    pub fn has_index(&self) -> bool {
        self.readers.zero == Zero::Index
    }

    /// Takes the zero of encoders that have no index: once. What has lost it since cannot find it again, and `false` says so.
    #[must_use]
    pub fn home_without_index(&mut self) -> bool {
        if self.zero_written {
            return self.homed;
        }
        let (zero, said) = match self.readers.zero {
            Zero::Counts(counts) => (counts, "the profile says (counter.qsb.zero_counts)"),
            Zero::Begin | Zero::Index => (self.counts, "the run began"),
        };
        self.index_counts = zero.map(Some);
        self.home();
        let what = format!("these encoders have no index: both angles are zero at counts {zero:?}, where {said}");
        self.event(Level::Warning, "zero", what);
        true
    }

    /// What two readers' clocks are known to do now; within a run the least that was known of their skew counts.
    pub fn note_clocks(&mut self, clocks: Option<Clocks>) {
        let Some(mut clocks) = clocks else { return };
        if let (Recording::Active { .. }, Some(before)) = (&self.recording, self.readers.clocks) {
            clocks.skew.uncertainty_s = clocks.skew.uncertainty_s.max(before.skew.uncertainty_s);
        }
        self.readers.clocks = Some(clocks);
    }

    /// What two readers' clocks were worth in TE, at the worst of the runs so far.
    #[must_use]
    pub fn time_skew(&self) -> Option<TimeSkew> {
        self.readers.skew
    }

    /// Books what two readers' clocks are worth in TE at a run, in metadata `rig.clocks` too.
    pub(super) fn book_clocks(&mut self) {
        let Some(clocks) = self.readers.clocks else { return };
        let pair = &self.analysis.model().pair;
        let grid = AngleGrid::default();
        let steepest = (0..grid.bins()).map(|bin| pair.ratio(grid.centre(bin)).abs()).fold(0.0, f64::max);
        let te_rad = clocks.skew.te_uncertainty_rad(self.status.speed_setpoint_rpm, steepest);
        let worst = self.readers.skew.map_or(0.0, |skew| skew.te_uncertainty_rad).max(te_rad);
        let skew = TimeSkew {
            uncertainty_s: clocks.skew.uncertainty_s,
            te_uncertainty_rad: worst,
            drift_ppm: clocks.drift_ppm,
            refused_lines: clocks.refused,
        };
        self.readers.skew = Some(skew);
        let map = [
            ("input_drift_ppm", clocks.drift_ppm[0].to_string()),
            ("output_drift_ppm", clocks.drift_ppm[1].to_string()),
            ("skew_uncertainty_s", clocks.skew.uncertainty_s.to_string()),
            ("te_uncertainty_rad", worst.to_string()),
            ("speed_rpm", self.status.speed_setpoint_rpm.to_string()),
            ("input_refused_lines", clocks.refused[0].to_string()),
            ("output_refused_lines", clocks.refused[1].to_string()),
        ];
        let map = map.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        let now = self.clock.now_ns();
        self.recorder.write(now, now, Entry::Metadata("rig.clocks", map));
    }
}
