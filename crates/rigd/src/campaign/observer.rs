//! Conducts a campaign: a log for every run, the journal, and a place beside for what was not finished.

use std::path::{Path, PathBuf};

use async_trait::async_trait;
use gearmodel::measure::RunFigures;
use riglog::proto::Level;
use riglog::{RunMetadata, part_path};

use super::CampaignError;
use super::estimate::{Estimate, time};
use super::journal::{FinishedRun, Journal, Line};
use super::schedule::Schedule;
use crate::clock::Clock;
use crate::profile::Profile;
use crate::run::connected_rig::ConnectedRig;
use crate::run::job::{Kind, RunSpec};
use crate::run::observer::RunObserver;
use crate::run::recorder::Recorder;
use crate::run::session::{LogHead, writer_options};
use crate::run::stop_reason::StopReason;
use crate::run::supervisor::State;

/// Logs of runs that were not finished; out of the way of `rigd diagnose DIR/*.mcap`.
pub const UNFINISHED: &str = "unfinished";

/// One run a log, and what is known of it before it is finalised.
struct Current {
    /// Index in the schedule.
    run: usize,
    path: PathBuf,
    finished: Option<Box<FinishedRun>>,
}

/// Looks on at a campaign: a log for each run, and the journal.
pub struct CampaignObserver {
    directory: PathBuf,
    profile: Profile,
    head: LogHead,
    clock: Clock,
    schedule: Schedule,
    /// The schedule's index of each of the job's runs.
    indices: Vec<usize>,
    estimate: Estimate,
    /// Out of the house only while another thread writes it.
    journal: Option<Journal>,
    current: Option<Current>,
    quiet: bool,
    /// Samples lost when the current run began.
    lost_before: u64,
    /// Why and how often it was interrupted.
    pub interruptions: Vec<String>,
}

impl CampaignObserver {
    /// For the runs `indices` of a schedule, into a directory with its journal.
    #[must_use]
    pub fn new(
        (directory, journal): (&Path, Journal),
        profile: Profile,
        head: LogHead,
        clock: Clock,
        (schedule, indices, estimate): (Schedule, Vec<usize>, Estimate),
        quiet: bool,
    ) -> Self {
        Self {
            directory: directory.into(),
            profile,
            head,
            clock,
            schedule,
            indices,
            estimate,
            journal: Some(journal),
            current: None,
            quiet,
            lost_before: 0,
            interruptions: Vec::new(),
        }
    }

    /// The log of the first run, before anything is connected.
    ///
    /// # Errors
    /// [`StopReason::Log`], [`StopReason::Journal`].
    pub fn begin(&mut self) -> Result<Recorder, StopReason> {
        let first = self.indices.first().copied().unwrap_or(0);
        let began = Line::Began {
            plan: self.schedule.fingerprint.clone(),
            at: now(),
            operator: self.head.operator.clone(),
            first,
        };
        self.write(&began)?;
        let path = self.free_path(first);
        let recorder = Recorder::create(&path, writer_options(&self.profile), &self.profile.log)?;
        self.describe(&recorder, first);
        self.current = Some(Current { run: first, path, finished: None });
        Ok(recorder)
    }

    /// After the last log was finalised, or not: the journal of its run, or its place beside.
    ///
    /// # Errors
    /// [`CampaignError::Io`].
    pub fn conclude(&mut self, finalised: bool, reason: Option<&StopReason>) -> Result<(), CampaignError> {
        if let (Some(current), Some(journal)) = (self.current.take(), &mut self.journal) {
            close(journal, &self.directory, current, finalised)?;
        }
        if let Some(reason) = reason {
            self.write(&Line::Interrupted { at: now(), why: reason.to_string(), goes_on: false })?;
        }
        Ok(())
    }

    fn write(&mut self, line: &Line) -> Result<(), CampaignError> {
        self.journal.as_mut().map_or(Ok(()), |journal| journal.write(line))
    }

    /// Complete runs of all starts.
    #[must_use]
    pub fn all_finished(&self) -> &[FinishedRun] {
        self.journal.as_ref().map_or(&[], |journal| &journal.finished)
    }

    fn describe(&self, recorder: &Recorder, run: usize) {
        let Some(spec) = self.schedule.runs.get(run) else { return };
        let place = format!("{} {} of {}", spec.kind.name(), run + 1, self.schedule.runs.len());
        let note = if self.head.note.is_empty() { place } else { format!("{}; {place}", self.head.note) };
        let conditions = RunMetadata {
            direction: spec.direction.to_string(),
            load_nm: vec![spec.load_nm],
            speed_rpm: vec![spec.speed_rpm],
            revolutions: Some(spec.revolutions),
            ..RunMetadata::default()
        };
        LogHead { note, ..self.head.clone() }.describe(recorder, &self.profile, conditions, self.clock);
    }

