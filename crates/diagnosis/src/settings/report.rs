//! Of the report.

use serde::Serialize;

use super::setting::{Kind, RESOLUTION, SIMULATED, Setting};

settings! {
    /// From models to probabilities, names and sizes.
    ReportSettings {
        /// Under 1 it flattens what the noise model's own error makes too sure.
        sharpness: f64 = 1.0, "", SIMULATED;
        /// Probability from which an effect is named.
        named: f64 = 0.5, "", Kind::Derived("more probable than not");
        /// Effects whose subspaces stand nearer than this cannot be told apart.
        same_deg: f64 = 2.0, "deg", Kind::Derived("the contract of the diagnosis");
        /// Members of a group nearer than this have one and the same trace.
        identical_deg: f64 = 0.2, "deg", RESOLUTION;
        /// Members of a group may be this much less probable than the best.
        member_nats: f64 = 6.0, "nats", SIMULATED;
        /// Blocks this many times as wide as another describe more than it: not a group.
        much_wider: usize = 8, "", SIMULATED;
        /// Probability from which effects that cannot be told from one are looked for, and from which a group is told.
        compared: f64 = 0.02, "", RESOLUTION;
        /// An effect that is not in the best model has no reference lower than this much under it.
        reference_nats: f64 = 3.0, "nats", SIMULATED;
        /// An effect or a remainder under this part of what was found may be the found effects' own inexactness;
        inexact: f64 = 0.05, "", SIMULATED;
        /// under this part of the floor, the nominal and the noise model's;
        inexact_of_floor: f64 = 0.08, "", SIMULATED;
        /// under this part of a resonance, its: how it is excited is known less well than geometry is.
        inexact_ringing: f64 = 0.08, "", SIMULATED;
        /// Largest probability of what may be no more than that.
        inexact_probability: f64 = 0.02, "", SIMULATED;
        /// Largest probability of steps that make the prediction of held-out runs worse.
        unpredictive_probability: f64 = 0.3, "", SIMULATED;
        /// Probability of a tone that was found over all frequencies, and of knocks far out of the scatter.
        event_probability: f64 = 0.99, "", SIMULATED;
        /// Knocks ring at a resonance's own frequency where both are no further apart than a factor of e to this.
        same_ring: f64 = 0.3, "", SIMULATED;
        /// A wandering level under this part of the floor may be scatter;
        wanders_of_floor: f64 = 0.8, "", SIMULATED;
        /// so may one that steps between runs under this part of it.
        steps_of_floor: f64 = 0.4, "", SIMULATED;
        /// Probability of the unknown from which it is said where it lies.
        located: f64 = 0.1, "", RESOLUTION;
        /// Standard deviations are this much larger than under the noise model alone, whose own error they do not know.
        wider: f64 = 1.25, "", SIMULATED;
        /// How exact parameters are at best, in parts of their value, and phases in rad.
        linearised: f64 = 0.006, "", SIMULATED;
        /// Resamples of the revolutions for intervals.
        resamples: usize = 400, "", RESOLUTION;
        /// A sum of two effects nearer than this to a third looks like it.
        mimic_deg: f64 = 4.0, "deg", SIMULATED;
        /// Most warnings of such sums.
        most_mimics: usize = 5, "", RESOLUTION;
        /// Probability that parts the effects of such a sum from what it feigns.
        mimic_probability: f64 = 0.3, "", SIMULATED;
        /// Widest block that a sum is compared with,
        mimic_columns: usize = 4, "", RESOLUTION;
        /// and widest sum: what has many columns looks like anything.
        mimic_sum_columns: usize = 8, "", RESOLUTION;
        /// Independent differences between revolutions under which probabilities are called rough.
        few_differences: f64 = 40.0, "", SIMULATED;
    }
}
