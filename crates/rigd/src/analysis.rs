//! TE and backlash of a whole log: the same code for the live rig and for a replay, so that both give the same bits.

use gearmodel::effect::predict::Condition;
use gearmodel::measure::{AngleGrid, BacklashCurve, Curve, RunConditions, RunTe, TePoint};
use gearmodel::{Direction, NominalModel};
use sha2::{Digest as _, Sha256};

/// One recorded run and what it was made of.
pub struct MeasuredRun {
    /// Its TE.
    pub te: RunTe,
    /// Samples that the counter numbered and that never arrived.
    pub losses: u64,
    /// Recorded time, s.
    pub duration_s: f64,
}

/// Backlash at one load and speed, from the runs of both senses.
pub struct MeasuredBacklash {
    /// Conditions of the second run.
    pub conditions: RunConditions,
    /// Index of the ccw run.
    pub ccw: usize,
    /// Index of the cw run.
    pub cw: usize,
    /// The curve.
    pub curve: BacklashCurve,
}

/// TE and backlash of the runs of one log, in their order.
pub struct Analysis {
    model: NominalModel,
    active: Option<RunTe>,
    /// Mean curve of the run that the active one makes a backlash with.
    opposite: Option<(Direction, Curve)>,
    runs: Vec<MeasuredRun>,
    backlash: Vec<MeasuredBacklash>,
    hash: Sha256,
}

impl Analysis {
    /// An analysis against `model`.
    #[must_use]
    pub fn new(model: NominalModel) -> Self {
        Self { model, active: None, opposite: None, runs: Vec::new(), backlash: Vec::new(), hash: Sha256::new() }
    }

    /// The model in force.
    #[must_use]
    pub fn model(&self) -> &NominalModel {
        &self.model
    }

    /// Finished runs.
    #[must_use]
    pub fn runs(&self) -> &[MeasuredRun] {
        &self.runs
    }

    /// Backlash at each load and speed that both senses have seen.
    #[must_use]
    pub fn backlash(&self) -> &[MeasuredBacklash] {
        &self.backlash
    }

    /// Begins a run.
    pub fn begin(&mut self, conditions: RunConditions) {
        self.opposite = self.partner(&conditions).map(|run| {
            let te = &self.runs[run].te;
            (te.conditions().direction, te.mean_curve())
        });
        self.active = Some(RunTe::new(AngleGrid::default(), conditions));
    }

    /// A sample of the active run; the point when it is the first in its angle bin.
    #[inline]
    pub fn push(&mut self, theta1_rad: f64, theta2_rad: f64) -> Option<TePoint> {
        self.active.as_mut()?.push(&self.model.pair, theta1_rad, theta2_rad)
    }

    /// The latest run in the other sense at the same load and speed.
    fn partner(&self, conditions: &RunConditions) -> Option<usize> {
        self.runs.iter().rposition(|run| {
            let other = run.te.conditions();
            other.direction != conditions.direction
                && other.load_nm == conditions.load_nm
                && other.speed_rpm == conditions.speed_rpm
        })
    }

    /// Backlash at a point of the active run, live: against the other sense's mean curve, once there is one.
    #[must_use]
    pub fn live_backlash_rad(&self, point: &TePoint) -> Option<f64> {
        let (direction, curve) = self.opposite.as_ref()?;
        let other = *curve.values_rad.get(point.bin)?;
        let backlash = match direction {
            Direction::Ccw => point.te_rad - other,
            Direction::Cw => other - point.te_rad,
        };
        backlash.is_finite().then_some(backlash)
    }

    /// Ends the run; the backlash when the other sense has been seen at its load and speed.
    pub fn end(&mut self, losses: u64, duration_s: f64) -> Option<&MeasuredBacklash> {
        let te = self.active.take()?;
        let conditions = te.conditions();
        let partner = self.partner(&conditions);
        let hash = &mut self.hash;
        te.for_each_hashed_value(&mut |value| hash.update(value.to_le_bytes()));
        let this = self.runs.len();
        self.runs.push(MeasuredRun { te, losses, duration_s });
        let partner = partner?;
        let (ccw, cw) = if conditions.direction == Direction::Ccw { (this, partner) } else { (partner, this) };
        // Runs that were cut short may share no angle: then there is no backlash to tell.
        let curve = BacklashCurve::of(&self.runs[ccw].te.mean_curve(), &self.runs[cw].te.mean_curve()).ok()?;
        curve.for_each_hashed_value(&mut |value| hash.update(value.to_le_bytes()));
        self.backlash.push(MeasuredBacklash { conditions, ccw, cw, curve });
        self.backlash.last()
    }

    /// Drops every run but the last at each sense, load and speed: a campaign of a night needs no more than backlash needs.
    pub fn keep_last_of_each(&mut self) {
        let mut kept: Vec<MeasuredRun> = Vec::new();
        for run in std::mem::take(&mut self.runs) {
            kept.retain(|earlier| earlier.te.conditions() != run.te.conditions());
            kept.push(run);
        }
        self.runs = kept;
        self.backlash.clear();
    }

    /// Hash of every TE and backlash value so far, in order.
    #[must_use]
    pub fn te_hash(&self) -> String {
        use std::fmt::Write as _;
        let digest = self.hash.clone().finalize();
        digest.iter().fold(String::from("sha256:"), |mut text, byte| {
            // Writing to a String cannot fail.
            let _ = write!(text, "{byte:02x}");
            text
        })
    }

    /// Predicted TE on the grid, at a run's conditions.
    #[must_use]
    pub fn predicted(&self, conditions: &RunConditions) -> Curve {
        let under = under(conditions);
        Curve::from_fn(AngleGrid::default(), |theta1| self.model.te_under_rad(theta1, &under))
    }

    /// Predicted backlash on the grid, at a run's load and speed.
    #[must_use]
    pub fn predicted_backlash(&self, conditions: &RunConditions) -> BacklashCurve {
        BacklashCurve::predicted_under(&self.model, AngleGrid::default(), &under(conditions))
    }
}

/// Load and speed of a run, at the campaign's start: a run's own history is not known here.
fn under(conditions: &RunConditions) -> Condition {
    Condition { speed_rpm: conditions.speed_rpm, ..Condition::at_rest(conditions.direction, conditions.load_nm) }
}
