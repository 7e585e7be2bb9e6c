//! A session: open the log, connect, run the plan, switch off, finalise, and say what came of it.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::task::Poll;

use gearmodel::NominalModel;
use nix::libc::SIGXFSZ;
use riglog::proto::Level;
use riglog::{LogError, RunMetadata, WriterOptions};
use tokio::signal::unix::{Signal, SignalKind, signal};

use super::Plan;
use super::acquire::Acquisition;
use super::halt::Halt;
use super::progress::Progress;
use super::recorder::{Entry, Recorder};
use super::rig::Rig;
use super::sequence;
use super::stop::StopRequests;
use crate::analysis::Analysis;
use crate::clock::Clock;
use crate::device::{self, Brake, Counter, Servo, UnknownDriver};
use crate::link::{Address, Link, LinkError};
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
}

/// The three drivers.
struct Devices {
    servo: Box<dyn Servo>,
    brake: Box<dyn Brake>,
    counter: Box<dyn Counter>,
}

/// Runs a session. Only what prevents the log itself is an error; everything later is in the outcome.
///
/// # Errors
/// [`LogError`] when the log cannot be made.
pub async fn run(setup: Setup, links: Links, clock: Clock, stop: StopRequests) -> Result<Outcome, LogError> {
    let plan = setup.plan.clone();
    conduct(setup, links, clock, stop, async |rig, counter| sequence::execute(rig, counter, &plan).await).await
}

