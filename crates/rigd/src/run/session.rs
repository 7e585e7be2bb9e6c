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

use super::Plan;
use super::acquire::Acquisition;
use super::attend::{Policy, attend};
use super::dialer::{Dialer, Redial};
use super::halt::Halt;
use super::job::Job;
use super::observer::{NoObserver, RunObserver};
use super::panic::survive;
use super::progress::Progress;
use super::recorder::{Entry, Recorder};
use super::rig::{Devices, Rig};
use super::stop::StopRequests;
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

/// What a session needs.
pub struct Setup {
    /// What to measure.
    pub plan: Plan,
    /// The rig.
    pub profile: Profile,
    /// The model in force.
    pub model: NominalModel,
    /// `pair.toml` as it was given, for the log.
    pub pair_toml: String,
    /// Where the log goes.
    pub path: PathBuf,
    /// For the log.
    pub operator: String,
    /// For the log.
    pub note: String,
    /// No progress line.
    pub quiet: bool,
    /// What is waited for instead of ending.
    pub policy: Policy,
}

/// What came of a session.
pub struct Outcome {
    /// TE and backlash of what was recorded.
    pub analysis: Analysis,
    /// Why it ended before its time.
    pub halt: Option<Halt>,
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

/// Runs a session. Only what prevents the log itself is an error; everything later is in the outcome.
///
/// # Errors
/// [`LogError`] when the log cannot be made.
pub async fn run(setup: Setup, links: Links, clock: Clock, stop: StopRequests) -> Result<Outcome, LogError> {
    let recorder = Recorder::create(&setup.path, writer_options(&setup.profile), &setup.profile.log)?;
    let log = LogHead {
        operator: setup.operator.clone(),
        note: setup.note.clone(),
        pair_toml: setup.pair_toml.clone(),
        plan_toml: None,
    };
    let directions: Vec<_> = setup.plan.directions.iter().map(ToString::to_string).collect();
    let conditions = RunMetadata {
        direction: directions.join(","),
        load_nm: setup.plan.loads_nm.clone(),
        speed_rpm: vec![setup.plan.speed_rpm],
        revolutions: Some(setup.plan.revolutions),
        ..RunMetadata::default()
    };
    log.describe(&recorder, &setup.profile, conditions, clock);
    let work = Work {
        profile: setup.profile,
        model: setup.model,
        job: Job::of(&setup.plan),
        policy: setup.policy,
        quiet: setup.quiet,
    };
    Ok(conduct(work, recorder, &mut NoObserver, links, clock, stop).await)
}

/// A job and the rig to do it on.
pub struct Work {
    /// The rig.
    pub profile: Profile,
    /// The model in force.
    pub model: NominalModel,
    /// The runs.
    pub job: Job,
    /// What is waited for instead of ending.
    pub policy: Policy,
    /// No progress line.
    pub quiet: bool,
}

/// Connects, does the job, switches off, and finalises the log that is then being written.
pub async fn conduct(
    work: Work,
    recorder: Recorder,
    observer: &mut dyn RunObserver,
    links: Links,
    clock: Clock,
    stop: StopRequests,
) -> Outcome {
    let Work { profile, model, mut job, policy, quiet } = work;
    let progress = Progress::new(job.revolutions(), quiet);
    let frame = Frame { profile, model, recorder, progress, links, clock, stop };
    with_rig(frame, async |rig| attend(rig, &mut job, policy, observer).await).await
}

/// What a session on the rig needs, whatever is done in it.
pub struct Frame {
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

/// Connects, lets `body` do its work, which leaves the rig off, and finalises the log that is then being written. [`attend`] is a body;
/// so is [`once`] around anything else.
pub async fn with_rig(frame: Frame, body: impl AsyncFnOnce(&mut Rig) -> (Option<Halt>, Vec<String>)) -> Outcome {
    let _size_limit = outlive_size_limit();
    let Frame { profile, model, recorder, progress, links, clock, stop } = frame;
    let acquisition = Rc::new(RefCell::new(Acquisition::new(recorder, clock, Analysis::new(model))));
    let dialer = Dialer::new(profile.clone(), links.again.clone());
    let mut lines = BTreeMap::new();
    let (halt, mut troubles) = match connect(&dialer, links).await {
        Ok(devices) => {
            let mut rig = Rig::new(profile, devices, dialer, Rc::clone(&acquisition), clock, stop, progress);
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
    let mut halt = halt.or(late_failure.map(Halt::Log));
    let mut finalised = true;
    if let Err(error) = recorder.finish() {
        finalised = false;
        if halt.is_none() {
            halt = Some(Halt::Log(error));
        } else {
            troubles.push(format!("the log could not be finalised: {error}"));
        }
    }
    Outcome { analysis, halt, troubles, lost, unwritten, finalised, lines, time_skew }
}

/// Does some work on the rig once, and switches off whatever came of it, a panic too.
pub async fn once(rig: &mut Rig, work: impl AsyncFnOnce(&mut Rig) -> Result<(), Halt>) -> (Option<Halt>, Vec<String>) {
    let halt = survive(work(&mut *rig)).await.err();
    if let Some(halt) = &halt {
        rig.acquisition.borrow().event(Level::Error, "halt", halt.to_string());
    }
    let troubles = rig.switch_off(halt.as_ref().map_or(Event::Finished, Halt::event)).await;
    (halt, troubles)
}

/// What happened on the devices' lines.
fn statistics(rig: &Rig) -> [(&'static str, BusStatistics); 2] {
    [("servo", rig.servo.statistics()), ("brake", rig.brake.statistics())]
}

/// Leaves a rig that is off: ends the stream, and says what the lines were like.
pub async fn leave(mut rig: Rig, outcome: (Option<Halt>, Vec<String>)) -> (Option<Halt>, Vec<String>) {
    let (halt, mut troubles) = outcome;
    troubles.extend(rig.end_stream().await);
    rig.enter(Phase::Idle);
    for (device, line) in statistics(&rig) {
        rig.acquisition.borrow().event(Level::Info, "line", format!("{device}: {line}"));
    }
    rig.progress.finish();
    // A stop that came while the rig was stopping by itself was a stop all the same.
    let halt = halt.or_else(|| rig.heed_stop().err());
    (halt, troubles)
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
/// [`Halt::Link`], [`Halt::Driver`].
pub async fn connect(dialer: &Dialer, links: Links) -> Result<Devices, Halt> {
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
pub fn log_path(directory: &Path, plan: &Plan) -> PathBuf {
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
