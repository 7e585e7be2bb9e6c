//! A session: open the log, connect, run the plan, switch off, finalise, and say what came of it.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use gearmodel::NominalModel;
use nix::libc::SIGXFSZ;
use riglog::proto::{Level, Phase};
use riglog::{LogError, RunMetadata, WriterOptions};
use tokio::signal::unix::{Signal, SignalKind, signal};

use super::acquire::Acquisition;
use super::connected_rig::{ConnectedRig, Devices};
use super::dialer::{Dialer, Redial};
use super::job::Job;
use super::observer::RunObserver;
use super::panic::survive;
use super::plan::RunPlan;
use super::progress::Progress;
use super::recorder::{Entry, Recorder};
use super::run_job::{Policy, run_job};
use super::stop::StopRequests;
use super::stop_reason::StopReason;
use super::supervisor::Event;
use crate::analysis::Analysis;
use crate::clock::Clock;
use crate::device::DeviceKind;
use crate::device::bus::BusStatistics;
use crate::device::drivers::{self, UnknownDriver};
use crate::link::Link;
use crate::profile::Profile;

/// This program, as logs name it.
const SOFTWARE: &str = concat!("rigd ", env!("CARGO_PKG_VERSION"));

/// What came of a session.
pub struct Outcome {
    /// TE and backlash of what was recorded.
    pub analysis: Analysis,
    /// Why it ended before its time.
    pub stop_reason: Option<StopReason>,
    /// What went wrong while switching off or finalising.
    pub troubles: Vec<String>,
    /// Samples that never arrived, and samples of the whole log.
    pub lost: u64,
    /// Entries that could not be written.
    pub unwritten: u64,
    /// The last log was written to its end.
    pub finalised: bool,
    /// What happened on each device's line.
    pub lines: BTreeMap<&'static str, BusStatistics>,
    /// What two readers' clocks are worth in TE.
    pub time_skew: Option<crate::summary::TimeSkew>,
}

/// The links to the three devices; `None` where the profile's port is to be opened.
#[derive(Default)]
pub struct Links {
    /// To the servo.
    pub servo: Option<Link>,
    /// To the brake's driver.
    pub brake: Option<Link>,
    /// To the counter.
    pub counter: Option<Link>,
    /// Makes them another time, where devices are emulated within this process.
    pub again: Option<Redial>,
}

/// A rig, and what the log says of the work on it.
pub struct RunConfig {
    /// Where the log goes.
    pub path: PathBuf,
    /// The rig.
    pub profile: Profile,
    /// The model in force.
    pub model: NominalModel,
    /// Operator, note and pair.
    pub head: LogHead,
    /// Senses, loads and speeds.
    pub conditions: RunMetadata,
    /// No progress line.
    pub quiet: bool,
}

impl RunConfig {
    /// Makes the log, before anything is connected; `revolutions` are what the progress line goes up to.
    ///
    /// # Errors
    /// [`LogError`] when the log cannot be made.
    pub fn begin(
        self,
        revolutions: f64,
        links: Links,
        clock: Clock,
        stop: StopRequests,
    ) -> Result<SessionContext, LogError> {
        let Self { path, profile, model, head, conditions, quiet } = self;
        let recorder = Recorder::create(&path, writer_options(&profile), &profile.log)?;
        head.describe(&recorder, &profile, conditions, clock);
        let progress = Progress::new(revolutions, quiet);
        Ok(SessionContext { profile, model, recorder, progress, links, clock, stop })
    }
}

/// What is to be run, and how it goes on where it is interrupted.
pub struct JobSpec {
    /// The runs.
    pub job: Job,
    /// What is waited for instead of ending.
    pub policy: Policy,
}

/// Connects, does the job, switches off, and finalises the log that is then being written.
pub async fn execute_job(context: SessionContext, spec: JobSpec, observer: &mut dyn RunObserver) -> Outcome {
    let JobSpec { mut job, policy } = spec;
    with_rig(context, async |rig| run_job(rig, &mut job, policy, observer).await).await
}

