//! What is wrong in a case, and what it is made of: the truth that is sealed.

use serde::{Deserialize, Serialize};

use super::family::Family;
use rigsim::plant::faults::Parameters;

/// One effect of a label.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelledEffect {
    /// Its name.
    pub name: String,
    /// Whether the diagnosis does not know it.
    pub outside: bool,
    /// Its parameters, under the diagnosis' names.
    pub parameters: Parameters,
    /// RMS of what it alone adds to TE over the campaign, rad.
    pub rms_rad: f64,
}

/// What was drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// Seed of the set.
    pub seed: u64,
    /// Number of the case in the set.
    pub case: usize,
    /// Family.
    pub family: Family,
    /// The effects.
    pub effects: Vec<LabelledEffect>,
    /// RMS of what all of them add together, rad.
    pub rms_rad: f64,
    /// Effects that the diagnosis is told to do without.
    pub exclude: Vec<String>,
    /// White noise, rad RMS a sample.
    pub white_rad: f64,
    /// Scatter between revolutions, rad RMS.
    pub run_out_rad: f64,
    /// Sampling, Hz.
    pub rate_hz: f64,
}
