//! What is to be run, and how far it has come: the same for one `rigd run` and for a campaign of a night.

use gearmodel::Direction;

use super::plan::RunPlan;

/// What a run is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// A measurement.
    Measure,
    /// The same conditions at the start and at the end, so that drift shows.
    Reference,
    /// Turns under load that are not recorded.
    WarmUp,
}

impl Kind {
    /// In logs and journals.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Measure => "measure",
            Self::Reference => "reference",
            Self::WarmUp => "warm-up",
        }
    }
}

/// One run: one sense, load and speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSpec {
    /// What it is for.
    pub kind: Kind,
    /// The driver's sense.
    pub direction: Direction,
    /// Load at the driven gear, N·m.
    pub load_nm: f64,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Revolutions of the driver to record; of a warm-up, to turn.
    pub revolutions: f64,
}

/// When a run has settled by what is measured, instead of by the profile's fixed times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settle {
    /// Largest change of TE between the same quarter of a turn in two revolutions that follow each other, rad.
    pub te_change_rad: f64,
    /// After so many turns the run is recorded all the same, and the log says so.
    pub turns_max: f64,
}

/// The runs in their order, and where in them the rig is.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// The runs.
    pub runs: Vec<RunSpec>,
    /// Sampling, Hz.
    pub rate_hz: f64,
    /// How a run settles; `None`: by the profile's times.
    pub settle: Option<Settle>,
    /// The operator accepts a drive that has no watchdog of its own.
    pub accept_no_watchdog: bool,
    next: usize,
    recorded_revolutions: f64,
    attempts: u32,
}

impl Job {
    /// A job that begins with run `first`.
    #[must_use]
    pub fn new(runs: Vec<RunSpec>, rate_hz: f64, first: usize) -> Self {
        Self {
            runs,
            rate_hz,
            settle: None,
            accept_no_watchdog: false,
            next: first,
            recorded_revolutions: 0.0,
            attempts: 0,
        }
    }

    /// The runs of a plan: every load, both senses at each.
    #[must_use]
    pub fn of(plan: &RunPlan) -> Self {
        let runs = plan.loads_nm.iter().flat_map(|&load_nm| {
            plan.directions.iter().map(move |&direction| RunSpec {
                kind: Kind::Measure,
                direction,
                load_nm,
                speed_rpm: plan.speed_rpm,
                revolutions: plan.revolutions,
            })
        });
        Self { accept_no_watchdog: plan.accept_no_watchdog, ..Self::new(runs.collect(), plan.rate_hz, 0) }
    }

    /// The run that is due, and its index; `None` when all are done.
    #[must_use]
    pub fn current(&self) -> Option<(usize, RunSpec)> {
        self.runs.get(self.next).map(|run| (self.next, *run))
    }

    /// Revolutions that the current run still lacks.
    #[must_use]
    pub fn missing_revolutions(&self) -> f64 {
        self.current().map_or(0.0, |(_, run)| run.revolutions - self.recorded_revolutions)
    }

    /// Some revolutions of the current run are recorded already: it was paused.
    #[must_use]
    pub fn is_partial(&self) -> bool {
        self.recorded_revolutions > 0.0
    }

    /// Books recorded revolutions of the current run; true when it is complete.
    pub fn book(&mut self, revolutions: f64) -> bool {
        self.recorded_revolutions += revolutions;
        self.attempts = 0;
        // Whole revolutions add up exactly.
        self.missing_revolutions() <= 0.0
    }

    /// Goes on to the next run.
    pub fn advance(&mut self) {
        (self.next, self.recorded_revolutions, self.attempts) = (self.next + 1, 0.0, 0);
    }

    /// The current run was interrupted in the middle: it is done again from its start. How often that happened in a row.
    pub fn begin_again(&mut self) -> u32 {
        self.recorded_revolutions = 0.0;
        self.attempts += 1;
        self.attempts
    }

    /// The largest speed of all runs, rpm of the driver.
    #[must_use]
    pub fn largest_speed_rpm(&self) -> f64 {
        self.runs.iter().map(|run| run.speed_rpm).fold(0.0, f64::max)
    }

    /// The largest load of all runs, N·m.
    #[must_use]
    pub fn largest_load_nm(&self) -> f64 {
        self.runs.iter().map(|run| run.load_nm).fold(0.0, f64::max)
    }

    /// Revolutions to record in all runs.
    #[must_use]
    pub fn revolutions(&self) -> f64 {
        self.runs.iter().filter(|run| run.kind != Kind::WarmUp).map(|run| run.revolutions).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job() -> Job {
        Job::of(&RunPlan {
            directions: vec![Direction::Ccw, Direction::Cw],
            loads_nm: vec![5.0, 10.0],
            speed_rpm: 5.0,
            revolutions: 3.0,
            rate_hz: 1e4,
            accept_no_watchdog: false,
        })
    }

    #[test]
    fn a_plan_is_every_load_in_both_senses() {
        let job = job();
        let seen: Vec<_> = job.runs.iter().map(|run| (run.load_nm, run.direction)).collect();
        assert_eq!(seen, [(5.0, Direction::Ccw), (5.0, Direction::Cw), (10.0, Direction::Ccw), (10.0, Direction::Cw)]);
        assert_eq!((job.revolutions(), job.largest_load_nm()), (12.0, 10.0));
    }

    #[test]
    fn a_paused_run_goes_on_and_an_interrupted_one_begins_again() {
        let mut job = job();
        assert!(!job.book(2.0) && job.is_partial());
        assert_eq!(job.missing_revolutions(), 1.0);
        assert_eq!(job.begin_again(), 1);
        assert_eq!(job.begin_again(), 2);
        assert_eq!(job.missing_revolutions(), 3.0);
        assert!(job.book(3.0));
        job.advance();
        assert_eq!(job.current().map(|(index, _)| index), Some(1));
        assert_eq!(job.begin_again(), 1, "another run, another count");
    }
}
