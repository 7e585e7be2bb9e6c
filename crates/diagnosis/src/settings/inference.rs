//! Of the inference: columns, noise, evidence, search.

use serde::Serialize;

use super::setting::{Kind, RESOLUTION, SIMULATED, Setting};

settings! {
    /// Columns of the candidates.
    DesignSettings {
        /// Traces smaller than this part of a block's largest direction are not seen under the plan.
        unseen: f64 = 1e-5, "", RESOLUTION;
        /// A column with less than this part of it beside its mean is a constant.
        constant: f64 = 1e-9, "", Kind::Derived("rounding of a double");
    }
}

settings! {
    /// What does not repeat.
    NoiseSettings {
        /// Least scatter taken of an order.
        least_rad: f64 = 3e-8, "rad", Kind::Derived("a hundredth of the finest rig's");
        /// Variance of a ramp within a revolution in parts of that of what it goes with.
        ramp: f64 = 0.2, "", SIMULATED;
        /// Coverage from which a revolution's waves are well determined.
        full_coverage: f64 = 0.9, "", RESOLUTION;
        /// Differences between revolutions from which what grows evenly is taken for drift.
        drift_differences: usize = 3, "", SIMULATED;
        /// Differences from which few large ones count no more than the middle one allows,
        robust_differences: usize = 8, "", SIMULATED;
        /// times this.
        robust_factor: f64 = 2.0, "", SIMULATED;
        /// Least variance of an order in parts of what white noise alone would show.
        least_of_white: f64 = 0.02, "", SIMULATED;
        /// Variance of the level, in parts of the same, where no run holds two revolutions.
        assumed_of_white: f64 = 10.0, "", SIMULATED;
        /// Fewest pairs of places that white noise is estimated from between revolutions; along the turn where there are fewer.
        fewest_pairs: f64 = 100.0, "", RESOLUTION;
        /// Least white noise a sample.
        least_white_rad: f64 = 1e-9, "rad", Kind::Derived("finer than any encoder");
        /// Scatter between runs over that between revolutions before anything is known: of the level, and of the other waves.
        first_run_ratio: [f64; 2] = [1.0, 0.3], "", SIMULATED;
        /// Ratios that are weighed against one another.
        run_ratios: [f64; 6] = [0.02, 0.08, 0.3, 1.0, 3.0, 10.0], "", RESOLUTION;
        /// How far the ratio usually is from what it is first taken to be: a factor of e to this.
        run_ratio_spread: f64 = 1.5, "", SIMULATED;
    }
}

settings! {
    /// How probable a set of candidates is.
    EvidenceSettings {
        /// Scales of a candidate, each twice the one before.
        scales: usize = 11, "", RESOLUTION;
        /// The first of them.
        smallest_scale_rad: f64 = 1e-6, "rad", RESOLUTION;
        /// Blocks of more columns than this are wide: scanned on a coarser grid of scales, and no start of a search.
        wide_columns: usize = 16, "", RESOLUTION;
        /// Scales of a wide block, each four times the one before, from twice the smallest on.
        wide_scales: i32 = 4, "", RESOLUTION;
        /// Least scale of a block of a set.
        least_scale_rad: f64 = 0.3e-6, "rad", SIMULATED;
        /// Largest scale of a block of a set.
        largest_scale_rad: f64 = 0.1, "rad", SIMULATED;
        /// Scale from which it is moved to where the evidence is largest.
        first_scale_rad: f64 = 3e-5, "rad", RESOLUTION;
        /// Most times that the scales are moved,
        scale_passes: usize = 8, "", RESOLUTION;
        /// and the change of their logs from which they stay.
        scale_moved: f64 = 0.05, "", RESOLUTION;
        /// Most that the freedom of a scale costs: as on the grid, a third of whose points fit;
        scale_cost_nats: f64 = 1.3, "nats", Kind::Derived("the grid of scales");
        /// the same of a block of many columns, to which 2 over their number is added,
        wide_scale_cost_nats: f64 = 0.5, "nats", SIMULATED;
        /// and the least.
        least_scale_cost_nats: f64 = 0.3, "nats", SIMULATED;
        /// Prior standard deviation of the zero.
        zero_rad: f64 = 1.0, "rad", Kind::Derived("wide against any zero");
    }
}

settings! {
    /// Search over sets.
    SearchSettings {
        /// Prior odds that an effect of the library is there, before its shape is chosen.
        effect_odds: f64 = 0.04, "", SIMULATED;
        /// Prior odds that any pattern outside the library is there, shared by all of them.
        unknown_odds: f64 = 0.15, "", SIMULATED;
        /// What a choice among shapes costs, in parts of the log of their number: neighbours are alike and count as fewer.
        shape_cost: f64 = 0.8, "", SIMULATED;
        /// What it costs that an effect and a pattern share an order by chance.
        chance_nats: f64 = 8.0, "nats", SIMULATED;
        /// Prior of an effect that is known to be there.
        known_nats: f64 = 1e4, "nats", Kind::Derived("more than any evidence");
        /// Most blocks of a set.
        largest_set: usize = 8, "", RESOLUTION;
        /// Largest part in parts of the whole residual: two parts that cancel are no explanation.
        largest_part: f64 = 3.0, "", SIMULATED;
        /// How many of the best candidates are tried exactly.
        tried: usize = 5, "", RESOLUTION;
        /// How far below the present model a scan may expect a set that is fitted: on the climb,
        climbing_nats: f64 = 3.0, "nats", RESOLUTION;
        /// and where all that competes is to be seen.
        competing_nats: f64 = 9.0, "nats", RESOLUTION;
        /// Candidates kept of a scan, and tried about the best model in the end.
        most_ranked: usize = 60, "", RESOLUTION;
        /// The same about the best model without one of its blocks.
        most_exchanged: usize = 40, "", RESOLUTION;
        /// Most moves of a climb.
        most_moves: usize = 40, "", RESOLUTION;
        /// Starts beside the empty set.
        starts: usize = 4, "", RESOLUTION;
        /// How far below the empty set a start may be expected.
        start_nats: f64 = 2.0, "nats", RESOLUTION;
        /// Rounds of: search, look for events, sharpen shapes, estimate the noise anew.
        rounds: usize = 3, "", RESOLUTION;
        /// Change of the floor's log from which another round is worth it.
        floor_moved: f64 = 0.03, "", RESOLUTION;
        /// A set with an event that alone scores so much less than the best is not searched about;
        event_near_nats: f64 = 30.0, "nats", SIMULATED;
        /// where the best model has nothing that the event could stand in for, so much less.
        event_alone_nats: f64 = 0.0, "nats", SIMULATED;
    }
}

settings! {
    /// Shapes between the points of their grids.
    SharpeningSettings {
        /// Blocks smaller than this part of the largest are left out while its shape is moved.
        large: f64 = 0.12, "", SIMULATED;
        /// Steps in which shapes are moved, in parts of their grid's.
        steps: [f64; 6] = [1.0, 0.6, 0.3, 0.15, 0.07, 0.03], "", RESOLUTION;
        /// Step under which shapes that no longer move are sharp enough.
        sharp_enough: f64 = 0.2, "", RESOLUTION;
        /// What a moved shape must gain.
        least_gain_nats: f64 = 0.02, "nats", Kind::Derived("a fifth of its standard deviation");
    }
}
