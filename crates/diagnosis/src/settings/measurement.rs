//! Of what is measured: samples, lines, bins, and what is taken off before anything is fitted.

use std::f64::consts::TAU;

use serde::Serialize;

use super::setting::{Kind, RESOLUTION, SIMULATED, Setting};

settings! {
    /// Samples → points → runs.
    ReductionSettings {
        /// Part of the driver's turn over which samples are averaged to a point.
        segment_rad: f64 = TAU / 1440.0, "rad", RESOLUTION;
        /// Fewest points of a diagnosis.
        fewest_points: usize = 60, "", RESOLUTION;
        /// Loads and speeds nearer to one another than this part of the largest are one.
        same_level: f64 = 0.02, "", RESOLUTION;
        /// Two pieces of a run are joined where the second begins within this of where the first ended,
        joined_step_rad: f64 = 0.02, "rad", RESOLUTION;
        /// and the driver would not have come further than this in the pause between them.
        joined_pause_rad: f64 = 0.04, "rad", RESOLUTION;
        /// The driver's speed at a point is taken over this on either side of it.
        speed_window_rad: f64 = TAU / 100.0, "rad", RESOLUTION;
        /// Off the run's mean by more than this part, it is a pause or a gap and says nothing.
        speed_off: f64 = 0.5, "", RESOLUTION;
    }
}

settings! {
    /// The encoders' lines: their number and the errors within them.
    LineSettings {
        /// Steps of an angle looked at for its counts a revolution.
        counts_looked_at: usize = 4000, "", RESOLUTION;
        /// Fewest of them.
        counts_fewest: usize = 20, "", RESOLUTION;
        /// A measure that the steps miss by more than this part of itself is none.
        counts_off: f64 = 0.1, "", SIMULATED;
        /// Fewest lines looked for; teeth and their harmonics lie below.
        fewest: usize = 700, "", SIMULATED;
        /// Log odds, over all numbers looked for, from which a peak is taken for a disc's lines.
        found_nats: f64 = 7.0, "nats", SIMULATED;
        /// Samples are in step with the angle where their own spectrum has a line of this part of its sum.
        in_step: f64 = 0.15, "", SIMULATED;
        /// A line stands alone where no other is more than this part of its power,
        alone: f64 = 0.1, "", SIMULATED;
        /// its harmonics and so many neighbours on either side left out.
        beside: usize = 20, "orders", SIMULATED;
        /// The residual is detrended by its mean over this on either side,
        window_rad: f64 = TAU / 360.0, "rad", RESOLUTION;
        /// or over so many samples where they are sparse.
        window_samples: usize = 4, "", RESOLUTION;
        /// Fewest samples in a block that is freed of a straight line.
        block_samples: usize = 24, "", RESOLUTION;
        /// Fewest line periods in a block.
        block_lines: f64 = 4.0, "", RESOLUTION;
        /// Fewest degrees of freedom of an error within a line.
        fewest_freedom: f64 = 50.0, "", SIMULATED;
        /// Log Bayes factor from which an error within a line is taken off.
        taken_off_nats: f64 = 4.0, "nats", SIMULATED;
    }
}

settings! {
    /// Points → revolutions × angle bins.
    GridSettings {
        /// Bins a turn where there are few revolutions.
        most_bins: usize = 720, "", RESOLUTION;
        /// Bins a turn where there are many.
        fewest_bins: usize = 24, "", RESOLUTION;
        /// Most revolutions held apart; beyond, neighbours in a run are averaged.
        most_revolutions: usize = 64, "", RESOLUTION;
        /// Most places in all.
        most_places: usize = 60_000, "", RESOLUTION;
    }
}

settings! {
    /// Knocks and lost readings.
    TransientSettings {
        /// How far a place must stand out to begin a knock, in robust standard deviations.
        outstanding: f64 = 8.0, "", SIMULATED;
        /// How little it must for the knock to be over, in the same.
        quiet: f64 = 2.5, "", SIMULATED;
        /// Part of the RMS from which the standard deviation by the median says that it rings all the time.
        ringing: f64 = 0.5, "", SIMULATED;
        /// How much higher peaks are then.
        ringing_peaks: f64 = 1.5, "", SIMULATED;
        /// Quiet places that end a knock.
        quiet_places: usize = 6, "bins", SIMULATED;
        /// Places on either side whose levels tell a step from a knock.
        beside: usize = 30, "bins", SIMULATED;
        /// Part of its peak that a step leaves.
        step: f64 = 0.25, "", SIMULATED;
        /// Times that knocks are looked for.
        passes: usize = 4, "", RESOLUTION;
        /// Places from which what stands out at an end of a run may be settling.
        settling_places: usize = 20, "bins", SIMULATED;
        /// Part of it on one side from which it is.
        one_sided: f64 = 0.9, "", SIMULATED;
        /// What takes more than this part of the places is no knock.
        most: f64 = 0.2, "", SIMULATED;
        /// Least standard deviation.
        least_rad: f64 = 1e-9, "rad", Kind::Derived("finer than any encoder");
        /// Part of the knocks' RMS that may be left under the scatter where they ring on.
        tails: f64 = 0.12, "", SIMULATED;
    }
}

settings! {
    /// Tones in time.
    ToneSettings {
        /// Tones from here on are looked for in what the slow waves of a revolution leave.
        high_turns: f64 = 10.0, "1/turn", SIMULATED;
        /// Between this and the last, a tone looks like those waves, and must stand the more out of them.
        low_turns: f64 = 2.0, "1/turn", SIMULATED;
        /// Log odds from which a high tone is taken off.
        high_nats: f64 = 6.0, "nats", SIMULATED;
        /// The same of a low one, where the scatter is not white.
        low_nats: f64 = 60.0, "nats", SIMULATED;
        /// Most tones taken off.
        most: usize = 3, "", SIMULATED;
        /// Neighbours on either side that a tone must stand out of.
        neighbours: usize = 100, "", SIMULATED;
        /// Highest frequency, in parts of the points' rate: above half of it all is mirrored.
        highest_of_rate: f64 = 0.45, "", Kind::Derived("below half the sampling rate");
        /// Least part of the scatter's square that a tone must make.
        least_share: f64 = 0.002, "", SIMULATED;
    }
}
