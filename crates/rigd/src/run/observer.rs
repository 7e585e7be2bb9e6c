//! Who looks on while a job is done.

use async_trait::async_trait;

use super::connected_rig::ConnectedRig;
use super::job::RunSpec;
use super::stop_reason::StopReason;

/// Looks on, run by run: a campaign opens a log for each and keeps its journal; a single run needs nothing.
#[async_trait(?Send)]
pub trait RunObserver {
    /// A run begins, from its first revolution.
    async fn begins(&mut self, rig: &mut ConnectedRig, index: usize, run: &RunSpec) -> Result<(), StopReason>;
    /// A run is complete.
    async fn ended(&mut self, rig: &mut ConnectedRig, index: usize, run: &RunSpec) -> Result<(), StopReason>;
    /// The rig was switched off in the middle of the job; `goes_on` where the policy has a remedy.
    async fn interrupted(
        &mut self,
        rig: &mut ConnectedRig,
        reason: &StopReason,
        goes_on: bool,
    ) -> Result<(), StopReason>;
}

/// Needs nothing.
pub struct NoObserver;

#[async_trait(?Send)]
impl RunObserver for NoObserver {
    async fn begins(&mut self, _: &mut ConnectedRig, _: usize, _: &RunSpec) -> Result<(), StopReason> {
        Ok(())
    }
    async fn ended(&mut self, _: &mut ConnectedRig, _: usize, _: &RunSpec) -> Result<(), StopReason> {
        Ok(())
    }
    async fn interrupted(&mut self, _: &mut ConnectedRig, _: &StopReason, _: bool) -> Result<(), StopReason> {
        Ok(())
    }
}