/// What a session on the rig needs, whatever is done in it.
pub struct SessionContext {
    /// The rig.
    pub profile: Profile,
    /// The model in force.
    pub model: NominalModel,
    /// The log.
    pub recorder: Recorder,
    /// The progress line.
    pub progress: Progress,
    /// The links to the devices.
    pub links: Links,
    /// The host's clock.
    pub clock: Clock,
    /// The operator's wishes.
    pub stop: StopRequests,
}

/// Connects, lets `body` do its work, which leaves the rig off, and finalises the log that is then being written. [`run_job`] is a body;
/// so is [`once`] around anything else.
pub async fn with_rig(
    context: SessionContext,
    body: impl AsyncFnOnce(&mut ConnectedRig) -> (Option<StopReason>, Vec<String>),
) -> Outcome {
    let _size_limit = outlive_size_limit();
    let SessionContext { profile, model, recorder, progress, links, clock, stop } = context;
    let acquisition = Rc::new(RefCell::new(Acquisition::new(recorder, clock, Analysis::new(model))));
    let dialer = Dialer::new(profile.clone(), links.again.clone());
    let mut lines = BTreeMap::new();
    let (reason, mut troubles) = match connect(&dialer, links).await {
        Ok(devices) => {
            let mut rig = ConnectedRig::new(profile, devices, dialer, Rc::clone(&acquisition), clock, stop, progress);
            let outcome = body(&mut rig).await;
            lines.extend(statistics(&rig));
            leave(rig, outcome).await
        }
        Err(error) => {
            acquisition.borrow().event(Level::Error, "connect", error.to_string());
            (Some(error), Vec::new())
        }
    };
    for trouble in &troubles {
        acquisition.borrow().event(Level::Error, "switch-off", trouble.clone());
    }
    // The reader's task has ended with the rig, so ours is the last hold on the acquisition.
    let Some(acquisition) = Rc::into_inner(acquisition) else { unreachable!("the rig and its tasks are gone") };
    let acquisition = acquisition.into_inner();
    let lost = acquisition.lost();
    let time_skew = acquisition.time_skew();
    let (recorder, analysis) = acquisition.into_parts();
    let late_failure = recorder.take_failure();
    let unwritten = recorder.unwritten();
    let mut reason = reason.or(late_failure.map(StopReason::Log));
    let mut finalised = true;
    if let Err(error) = recorder.finish() {
        finalised = false;
        if reason.is_none() {
            reason = Some(StopReason::Log(error));
        } else {
            troubles.push(format!("the log could not be finalised: {error}"));
        }
    }
    Outcome { analysis, stop_reason: reason, troubles, lost, unwritten, finalised, lines, time_skew }
}

/// Does some work on the rig once, and switches off whatever came of it, a panic too.
pub async fn once(
    rig: &mut ConnectedRig,
    work: impl AsyncFnOnce(&mut ConnectedRig) -> Result<(), StopReason>,
) -> (Option<StopReason>, Vec<String>) {
    let reason = survive(work(&mut *rig)).await.err();
    if let Some(reason) = &reason {
        rig.acquisition.borrow().event(Level::Error, "halt", reason.to_string());
    }
    let troubles = rig.switch_off(reason.as_ref().map_or(Event::Finished, StopReason::event)).await;
    (reason, troubles)
}

