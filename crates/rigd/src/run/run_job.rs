//! Attends to a job: runs it, switches off whatever ends it, and goes on where a policy says that it may.

use std::time::Duration;

use riglog::proto::{Level, Phase};
use tokio::time::{Instant, sleep};

use super::connected_rig::ConnectedRig;
use super::job::Job;
use super::observer::RunObserver;
use super::panic::survive;
use super::sequence;
use super::stop_reason::StopReason;
use super::supervisor::Event;

/// A run that was begun so often without an end is given up.
const MOST_ATTEMPTS: u32 = 5;

/// Part of the heat account that has to be free before a run that spent it goes on.
const COOLED: f64 = 0.25;

/// When a job goes on after it was interrupted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Policy {
    /// A lost device is waited for this long; 0: not at all.
    pub reconnect_s: f64,
    /// Heat and emergency stop suspend the job instead of ending it.
    pub suspend: Option<Suspend>,
}

/// How a suspended job goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Suspend {
    /// The brake has to cool to this, °C.
    pub cool_to_c: f64,
    /// The release of the emergency stop alone makes it go on; else the operator has to say so too.
    pub go_on_when_released: bool,
    /// Longest time to wait, s.
    pub patience_s: f64,
}

/// What to do about a halt.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Remedy {
    Reconnect { patience_s: f64 },
    Cool(Suspend),
    Release(Suspend),
    AwaitOperator,
}

impl Policy {
    fn remedy(&self, reason: &StopReason) -> Option<Remedy> {
        match reason {
            StopReason::Paused => Some(Remedy::AwaitOperator),
            StopReason::Limit(exceeded) if exceeded.limit.is_remedied_by_cooling() => self.suspend.map(Remedy::Cool),
            StopReason::EmergencyStop { .. } => self.suspend.map(Remedy::Release),
            // It may be back already: a servo is called while the brake holds.
            _ if reason.lost_device().is_some() && self.reconnect_s > 0.0 => {
                Some(Remedy::Reconnect { patience_s: self.reconnect_s })
            }
            _ => None,
        }
    }
}

/// Runs the job to its end or to a halt that the policy has no remedy for. The rig is off afterwards. Also what went wrong while
/// switching off.
pub async fn run_job(
    rig: &mut ConnectedRig,
    job: &mut Job,
    policy: Policy,
    observer: &mut dyn RunObserver,
) -> (Option<StopReason>, Vec<String>) {
    let mut troubles = Vec::new();
    loop {
        let reason = survive(sequence::execute(rig, job, observer)).await.err();
        let reason = match reason {
            Some(reason) => Some(recognise(rig, reason).await),
            None => None,
        };
        let Some(reason) = reason else {
            troubles.extend(rig.switch_off(Event::Finished).await);
            return (None, troubles);
        };
        let level = if matches!(reason, StopReason::Paused) { Level::Info } else { Level::Error };
        rig.acquisition.borrow().event(level, "halt", reason.to_string());
        troubles.extend(rig.switch_off(reason.event()).await);
        let attempts = if matches!(reason, StopReason::Paused) { 0 } else { job.begin_again() };
        let remedy = policy.remedy(&reason).filter(|_| !rig.stop.any());
        if let Err(failure) = observer.interrupted(rig, &reason, remedy.is_some()).await {
            return (Some(failure), troubles);
        }
        let Some(remedy) = remedy else { return (Some(reason), troubles) };
        if attempts >= MOST_ATTEMPTS {
            let run = job.current().map_or(0, |(index, _)| index + 1);
            return (Some(StopReason::Flapping { run, attempts, last: reason.to_string() }), troubles);
        }
        if !matches!(reason, StopReason::Paused) {
            tracing::warn!("suspended: {reason}");
        }
        let waited = Instant::now();
        if let Err(reason) = wait_through(rig, policy, remedy).await {
            return (Some(reason), troubles);
        }
        // What went wrong with switching off is in the log, and remedied.
        for trouble in troubles.drain(..) {
            tracing::warn!("{trouble}");
        }
        let what = format!("goes on after {:.1} s", waited.elapsed().as_secs_f64());
        rig.acquisition.borrow().event(Level::Info, "resume", what);
    }
}