    /// A path for a run's log that no log has had, here or among the unfinished.
    fn free_path(&self, run: usize) -> PathBuf {
        let spec = &self.schedule.runs[run];
        let kind = if spec.kind == Kind::Measure { String::new() } else { format!("_{}", spec.kind.name()) };
        let stem = format!("{:04}{kind}_{}_{}Nm_{}rpm", run + 1, spec.direction, spec.load_nm, spec.speed_rpm);
        let names = (1..).map(|n| if n == 1 { format!("{stem}.mcap") } else { format!("{stem}_{n}.mcap") });
        // A part may outlive the first file of its log, where somebody clears away old ones.
        let taken: Vec<_> = [&self.directory, &self.directory.join(UNFINISHED)]
            .into_iter()
            .flat_map(|directory| std::fs::read_dir(directory).into_iter().flatten().flatten())
            .filter_map(|entry| log_name(&entry.path()))
            .collect();
        let free = |name: &String| !taken.contains(name);
        let name = names.into_iter().find(free).unwrap_or(stem);
        self.directory.join(name)
    }

    /// Goes on in a new log for `run`; the one before is finalised and entered in the journal, on other threads, so that neither
    /// encoders nor servo wait for a disk.
    async fn rotate(&mut self, rig: &mut ConnectedRig, run: usize) -> Result<(), StopReason> {
        let path = self.free_path(run);
        let (at, options, policy) = (path.clone(), writer_options(&self.profile), self.profile.log.clone());
        let (made, trouble) = in_the_background(rig, move || Recorder::create(&at, options, &policy)).await;
        let recorder = made?;
        self.describe(&recorder, run);
        let before = rig.acquisition.borrow_mut().change_recorder(recorder);
        let closing = self.current.replace(Current { run, path, finished: None });
        let (directory, journal) = (self.directory.clone(), self.journal.take());
        let (closed, other_trouble) = in_the_background(rig, move || {
            let mut journal = journal;
            let finished = before.finish();
            let entered = match (closing, &mut journal) {
                (Some(closing), Some(journal)) => close(journal, &directory, closing, finished.is_ok()),
                _ => Ok(()),
            };
            (journal, finished, entered)
        })
        .await;
        let (journal, finished, entered) = closed;
        self.journal = journal;
        finished.map_err(StopReason::Log)?;
        entered?;
        trouble.or(other_trouble).map_or(Ok(()), Err)
    }

    /// What is left, for the progress line.
    fn note(&self, job_index: usize) -> String {
        let left: f64 = self.estimate.runs_s.iter().skip(job_index).sum();
        let run = self.indices.get(job_index).map_or(0, |index| index + 1);
        format!("run {run}/{}, {} left", self.schedule.runs.len(), time(left))
    }

    fn figures(&self, rig: &ConnectedRig, index: usize, run: &RunSpec) -> FinishedRun {
        let acquisition = rig.acquisition.borrow();
        let log = self.current.as_ref().and_then(|current| current.path.file_name());
        let mut finished = FinishedRun {
            run: index,
            kind: run.kind.name().into(),
            direction: run.direction.to_string(),
            load_nm: run.load_nm,
            speed_rpm: run.speed_rpm,
            revolutions: run.revolutions,
            log: log.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
            at: now(),
            ended_ns: self.clock.now_ns(),
            samples: 0,
            losses: acquisition.lost() - self.lost_before,
            te_mean_rad: None,
            te_pp_rad: None,
            residual_rms_rad: None,
        };
        let analysis = acquisition.analysis();
        if let Some(measured) = analysis.runs().last().filter(|_| run.kind != Kind::WarmUp) {
            // Against the index, which is the campaign's one zero: drift shows.
            let figures = RunFigures::of(&measured.te, analysis.model(), None);
            finished.samples = measured.te.samples();
            finished.te_mean_rad = Some(figures.mean_rad);
            finished.te_pp_rad = Some(figures.pp_rad);
            finished.residual_rms_rad = Some(figures.residual_rms_rad);
        }
        finished
    }
}

