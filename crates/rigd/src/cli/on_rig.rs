//! Work on the rig that is no run: its runtime, links, log and clock, the same for real and simulated rigs.

use std::path::PathBuf;

use gearmodel::NominalModel;
use riglog::RunMetadata;
use tokio::task::LocalSet;

use crate::clock::Clock;
use crate::profile::Profile;
use crate::run::halt::Halt;
use crate::run::progress::Progress;
use crate::run::recorder::Recorder;
use crate::run::rig::Rig;
use crate::run::session::{self, Frame, Links, LogHead, Outcome};
use crate::run::stop::StopRequests;
use crate::simulated;

/// A rig, and what the log says of the work on it.
pub struct OnRig {
    /// The log.
    pub path: PathBuf,
    /// The rig; one that is emulated within this process runs as fast as it can.
    pub profile: Profile,
    /// The model in force.
    pub model: NominalModel,
    /// Operator, note and pair.
    pub head: LogHead,
    /// Senses, loads and speeds.
    pub conditions: RunMetadata,
    /// Seed of the simulated rig.
    pub seed: u64,
    /// Sampling, Hz.
    pub rate_hz: f64,
    /// No progress line.
    pub quiet: bool,
}

/// Connects, lets `body` do its work, which leaves the rig off, and finalises the log.
///
/// # Errors
/// What prevents the log or the runtime; everything later is in the outcome.
pub fn on_rig(work: OnRig, body: impl AsyncFnOnce(&mut Rig) -> (Option<Halt>, Vec<String>)) -> Result<Outcome, String> {
    let simulated = work.profile.in_process();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(simulated).build();
    let runtime = runtime.map_err(|error| error.to_string())?;
    LocalSet::new().block_on(&runtime, async {
        let stop = StopRequests::listen().map_err(|error| format!("signals: {error}"))?;
        let links = if simulated {
            let mut spec = simulated::spec(&work.model, &[]).map_err(|error| error.to_string())?;
            simulated::mount_discs(&mut spec, &work.profile);
            simulated::start_in_process(&spec, work.rate_hz, work.seed).map_err(|error| error.to_string())?
        } else {
            Links::default()
        };
        let clock = if simulated { Clock::simulated() } else { Clock::real() };
        let options = session::writer_options(&work.profile);
        let recorder = Recorder::create(&work.path, options, &work.profile.log).map_err(|error| error.to_string())?;
        work.head.describe(&recorder, &work.profile, work.conditions, clock);
        let progress = Progress::new(0.0, work.quiet);
        let frame = Frame { profile: work.profile, model: work.model, recorder, progress, links, clock, stop };
        Ok(session::with_rig(frame, body).await)
    })
}
