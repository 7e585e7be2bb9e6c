//! Work on the rig that is no run: its runtime, links, log and clock, the same for real and simulated rigs.

use tokio::task::LocalSet;

use crate::clock::Clock;
use crate::run::connected_rig::ConnectedRig;
use crate::run::session::{self, Links, Outcome, RunConfig};
use crate::run::stop::StopRequests;
use crate::run::stop_reason::StopReason;
use crate::simulated;

/// Connects, lets `body` do its work, which leaves the rig off, and finalises the log. A rig that is emulated within this process, by
/// `seed` and at `rate_hz`, runs as fast as it can.
///
/// # Errors
/// What prevents the log or the runtime; everything later is in the outcome.
pub fn on_rig(
    config: RunConfig,
    seed: u64,
    rate_hz: f64,
    body: impl AsyncFnOnce(&mut ConnectedRig) -> (Option<StopReason>, Vec<String>),
) -> Result<Outcome, String> {
    let simulated = config.profile.in_process();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(simulated).build();
    let runtime = runtime.map_err(|error| error.to_string())?;
    LocalSet::new().block_on(&runtime, async {
        let stop = StopRequests::listen().map_err(|error| format!("signals: {error}"))?;
        let links = if simulated {
            let mut spec = simulated::spec(&config.model, &[]).map_err(|error| error.to_string())?;
            simulated::mount_discs(&mut spec, &config.profile);
            simulated::start_in_process(&spec, rate_hz, seed).map_err(|error| error.to_string())?
        } else {
            Links::default()
        };
        let clock = if simulated { Clock::simulated() } else { Clock::real() };
        let context = config.begin(0.0, links, clock, stop).map_err(|error| error.to_string())?;
        Ok(session::with_rig(context, body).await)
    })
}
