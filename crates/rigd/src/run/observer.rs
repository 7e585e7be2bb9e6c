//! Who looks on while a job is done.

use async_trait::async_trait;

use super::halt::Halt;
use super::job::RunSpec;
use super::rig::Rig;

/// Looks on, run by run: a campaign opens a log for each and keeps its journal; a single run needs nothing.
#[async_trait(?Send)]
pub trait RunObserver {
    /// A run begins, from its first revolution.
    async fn begins(&mut self, rig: &mut Rig, index: usize, run: &RunSpec) -> Result<(), Halt>;
    /// A run is complete.
    async fn ended(&mut self, rig: &mut Rig, index: usize, run: &RunSpec) -> Result<(), Halt>;
    /// The rig was switched off in the middle of the job; `goes_on` where the policy has a remedy.
    async fn interrupted(&mut self, rig: &mut Rig, halt: &Halt, goes_on: bool) -> Result<(), Halt>;
}

/// Needs nothing.
pub struct NoObserver;

#[async_trait(?Send)]
impl RunObserver for NoObserver {
    async fn begins(&mut self, _: &mut Rig, _: usize, _: &RunSpec) -> Result<(), Halt> {
        Ok(())
    }
    async fn ended(&mut self, _: &mut Rig, _: usize, _: &RunSpec) -> Result<(), Halt> {
        Ok(())
    }
    async fn interrupted(&mut self, _: &mut Rig, _: &Halt, _: bool) -> Result<(), Halt> {
        Ok(())
    }
}