/// What happened on the devices' lines.
fn statistics(rig: &ConnectedRig) -> [(&'static str, BusStatistics); 2] {
    [("servo", rig.servo.statistics()), ("brake", rig.brake.statistics())]
}

/// Leaves a rig that is off: ends the stream, and says what the lines were like.
pub async fn leave(
    mut rig: ConnectedRig,
    outcome: (Option<StopReason>, Vec<String>),
) -> (Option<StopReason>, Vec<String>) {
    let (reason, mut troubles) = outcome;
    troubles.extend(rig.end_stream().await);
    rig.enter(Phase::Idle);
    for (device, line) in statistics(&rig) {
        rig.acquisition.borrow().event(Level::Info, "line", format!("{device}: {line}"));
    }
    rig.progress.finish();
    // A stop that came while the rig was stopping by itself was a stop all the same.
    let reason = reason.or_else(|| rig.check_stop().err());
    (reason, troubles)
}

/// A log that reaches the process's file size limit (`ulimit -f`) shall be an error of the write and a stop in order; unhandled, the
/// signal would kill the daemon with the motor on.
fn outlive_size_limit() -> Option<Signal> {
    signal(SignalKind::from_raw(SIGXFSZ)).inspect_err(|error| tracing::warn!("SIGXFSZ is not handled: {error}")).ok()
}

/// What every log of a session says of itself.
#[derive(Debug, Clone, Default)]
pub struct LogHead {
    /// Who runs it.
    pub operator: String,
    /// What it is for.
    pub note: String,
    /// The gear pair as it was given.
    pub pair_toml: String,
    /// The plan as it was given, of a campaign.
    pub plan_toml: Option<String>,
}

impl LogHead {
    /// Writes metadata and attachments; `conditions` has direction, loads, speeds and revolutions.
    pub fn describe(&self, recorder: &Recorder, profile: &Profile, conditions: RunMetadata, clock: Clock) {
        let now = clock.now_ns();
        let run = RunMetadata {
            run_id: uuid::Uuid::new_v4().to_string(),
            started: jiff::Timestamp::now().to_string(),
            software: SOFTWARE.into(),
            host: nix::unistd::gethostname().ok().and_then(|name| name.into_string().ok()).unwrap_or_default(),
            backend: profile.name.clone(),
            operator: self.operator.clone(),
            note: self.note.clone(),
            ..conditions
        };
        recorder.write(now, now, Entry::Run(Box::new(run)));
        let attach = |name, text: &str| {
            recorder.write(now, now, Entry::Attachment(name, "application/toml", text.as_bytes().to_vec()));
        };
        attach("pair.toml", &self.pair_toml);
        attach("rig.toml", &profile.to_toml());
        if let Some(calibration) = &profile.calibration_toml {
            attach(crate::calibration::ATTACHMENT, calibration);
        }
        if let Some(plan) = &self.plan_toml {
            attach("plan.toml", plan);
        }
    }
}

/// How a session writes its logs.
#[must_use]
pub fn writer_options(profile: &Profile) -> WriterOptions {
    WriterOptions {
        chunk_period_ms: profile.log.chunk_ms,
        sync_period_ms: profile.log.sync_ms,
        ..WriterOptions::new(SOFTWARE)
    }
}

/// Opens the three devices.
///
/// # Errors
/// [`StopReason::Link`], [`StopReason::Driver`].
pub async fn connect(dialer: &Dialer, links: Links) -> Result<Devices, StopReason> {
    Ok(Devices {
        servo: dialer.servo(links.servo).await?,
        brake: dialer.brake(links.brake).await?,
        counter: dialer.counter(links.counter).await?,
    })
}

/// Checks that every driver of the profile exists, before anything is opened or written.
///
/// # Errors
/// [`UnknownDriver`] lists those that there are.
pub fn check_drivers(profile: &Profile) -> Result<(), UnknownDriver> {
    drivers::find(drivers::SERVOS, DeviceKind::Servo, &profile.servo.driver)?;
    drivers::find(drivers::BRAKES, DeviceKind::Brake, &profile.brake.driver)?;
    drivers::find(drivers::COUNTERS, DeviceKind::Counter, &profile.counter.driver)?;
    Ok(())
}

/// A log's path: start, senses, load and speed in its name; never one that exists.
#[must_use]
pub fn log_path(directory: &Path, plan: &RunPlan) -> PathBuf {
    let senses: Vec<_> = plan.directions.iter().map(ToString::to_string).collect();
    let loads: Vec<_> = plan.loads_nm.iter().map(|load| format!("{load}Nm")).collect();
    let loads = if loads.len() > 3 { format!("{}-{}", loads[0], loads[loads.len() - 1]) } else { loads.join("-") };
    free_path(directory, &format!("{}_{loads}_{}rpm", senses.join("-"), plan.speed_rpm))
}

/// A log's path: start, and what is done, in its name; never one that exists.
#[must_use]
pub fn free_path(directory: &Path, what: &str) -> PathBuf {
    let stem = format!("{}_{what}", jiff::Timestamp::now().strftime("%Y%m%dT%H%M%SZ"));
    (0..)
        .map(|n| directory.join(if n == 0 { format!("{stem}.mcap") } else { format!("{stem}_{n}.mcap") }))
        .find(|path| !path.exists())
        .unwrap_or_else(|| directory.join(format!("{stem}.mcap")))
}
