//! What the diagnosis says: the fields of its contract, as plain data.

use serde::Serialize;
use serde_json::{Map, Value as Json};

use super::settings::Settings;
use gearmodel::effect::Signature;

/// The whole answer.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// How large the gap is and how far it shrinks.
    pub gap: Gap,
    /// Where it lies.
    #[serde(rename = "where")]
    pub location: Location,
    /// Every applicable effect, most probable first.
    pub effects: Vec<EffectFinding>,
    /// Effects that this data cannot tell apart.
    pub groups: Vec<Group>,
    /// What no effect of the library explains.
    pub unknown: Unknown,
    /// What the diagnosis would stake its name on.
    pub verdict: Vec<Verdict>,
    /// Experiments that separate what is still confused.
    pub next: Vec<Experiment>,
    /// What the data does not allow one to conclude.
    pub warnings: Vec<String>,
    /// Angles between the subspaces of the effects that matter here, deg.
    pub confusability: Confusability,
    /// Every number that was chosen for it.
    pub settings: Settings,
    /// The model found: what was added to the nominal one.
    #[serde(skip)]
    pub found: gearmodel::effect::predict::Found,
    /// Curves for pictures.
    #[serde(skip)]
    pub curves: Vec<Curve>,
}

impl Diagnosis {
    /// All fields as JSON, in plain types; what is not finite is null.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Plain data with text keys: serialising cannot fail.
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// Size of the gap, on runs that were not used for the fit.
#[derive(Clone, Debug, Serialize)]
pub struct Gap {
    /// RMS of a sample's residual against the nominal model, the free zero removed, rad.
    pub before_rad: f64,
    /// RMS after adding the found effects, rad.
    pub after_rad: f64,
    /// RMS of repeatability alone, rad.
    pub floor_rad: f64,
    /// (before² − after²)/(before² − floor²); `None` where nothing is reducible.
    pub closed: Option<f64>,
    /// 90 % interval of it, from resampled revolutions.
    pub closed_interval: Option<[f64; 2]>,
    /// Shares of the reducible gap.
    pub budget: Vec<BudgetRow>,
}

/// A row of the budget.
#[derive(Clone, Debug, Serialize)]
pub struct BudgetRow {
    /// Effect, or `unexplained`.
    pub effect: String,
    /// Share of the reducible gap.
    pub share: f64,
    /// 90 % interval of it.
    pub interval: Option<[f64; 2]>,
}

/// An effect of the library as found.
#[derive(Clone, Debug, Serialize)]
pub struct EffectFinding {
    /// Canonical name.
    pub name: String,
    /// Posterior probability that it is there.
    pub probability: f64,
    /// Parameters: value, standard deviation, unit.
    pub parameters: Map<String, Json>,
    /// Share of the reducible gap that it closes alone, held out; `None` where nothing is reducible.
    pub shrink: Option<f64>,
    /// Where on the rig it sits.
    pub component: String,
    /// Effects under 2° from it.
    pub confused_with: Vec<String>,
    /// RMS of its trace, rad.
    pub rms_rad: f64,
}

/// A set of effects that this data cannot tell apart.
#[derive(Clone, Debug, Serialize)]
pub struct Group {
    /// Names.
    pub members: Vec<String>,
    /// Largest angle between their subspaces, deg.
    pub angle_deg: f64,
    /// Probability that one of them is there.
    pub probability: f64,
}

/// What lies outside the library.
#[derive(Clone, Debug, Serialize)]
pub struct Unknown {
    /// Probability that something does.
    pub probability: f64,
    /// Its size, rad.
    pub rms_rad: f64,
    /// Where it lies; `None` where there is nothing.
    #[serde(rename = "where")]
    pub location: Option<UnknownLocation>,
}

/// Where an unknown remainder lies.
#[derive(Clone, Debug, Serialize)]
pub struct UnknownLocation {
    /// In words.
    pub description: String,
    /// Its signature.
    pub signature: Signature,
}

/// An item of the verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Verdict {
    /// An effect, or "unknown".
    Name(String),
    /// One of several that cannot be told apart.
    Group {
        /// Names.
        members: Vec<String>,
        /// Largest angle between their subspaces, deg.
        angle_deg: f64,
    },
}

/// The localisation.
#[derive(Clone, Debug, Serialize)]
pub struct Location {
    /// The signature row.
    pub signature: Signature,
    /// RMS by sectors of the driver's turn.
    pub input_angle: Vec<Slice>,
    /// RMS by sectors of the driven turn.
    pub driven_angle: Vec<Slice>,
    /// RMS by driver tooth.
    pub tooth: Vec<Slice>,
    /// Amplitude by order of the driver.
    pub input_order: Vec<Slice>,
    /// Amplitude by order of the driven shaft.
    pub output_order: Vec<Slice>,
    /// Amplitude by order of the mesh.
    pub mesh_order: Vec<Slice>,
    /// Amplitude by encoder and order of its line period.
    pub line_phase: Vec<Slice>,
    /// RMS by sense.
    pub direction: Vec<Slice>,
    /// RMS by load, N·m.
    pub load: Vec<Slice>,
    /// RMS by driver speed, rpm.
    pub speed: Vec<Slice>,
    /// RMS by revolution since the campaign's start.
    pub revolution: Vec<Slice>,
    /// RMS by time, s.
    pub time: Vec<Slice>,
}

/// Part of the gap at one value of one quantity.
#[derive(Clone, Debug, Serialize)]
pub struct Slice {
    /// Value or name.
    pub at: Json,
    /// Gap there, rad.
    pub rad: f64,
    /// What repeatability alone gives there, rad.
    pub floor_rad: f64,
}

/// An experiment to come.
#[derive(Clone, Debug, Serialize)]
pub struct Experiment {
    /// What to do.
    pub action: String,
    /// What it separates.
    pub separates: Vec<String>,
    /// Probability expected for the right one after it.
    pub expected_probability: f64,
    /// Rig time, min.
    pub minutes: f64,
    /// Rows of the plan; empty where nothing is run by plan.
    pub plan: Vec<PlanRow>,
    /// The same as the TOML of a campaign; empty where nothing is run by plan.
    pub toml: String,
}

/// A run of a plan.
#[derive(Clone, Debug, Serialize)]
pub struct PlanRow {
    /// Sense.
    pub direction: String,
    /// Load, N·m.
    pub load_nm: f64,
    /// Speed, rpm.
    pub speed_rpm: f64,
    /// Revolutions.
    pub revolutions: u32,
}

/// Angles between effects under this plan.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Confusability {
    /// Names, rows and columns.
    pub names: Vec<String>,
    /// Angle between subspaces, deg.
    pub angle_deg: Vec<Vec<f64>>,
}

/// A residual before and after, over the driver's turn, of one run.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Label.
    pub label: String,
    /// Sense of the driver.
    pub direction: gearmodel::Direction,
    /// Load, N·m.
    pub load_nm: f64,
    /// Driver speed, rpm.
    pub speed_rpm: f64,
    /// θ1 within the turn, rad.
    pub theta1_rad: Vec<f64>,
    /// Mean residual over the revolutions, rad.
    pub before_rad: Vec<f64>,
    /// The same less the found effects, rad.
    pub after_rad: Vec<f64>,
    /// Residual by revolution and angle bin, rad; NaN where nothing was measured.
    pub map_rad: Vec<Vec<f64>>,
}