/// As [`run`], with `body` in place of the sequence of a run; it need not switch off.
///
/// # Errors
/// [`LogError`] when the log cannot be made.
pub async fn conduct(
    setup: Setup,
    links: Links,
    clock: Clock,
    stop: StopRequests,
    body: impl AsyncFnOnce(&mut Rig, Box<dyn Counter>) -> Result<(), Halt>,
) -> Result<Outcome, LogError> {
    let run_id = uuid::Uuid::new_v4().to_string();
    let recorder = Recorder::create(
        &setup.path,
        WriterOptions {
            chunk_period_ms: setup.profile.log.chunk_ms,
            sync_period_ms: setup.profile.log.sync_ms,
            ..WriterOptions::new(SOFTWARE)
        },
        &setup.profile.log,
        &run_id,
    )?;
    let _size_limit = outlive_size_limit();
    describe(&recorder, &setup, run_id, clock);
    let analysis = Analysis::new(setup.model.clone());
    let acquisition = Rc::new(RefCell::new(Acquisition::new(recorder, clock, analysis)));
    let total = setup.plan.revolutions * (setup.plan.loads_nm.len() * setup.plan.directions.len()) as f64;
    let progress = Progress::new(total, setup.quiet);

    let (halt, mut troubles) = match connect(&setup.profile, links).await {
        Ok(devices) => {
            let mut rig = Rig::new(
                setup.profile.clone(),
                devices.servo,
                devices.brake,
                Rc::clone(&acquisition),
                clock,
                stop,
                progress,
            );
            let halt = survive(body(&mut rig, devices.counter)).await.err();
            if let Some(halt) = &halt {
                acquisition.borrow().event(Level::Error, "halt", halt.to_string());
            }
            let troubles = rig.switch_off(rig.stop.hurried()).await;
            for (device, line) in [("servo", rig.servo.statistics()), ("brake", rig.brake.statistics())] {
                acquisition.borrow().event(Level::Info, "line", format!("{device}: {line}"));
            }
            rig.progress.finish();
            // A stop that came while the rig was stopping by itself was a stop all the same.
            let halt = halt.or_else(|| rig.heed_stop().err());
            (halt, troubles)
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
    let (recorder, analysis) = acquisition.into_parts();
    let late_failure = recorder.take_failure();
    let unwritten = recorder.unwritten();
    let mut halt = halt.or(late_failure.map(Halt::Log));
    if let Err(error) = recorder.finish() {
        if halt.is_none() {
            halt = Some(Halt::Log(error));
        } else {
            troubles.push(format!("the log could not be finalised: {error}"));
        }
    }
    Ok(Outcome { analysis, halt, troubles, lost, unwritten })
}

/// Makes a panic of the sequence a reason to switch off in order, as any other.
async fn survive(sequence: impl Future<Output = Result<(), Halt>>) -> Result<(), Halt> {
    let mut sequence = std::pin::pin!(sequence);
    std::future::poll_fn(|context| {
        // The rig is only switched off afterwards, from whatever state it is in.
        catch_unwind(AssertUnwindSafe(|| sequence.as_mut().poll(context))).unwrap_or_else(|panic| {
            let what = panic.downcast_ref::<&str>().map(ToString::to_string);
            let what = what.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
            Poll::Ready(Err(Halt::Panic { what }))
        })
    })
    .await
}

/// A log that reaches the process's file size limit (`ulimit -f`) shall be an error of the write and a stop in order; unhandled, the
/// signal would kill the daemon with the motor on.
fn outlive_size_limit() -> Option<Signal> {
    signal(SignalKind::from_raw(SIGXFSZ)).inspect_err(|error| tracing::warn!("SIGXFSZ is not handled: {error}")).ok()
}

/// Metadata and attachments that say what this log is.
fn describe(recorder: &Recorder, setup: &Setup, run_id: String, clock: Clock) {
    let plan = &setup.plan;
    let now = clock.now_ns();
    let directions: Vec<_> = plan.directions.iter().map(ToString::to_string).collect();
    recorder.write(
        now,
        now,
        Entry::Run(Box::new(RunMetadata {
            run_id,
            started: jiff::Timestamp::now().to_string(),
            software: SOFTWARE.into(),
            host: nix::unistd::gethostname().ok().and_then(|name| name.into_string().ok()).unwrap_or_default(),
            backend: setup.profile.name.clone(),
            operator: setup.operator.clone(),
            note: setup.note.clone(),
            direction: directions.join(","),
            load_nm: plan.loads_nm.clone(),
            speed_rpm: vec![plan.speed_rpm],
            revolutions: Some(plan.revolutions),
        })),
    );
    let attach = |name, text: &str| {
        recorder.write(now, now, Entry::Attachment(name, "application/toml", text.as_bytes().to_vec()));
    };
    attach("pair.toml", &setup.pair_toml);
    attach("rig.toml", &setup.profile.to_toml());
    if let Some(calibration) = &setup.profile.calibration_toml {
        attach(crate::calibration::ATTACHMENT, calibration);
    }
}

async fn connect(profile: &Profile, links: Links) -> Result<Devices, Halt> {
    let (servo, brake, counter) = (&profile.servo, &profile.brake, &profile.counter);
    let address =
        |device, port: &str, baud, format: &str| Address { device, port: port.into(), baud, format: format.into() };
    let at_servo = address("servo", &servo.port, servo.baud, &servo.format);
    let at_brake = address("brake", &brake.port, brake.baud, &brake.format);
    let at_counter = address("counter", &counter.port, counter.baud, &counter.format);
    let open_servo = device::find(device::SERVOS, "servo", &servo.driver)?;
    let open_brake = device::find(device::BRAKES, "brake", &brake.driver)?;
    let open_counter = device::find(device::COUNTERS, "counter", &counter.driver)?;
    Ok(Devices {
        servo: open_servo(open(links.servo, &at_servo).await?, at_servo, servo),
        brake: open_brake(open(links.brake, &at_brake).await?, at_brake, brake),
        counter: open_counter(open(links.counter, &at_counter).await?, at_counter, counter),
    })
}

async fn open(link: Option<Link>, address: &Address) -> Result<Link, LinkError> {
    match link {
        Some(link) => Ok(link),
        None => address.open().await,
    }
}

/// Checks that every driver of the profile exists, before anything is opened or written.
///
/// # Errors
/// [`UnknownDriver`] lists those that there are.
pub fn check_drivers(profile: &Profile) -> Result<(), UnknownDriver> {
    device::find(device::SERVOS, "servo", &profile.servo.driver)?;
    device::find(device::BRAKES, "brake", &profile.brake.driver)?;
    device::find(device::COUNTERS, "counter", &profile.counter.driver)?;
    Ok(())
}

/// A log's path: start, senses, load and speed in its name; never one that exists.
#[must_use]
pub fn log_path(directory: &Path, plan: &Plan) -> PathBuf {
    let time = jiff::Timestamp::now().strftime("%Y%m%dT%H%M%SZ").to_string();
    let senses: Vec<_> = plan.directions.iter().map(ToString::to_string).collect();
    let loads: Vec<_> = plan.loads_nm.iter().map(|load| format!("{load}Nm")).collect();
    let loads = if loads.len() > 3 { format!("{}-{}", loads[0], loads[loads.len() - 1]) } else { loads.join("-") };
    let stem = format!("{time}_{}_{loads}_{}rpm", senses.join("-"), plan.speed_rpm);
    (0..)
        .map(|n| directory.join(if n == 0 { format!("{stem}.mcap") } else { format!("{stem}_{n}.mcap") }))
        .find(|path| !path.exists())
        .unwrap_or_else(|| directory.join(format!("{stem}.mcap")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_panic_is_a_halt_with_its_message() {
        let outcome = survive(async {
            tokio::task::yield_now().await;
            panic!("no such {}", "thing")
        })
        .await;
        assert!(matches!(outcome, Err(Halt::Panic { what }) if what == "no such thing"));
        assert!(survive(async { Ok(()) }).await.is_ok());
        assert!(matches!(survive(async { Err(Halt::Operator) }).await, Err(Halt::Operator)));
    }
}
