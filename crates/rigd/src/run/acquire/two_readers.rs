//! What two readers lack that a counter box has: one clock for both encoders.

use gearmodel::GearPair;
use gearmodel::measure::AngleGrid;
use riglog::MetadataMap;

use crate::device::Clocks;
use crate::summary::TimeSkew;

/// Clocks of encoders that two readers read; of a counter box, none.
#[derive(Debug, Default)]
pub(super) struct TwoReaders {
    /// The clocks, latest.
    clocks: Option<Clocks>,
    /// What they were worth in TE at the runs so far.
    skew: Option<TimeSkew>,
}

impl TwoReaders {
    /// What the clocks are known to do now; within a run the least that was known of their skew counts.
    pub fn note(&mut self, clocks: Option<Clocks>, within_run: bool) {
        let Some(mut clocks) = clocks else { return };
        if let (true, Some(before)) = (within_run, self.clocks) {
            clocks.skew.uncertainty_s = clocks.skew.uncertainty_s.max(before.skew.uncertainty_s);
        }
        self.clocks = Some(clocks);
    }

    /// What the clocks were worth in TE, at the worst of the runs so far.
    pub fn time_skew(&self) -> Option<TimeSkew> {
        self.skew
    }

    /// Books what the clocks are worth in TE at a run of this speed; also as metadata `rig.clocks`.
    pub fn book(&mut self, pair: &GearPair, speed_rpm: f64) -> Option<MetadataMap> {
        let clocks = self.clocks?;
        let grid = AngleGrid::default();
        let steepest = (0..grid.bins()).map(|bin| pair.ratio(grid.centre(bin)).abs()).fold(0.0, f64::max);
        let te_rad = clocks.skew.te_uncertainty_rad(speed_rpm, steepest);
        let worst = self.skew.map_or(0.0, |skew| skew.te_uncertainty_rad).max(te_rad);
        self.skew = Some(TimeSkew {
            uncertainty_s: clocks.skew.uncertainty_s,
            te_uncertainty_rad: worst,
            drift_ppm: clocks.drift_ppm,
            refused_lines: clocks.refused,
        });
        let map = [
            ("input_drift_ppm", clocks.drift_ppm[0].to_string()),
            ("output_drift_ppm", clocks.drift_ppm[1].to_string()),
            ("skew_uncertainty_s", clocks.skew.uncertainty_s.to_string()),
            ("te_uncertainty_rad", worst.to_string()),
            ("speed_rpm", speed_rpm.to_string()),
            ("input_refused_lines", clocks.refused[0].to_string()),
            ("output_refused_lines", clocks.refused[1].to_string()),
        ];
        Some(map.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
    }
}