#[async_trait(?Send)]
impl RunObserver for CampaignObserver {
    async fn begins(&mut self, rig: &mut ConnectedRig, job_index: usize, _: &RunSpec) -> Result<(), StopReason> {
        let Some(&run) = self.indices.get(job_index) else { return Ok(()) };
        let is_fresh = self.current.as_ref().is_some_and(|current| current.run == run && current.finished.is_none());
        if !is_fresh {
            self.rotate(rig, run).await?;
        }
        // What was lost before, with the rig at rest, is told in the log and is no loss of this run.
        self.lost_before = rig.acquisition.borrow().lost();
        rig.progress.note(self.note(job_index));
        Ok(())
    }

    async fn ended(&mut self, rig: &mut ConnectedRig, job_index: usize, spec: &RunSpec) -> Result<(), StopReason> {
        let Some(&run) = self.indices.get(job_index) else { return Ok(()) };
        let finished = self.figures(rig, run, spec);
        if !self.quiet {
            rig.progress.line(&super::report::line(&finished, self.schedule.runs.len()));
        }
        rig.acquisition.borrow_mut().analysis_mut().keep_last_of_each();
        if let Some(current) = &mut self.current {
            current.finished = Some(Box::new(finished));
        }
        Ok(())
    }

    async fn interrupted(
        &mut self,
        rig: &mut ConnectedRig,
        reason: &StopReason,
        goes_on: bool,
    ) -> Result<(), StopReason> {
        self.interruptions.push(reason.to_string());
        if !goes_on {
            // Told when the last log is finalised.
            return Ok(());
        }
        self.write(&Line::Interrupted { at: now(), why: reason.to_string(), goes_on })?;
        if matches!(reason, StopReason::Paused) {
            return Ok(());
        }
        // What was recorded up to here is kept, but beside: the run is done again in a log of its own.
        if let Some(run) = self.current.as_ref().filter(|current| current.finished.is_none()).map(|current| current.run)
        {
            rig.acquisition.borrow().event(Level::Warning, "unfinished", format!("run {} is begun again", run + 1));
            self.rotate(rig, run).await?;
        }
        Ok(())
    }
}

/// The name that the journal has for the log that a file belongs to: that of the log's first part. `None` for other files.
#[must_use]
pub fn log_name(path: &Path) -> Option<String> {
    path.extension().filter(|extension| *extension == "mcap")?;
    Some(part_path(path, 1).file_name()?.to_string_lossy().into_owned())
}

/// Moves a log, with all its parts, beside the finished ones. A crash on the way leaves parts that the next start moves.
///
/// # Errors
/// [`CampaignError::Io`].
pub fn put_aside(directory: &Path, log: &Path) -> Result<(), CampaignError> {
    let beside = directory.join(UNFINISHED);
    let failed = |path: &Path, action| {
        let path = path.to_owned();
        move |source| CampaignError::Io { path, action, source }
    };
    std::fs::create_dir_all(&beside).map_err(failed(&beside, "make"))?;
    let Some(wanted) = log_name(log) else { return Ok(()) };
    for entry in std::fs::read_dir(directory).map_err(failed(directory, "list"))?.flatten() {
        let part = entry.path();
        if log_name(&part).as_ref() != Some(&wanted) {
            continue;
        }
        match std::fs::rename(&part, beside.join(entry.file_name())) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            moved => moved.map_err(failed(&part, "put aside"))?,
        }
    }
    Ok(())
}

/// A finished run goes into the journal once its log is whole; any other log goes aside.
fn close(journal: &mut Journal, directory: &Path, closing: Current, finalised: bool) -> Result<(), CampaignError> {
    match closing.finished {
        Some(finished) if finalised => journal.write(&Line::Finished(finished)),
        _ => put_aside(directory, &closing.path),
    }
}

/// Work with files on a thread of its own; a rig that is on is polled meanwhile, for its lease runs. Also why it has to stop.
async fn in_the_background<T: Send + 'static>(
    rig: &mut ConnectedRig,
    work: impl FnOnce() -> T + Send + 'static,
) -> (T, Option<StopReason>) {
    let work = tokio::task::spawn_blocking(work);
    let mut trouble = None;
    while matches!(rig.state(), State::Standing | State::Turning) && !work.is_finished() && trouble.is_none() {
        trouble = rig.tick().await.err();
    }
    match work.await {
        Ok(done) => (done, trouble),
        Err(failure) => match failure.try_into_panic() {
            // The thread's panic goes on in ours: the message was printed where it arose.
            Ok(panic) => std::panic::resume_unwind(panic),
            // Only a runtime that is being dropped cancels, and then nobody waits here.
            Err(cancelled) => unreachable!("{cancelled}"),
        },
    }
}

fn now() -> String {
    jiff::Timestamp::now().to_string()
}
