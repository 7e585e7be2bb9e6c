//! The simulated rig within this process, in virtual time: faults at known instants, and the plant's own truth.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

use gearmodel::Direction;
use rigd::analysis::Analysis;
use rigd::clock::Clock;
use rigd::profile::Profile;
use rigd::run::job::{Job, Kind, RunSpec};
use rigd::run::observer::NoObserver;
use rigd::run::progress::Progress;
use rigd::run::recorder::Recorder;
use rigd::run::run_job::Policy;
use rigd::run::session::{self, JobSpec, LogHead, Outcome, SessionContext};
use rigd::run::stop::StopRequests;
use rigd::{replay, simulated};
use riglog::pair;
use riglog::{LogReader, Record, RunMetadata};
use rigsim::simulated_rig::SimulatedRig;
use tempfile::TempDir;
use tokio::task::LocalSet;
use tokio::time::sleep;

/// rpm a rad/s.
const RPM: f64 = 60.0 / std::f64::consts::TAU;

/// Runs in virtual time.
pub fn in_virtual_time<T>(work: impl Future<Output = T>) -> T {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build().expect("a runtime");
    LocalSet::new().block_on(&runtime, work)
}

/// One rig and what is done to it.
#[derive(Clone)]
pub struct Bench {
    pub world: Rc<RefCell<SimulatedRig>>,
    pub profile: Profile,
    pub clock: Clock,
    pub stop: StopRequests,
    pub directory: Rc<TempDir>,
    pub rate_hz: f64,
}

impl Bench {
    /// Within a virtual time.
    pub fn new(seed: u64) -> Self {
        let rate_hz = 2000.0;
        let (_, model) = pair::load(None).expect("the built-in pair");
        let spec = simulated::spec(&model, &[]).expect("a plant");
        let mut profile = Profile::simulated();
        let sequence = &mut profile.sequence;
        (sequence.home_rpm, sequence.settle_s, sequence.load_s) = (30.0, 0.4, 0.4);
        Self {
            world: Rc::new(RefCell::new(SimulatedRig::new(&spec, rate_hz, seed).expect("a world"))),
            profile,
            clock: Clock::simulated(),
            stop: StopRequests::default(),
            directory: Rc::new(TempDir::new().expect("a directory")),
            rate_hz,
        }
    }

    pub fn log(&self) -> PathBuf {
        self.directory.path().join("run.mcap")
    }

    /// A run of 10 N·m at 30 rpm.
    pub fn job(&self, revolutions: f64) -> Job {
        let run =
            RunSpec { kind: Kind::Measure, direction: Direction::Ccw, load_nm: 10.0, speed_rpm: 30.0, revolutions };
        Job::new(vec![run], self.rate_hz, 0)
    }

    pub fn recorder(&self) -> Recorder {
        let recorder =
            Recorder::create(&self.log(), session::writer_options(&self.profile), &self.profile.log).expect("a log");
        let (pair_toml, _) = pair::load(None).expect("the built-in pair");
        let head = LogHead { pair_toml, ..LogHead::default() };
        head.describe(&recorder, &self.profile, RunMetadata::default(), self.clock);
        recorder
    }

    /// What a session on this rig needs.
    pub fn context(&self, revolutions: f64) -> SessionContext {
        let (_, model) = pair::load(None).expect("the built-in pair");
        SessionContext {
            profile: self.profile.clone(),
            model,
            recorder: self.recorder(),
            progress: Progress::new(revolutions, true),
            links: simulated::links_to(&self.world),
            clock: self.clock,
            stop: self.stop.clone(),
        }
    }

    /// Does a job through real drivers and bytes.
    pub async fn run(&self, job: Job, policy: Policy) -> Outcome {
        session::execute_job(self.context(job.revolutions()), JobSpec { job, policy }, &mut NoObserver).await
    }

    /// Until the shafts turn under load at speed, and a while.
    pub async fn at_speed(&self, seconds: f64) {
        loop {
            sleep(Duration::from_millis(50)).await;
            let truth = self.world.borrow_mut().truth();
            if truth.speeds_rad_per_s[0] * RPM > 25.0 && truth.brake_torque_nm.abs() > 8.0 {
                return sleep(Duration::from_secs_f64(seconds)).await;
            }
        }
    }

    /// The fastest shaft, rpm.
    pub fn speed_rpm(&self) -> f64 {
        let truth = self.world.borrow_mut().truth();
        truth.speeds_rad_per_s.iter().map(|speed| (speed * RPM).abs()).fold(0.0, f64::max)
    }

    pub fn brake_torque_nm(&self) -> f64 {
        self.world.borrow_mut().truth().brake_torque_nm.abs()
    }

    /// Time, name and text of every event in the log.
    pub fn events(&self) -> Vec<(u64, String, String)> {
        events(&self.log())
    }

    pub fn event(&self, name: &str, needle: &str) -> (u64, String) {
        let events = self.events();
        let found = events.iter().find(|(_, what, text)| what == name && text.contains(needle));
        let (at, _, text) = found.unwrap_or_else(|| panic!("no event {name} '{needle}' in {events:#?}"));
        (*at, text.clone())
    }

    /// The log's runs as a replay finds them.
    pub fn replayed(&self) -> (Analysis, replay::Replayed) {
        replayed(&self.log())
    }
}

pub fn events(log: &Path) -> Vec<(u64, String, String)> {
    let records = LogReader::open(log).expect("a readable log");
    records
        .flatten()
        .filter_map(|record| match record {
            Record::Event { log_time_ns, event, .. } => Some((log_time_ns, event.name, event.message)),
            _ => None,
        })
        .collect()
}

pub fn replayed(log: &Path) -> (Analysis, replay::Replayed) {
    let (_, model) = pair::load(None).expect("the built-in pair");
    let mut analysis = Analysis::new(model);
    let found = replay::replay(&[log.to_owned()], &mut analysis, None).expect("it replays");
    (analysis, found)
}
