//! Of what no angle carries and no effect makes: steps, orders, lines, levels that run on.

use serde::Serialize;

use super::setting::{Kind, RESOLUTION, SIMULATED, Setting};

settings! {
    /// Steps in the level.
    StepSettings {
        /// Sectors of a revolution over which the level is averaged.
        sectors: usize = 12, "1/rev", RESOLUTION;
        /// What a step costs on the way through the sectors: its place is open.
        step_nats: f64 = 4.0, "nats", SIMULATED;
        /// What it costs to look for an effect's steps,
        looked_for_nats: f64 = 8.0, "nats", SIMULATED;
        /// and each of them, whose place was chosen to a fraction of a degree.
        each_nats: f64 = 6.5, "nats", SIMULATED;
        /// Evidence from which an effect's steps are taken into the design matrix.
        found_nats: f64 = 8.0, "nats", SIMULATED;
        /// Steps up to which those at the edges of runs are moved off them: more speak for one another.
        few: usize = 3, "", SIMULATED;
        /// Times that steps are moved.
        settling_passes: usize = 3, "", RESOLUTION;
        /// Step sizes tried, of either sign,
        sizes: i32 = 30, "", RESOLUTION;
        /// the smallest,
        smallest_rad: f64 = 1.5e-6, "rad", RESOLUTION;
        /// and the ratio of neighbouring ones.
        size_ratio: f64 = 1.26, "", RESOLUTION;
        /// Most steps that a rise is shared out to.
        most_shared: u32 = 32, "", RESOLUTION;
        /// Most steps looked for between runs.
        most_between: usize = 4, "", RESOLUTION;
        /// Most single steps of any size.
        most_single: usize = 3, "", RESOLUTION;
        /// Evidence from which such a step is taken into the design matrix.
        single_nats: f64 = 14.0, "nats", SIMULATED;
        /// What its time costs in a run,
        in_run_nats: f64 = 6.0, "nats", SIMULATED;
        /// and between two: something happens as readily in one of the few pauses.
        in_pause_nats: f64 = 3.0, "nats", SIMULATED;
    }
}

settings! {
    /// Patterns that no effect of the library makes.
    NuisanceSettings {
        /// Part of its turn that a shaft must cover for its orders to be tried.
        least_turn: f64 = 0.9, "turns", RESOLUTION;
        /// Highest order of a shaft that is always tried.
        highest_order: usize = 8, "", RESOLUTION;
        /// Highest order of a shaft that is tried in one sense alone.
        highest_one_sense: u32 = 4, "", RESOLUTION;
        /// Orders of a smooth pattern over the driver's turn.
        smooth_orders: usize = 18, "", RESOLUTION;
        /// Highest order of waves that do not close with the turn,
        highest_wandering: f64 = 3.5, "", RESOLUTION;
        /// their distance in parts of what the angle covered tells apart,
        wandering_step: f64 = 0.4, "", RESOLUTION;
        /// and its least and largest.
        wandering_steps: [f64; 2] = [0.02, 0.2], "", RESOLUTION;
        /// What such a wave costs: it was chosen from many, and the scatter of the low orders runs on from turn to turn as such waves do.
        wandering_cost_nats: f64 = 12.0, "nats", SIMULATED;
        /// Evidence from which it is taken into the design matrix.
        wandering_nats: f64 = 8.0, "nats", SIMULATED;
        /// Times that it is looked for: on the grid of orders, then ever nearer about the best.
        wandering_passes: usize = 3, "", RESOLUTION;
    }
}

settings! {
    /// Lines in the spectrum above the orders that every fit tries.
    GhostSettings {
        /// Highest order looked for.
        highest: usize = 340, "", RESOLUTION;
        /// Neighbours on either side that a line must stand out of,
        neighbours: usize = 8, "orders", SIMULATED;
        /// and how far it must, in amplitudes of the one in their middle.
        outstanding: f64 = 4.0, "", SIMULATED;
        /// Least evidence of a line against white noise.
        least_nats: f64 = 12.0, "nats", SIMULATED;
        /// Part of the strongest line's amplitude under which another that is no harmonic of it may be its foot.
        leaks: f64 = 0.15, "", SIMULATED;
        /// Most lines a shaft.
        most: usize = 10, "", RESOLUTION;
        /// What an order that was chosen from all high ones costs.
        cost_nats: f64 = 4.0, "nats", SIMULATED;
        /// The same of each further one that goes with it.
        another_cost_nats: f64 = 1.0, "nats", SIMULATED;
    }
}

settings! {
    /// Levels that run on with time.
    RunningOnSettings {
        /// What a level that runs on with time costs: scatter does too, a little.
        cost_nats: f64 = 6.0, "nats", SIMULATED;
        /// Time constants of settling tried, the largest half a run,
        settling_times: usize = 8, "", RESOLUTION;
        /// and the ratio of neighbours.
        settling_ratio: f64 = 1.5, "", RESOLUTION;
        /// Fewest terms of a random walk.
        least_terms: usize = 6, "", RESOLUTION;
        /// Most terms of a random walk.
        most_terms: usize = 48, "", RESOLUTION;
        /// Highest frequency of a slow tone.
        tone_turns: f64 = 2.0, "1/turn", Kind::Derived("where tones.low_turns begins");
        /// Least cycles of a slow tone over the campaign: fewer are a drift.
        tone_cycles: f64 = 2.0, "", SIMULATED;
        /// Steps of its search, in parts of what the campaign's length tells apart,
        tone_step: f64 = 0.25, "", RESOLUTION;
        /// and of its refinement.
        tone_fine_step: f64 = 0.02, "", RESOLUTION;
        /// Fewest sectors in which it is looked for.
        tone_sectors: usize = 48, "", RESOLUTION;
        /// Most times that such a level is fitted under the scatter that it left. Steps are not: whatever they are fitted to would leave less and less.
        rounds: usize = 5, "", RESOLUTION;
        /// Part of the scatter's square from which it is not worth another.
        quieter: f64 = 0.9, "", RESOLUTION;
    }
}