/// An emergency stop that is pressed while the servo is being prepared shows as an alarm, or as a servo that does not come on.
async fn recognise(rig: &mut ConnectedRig, reason: StopReason) -> StopReason {
    use crate::device::DeviceError::{Alarm, NotReached};
    if !matches!(reason, StopReason::Device(Alarm { .. } | NotReached { .. })) {
        return reason;
    }
    match rig.servo.status().await {
        Ok(status) if rig.servo.is_emergency_stop(status.alarm) => StopReason::EmergencyStop { alarm: status.alarm },
        _ => reason,
    }
}

/// Waits for a remedy; a device that is lost meanwhile is waited for first, and then the remedy goes on.
async fn wait_through(rig: &mut ConnectedRig, policy: Policy, remedy: Remedy) -> Result<(), StopReason> {
    loop {
        let waited = wait(rig, remedy).await;
        let lost = waited.as_ref().is_err_and(|reason| reason.lost_device().is_some()) && rig.has_lost_devices();
        if !lost || policy.reconnect_s == 0.0 || matches!(remedy, Remedy::Reconnect { .. }) {
            return waited;
        }
        rig.reconnect(policy.reconnect_s).await?;
    }
}

/// Waits until the remedy has worked; the rig is off, its devices are asked, the log goes on.
async fn wait(rig: &mut ConnectedRig, remedy: Remedy) -> Result<(), StopReason> {
    match remedy {
        Remedy::Reconnect { patience_s } => rig.reconnect(patience_s).await,
        Remedy::AwaitOperator => {
            await_operator(rig).await?;
            rig.stop.go_on();
            Ok(())
        }
        Remedy::Cool(suspend) => {
            let cool = |rig: &ConnectedRig| {
                let temperature_c = rig.acquisition.borrow().status.brake_temperature_c;
                temperature_c <= suspend.cool_to_c && rig.heat.fraction(&rig.profile.limits) <= COOLED
            };
            watch(rig, "the brake's cooling", suspend.patience_s, cool).await
        }
        Remedy::Release(suspend) => {
            let released = |rig: &ConnectedRig| {
                let alarm = rig.acquisition.borrow().status.servo_alarm;
                !rig.servo.is_emergency_stop(alarm)
            };
            watch(rig, "the release of the emergency stop", suspend.patience_s, released).await?;
            if !suspend.go_on_when_released {
                // IEC 60204-1: releasing the button must not by itself start anything.
                tracing::warn!("the emergency stop is released; press p or send SIGUSR1 to go on");
                rig.acquisition.borrow().event(Level::Info, "resume", "released; waits for the operator".into());
                rig.stop.pause();
                await_operator(rig).await?;
            }
            Ok(())
        }
    }
}

/// Until the operator takes the pause back, in the operator's time even where the rig's runs faster.
async fn await_operator(rig: &mut ConnectedRig) -> Result<(), StopReason> {
    rig.progress.note("paused: p or SIGUSR1 goes on, Ctrl-C ends");
    while rig.stop.paused() {
        rig.check_stop()?;
        rig.log_works()?;
        if rig.clock.is_simulated() {
            let nap = tokio::task::spawn_blocking(|| std::thread::sleep(Duration::from_millis(50)));
            // A thread that only sleeps neither fails nor panics.
            let _ = nap.await;
        }
        sleep(rig.profile.poll_period()).await;
        look(rig).await?;
    }
    rig.progress.note("");
    Ok(())
}

async fn watch(
    rig: &mut ConnectedRig,
    what: &'static str,
    patience_s: f64,
    done: impl Fn(&ConnectedRig) -> bool,
) -> Result<(), StopReason> {
    rig.enter(Phase::Fault);
    let began = Instant::now();
    loop {
        rig.check_stop()?;
        rig.log_works()?;
        sleep(rig.profile.poll_period()).await;
        look(rig).await?;
        if done(rig) {
            rig.enter(Phase::Idle);
            return Ok(());
        }
        if began.elapsed().as_secs_f64() > patience_s {
            let rig = rig.acquisition.borrow();
            let now = format!("{:.1} °C, servo alarm {:#06x}", rig.status.brake_temperature_c, rig.status.servo_alarm);
            return Err(StopReason::TooLong { what, seconds: patience_s, now });
        }
    }
}

/// A look at devices of a rig that is off: alarms are expected, a device that is lost is not.
async fn look(rig: &mut ConnectedRig) -> Result<(), StopReason> {
    match rig.observe().await {
        Err(reason) if reason.lost_device().is_some() => Err(reason),
        _ => rig.encoders_live(),
    }
}
