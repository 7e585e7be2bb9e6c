//! What came of a campaign: a line a run, and the whole as one object.

use serde::Serialize;

use super::journal::FinishedRun;
use crate::present::angle;

/// `rigd.campaign/1`.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Schema and its version.
    pub schema: &'static str,
    /// The plan's name.
    pub name: String,
    /// Directory of logs and journal.
    pub directory: String,
    /// Runs of the plan.
    pub planned: usize,
    /// Complete runs of all starts.
    pub runs: Vec<FinishedRun>,
    /// Samples lost in complete runs, from approach to end.
    pub losses: u64,
    /// What changed between the first and the last reference run of each sense.
    pub drift: Vec<Drift>,
    /// Why this start was interrupted, each time.
    pub interruptions: Vec<String>,
    /// How it ended: `done`, or why not.
    pub ended: String,
}

/// The last reference run against the first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Drift {
    /// Sense.
    pub direction: String,
    /// Change of mean TE, rad.
    pub te_mean_rad: f64,
    /// Change of its peak-to-peak, rad.
    pub te_pp_rad: f64,
    /// Time between them, s.
    pub after_s: f64,
}

/// The drift that the reference runs show; a sense with fewer than two of them shows none.
#[must_use]
pub fn drift(runs: &[FinishedRun]) -> Vec<Drift> {
    let of = |direction: &str| {
        let mut reference = runs.iter().filter(|run| run.kind == "reference" && run.direction == direction);
        let first = reference.next()?;
        let last = reference.next_back()?;
        Some(Drift {
            direction: direction.into(),
            te_mean_rad: last.te_mean_rad? - first.te_mean_rad?,
            te_pp_rad: last.te_pp_rad? - first.te_pp_rad?,
            after_s: last.ended_ns.saturating_sub(first.ended_ns) as f64 * 1e-9,
        })
    };
    ["ccw", "cw"].into_iter().filter_map(of).collect()
}

/// A run in a line.
#[must_use]
pub fn line(run: &FinishedRun, planned: usize) -> String {
    let what = if run.kind == "measure" { String::new() } else { format!(" {}", run.kind) };
    let conditions = format!("{} {} N·m {} rpm", run.direction, run.load_nm, run.speed_rpm);
    let te = match (run.te_pp_rad, run.residual_rms_rad) {
        (Some(pp), Some(residual)) => format!("  TE p-p {}  against the model {} rms", angle(pp), angle(residual)),
        _ => String::new(),
    };
    let lost = if run.losses == 0 { String::new() } else { format!("  {} LOST", run.losses) };
    format!("{:>4}/{planned}{what}  {conditions}  {} samples{te}{lost}", run.run + 1, run.samples)
}

impl Report {
    /// The end of it, for people.
    #[must_use]
    pub fn text(&self) -> String {
        use std::fmt::Write as _;
        let mut text = format!("\n{} of {} runs complete", self.runs.len().min(self.planned), self.planned);
        // Writing to a String cannot fail.
        let _ = write!(text, ", {} samples lost, logs in {}", self.losses, self.directory);
        for drift in &self.drift {
            let _ = write!(
                text,
                "\ndrift {} over {}: mean TE {}, peak-to-peak {}",
                drift.direction,
                super::estimate::time(drift.after_s),
                angle(drift.te_mean_rad),
                angle(drift.te_pp_rad)
            );
        }
        if !self.interruptions.is_empty() {
            let _ = write!(text, "\ninterrupted {} times", self.interruptions.len());
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(kind: &str, direction: &str, mean: f64, ended_s: u64) -> FinishedRun {
        FinishedRun {
            run: 0,
            kind: kind.into(),
            direction: direction.into(),
            load_nm: 5.0,
            speed_rpm: 5.0,
            revolutions: 1.0,
            log: String::new(),
            at: String::new(),
            ended_ns: ended_s * 1_000_000_000,
            samples: 1,
            losses: 0,
            te_mean_rad: Some(mean),
            te_pp_rad: Some(2.0 * mean),
            residual_rms_rad: Some(0.0),
        }
    }

    #[test]
    fn drift_is_the_last_reference_less_the_first_of_its_sense() {
        let runs = [
            run("reference", "ccw", 1.0, 10),
            run("reference", "cw", 5.0, 20),
            run("measure", "ccw", 100.0, 30),
            run("reference", "ccw", 4.0, 110),
        ];
        let expected = Drift { direction: "ccw".into(), te_mean_rad: 3.0, te_pp_rad: 6.0, after_s: 100.0 };
        assert_eq!(drift(&runs), [expected]);
    }
}
