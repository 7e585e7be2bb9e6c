//! The order of a campaign's runs: warm-up, reference, measurements, reference.

use rand::Rng as _;
use rand::SeedableRng as _;
use rand_pcg::Pcg64Mcg;
use sha2::{Digest as _, Sha256};

use super::plan::{CampaignPlan, Order};
use crate::run::job::{Kind, RunSpec};

/// The runs in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    /// All of them.
    pub runs: Vec<RunSpec>,
    /// Tells one plan and order from another.
    pub fingerprint: String,
}

impl Schedule {
    /// The order that a plan and its seed make; always the same.
    #[must_use]
    pub fn of(plan: &CampaignPlan) -> Self {
        let mut measurements = Vec::new();
        for _ in 0..plan.repeats {
            measurements.extend(plan.measurements());
        }
        if plan.order == Order::Random {
            shuffle(&mut measurements, plan.seed);
        }
        let reference = plan.reference_runs();
        let runs: Vec<_> = [plan.warm_up_runs(), reference.clone(), measurements, reference].concat();
        let mut hash = Sha256::new();
        hash.update(plan.rate_hz.to_le_bytes());
        for run in &runs {
            hash.update(format!("{run:?}"));
        }
        let fingerprint = hash.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        Self { runs, fingerprint }
    }

    /// What is left from run `first` on, as indices: a rig that has stood still is warmed up again.
    #[must_use]
    pub fn from(&self, first: usize) -> Vec<usize> {
        let warm_up = (0..first.min(self.runs.len())).filter(|index| self.runs[*index].kind == Kind::WarmUp);
        let left = first..self.runs.len();
        if left.is_empty() { Vec::new() } else { warm_up.chain(left).collect() }
    }
}

/// Fisher and Yates' shuffle, with the arithmetic written out: a later version of a library must not change the order of a campaign
/// that is half done.
fn shuffle(runs: &mut [RunSpec], seed: u64) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    for last in (1..runs.len()).rev() {
        // The high half of a product of 64 bits each lies evenly in 0..=last, but for one part in 2^64 / runs.
        let drawn = (u128::from(random.next_u64()) * (last as u128 + 1)) >> 64;
        runs.swap(last, drawn as usize);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn plan(text: &str) -> CampaignPlan {
        CampaignPlan::parse(text, Path::new("x")).expect("a plan")
    }

    const FULL: &str = "repeats = 2\norder = \"random\"\nseed = 7\n[warm_up]\ndirection=\"ccw\"\nload_nm=5\nspeed_rpm=30\nminutes=0.5\n[reference]\ndirection=\"ccw\"\nload_nm=5\nspeed_rpm=30\nrevolutions=1\n[[matrix]]\ndirections=[\"both\"]\nloads_nm=[5,10,15]\nspeeds_rpm=[10,30]\nrevolutions=1\n";

    #[test]
    fn reference_first_and_last_with_every_run_in_between() {
        let schedule = Schedule::of(&plan(FULL));
        let kinds: Vec<_> = schedule.runs.iter().map(|run| run.kind).collect();
        assert_eq!(schedule.runs.len(), 1 + 1 + 24 + 1);
        assert_eq!((kinds[0], kinds[1], kinds[26]), (Kind::WarmUp, Kind::Reference, Kind::Reference));
        assert_eq!(schedule.runs[0].revolutions, 15.0);
        assert_eq!(kinds.iter().filter(|kind| **kind == Kind::Measure).count(), 24);
        // Each of the twelve conditions twice.
        for run in &schedule.runs[2..26] {
            assert_eq!(schedule.runs[2..26].iter().filter(|other| *other == run).count(), 2);
        }
    }

    #[test]
    fn the_order_is_the_seeds() {
        let one = Schedule::of(&plan(FULL));
        assert_eq!(one, Schedule::of(&plan(FULL)));
        let other = Schedule::of(&plan(&FULL.replace("seed = 7", "seed = 8")));
        assert_ne!(one.fingerprint, other.fingerprint);
        let written = Schedule::of(&plan(&FULL.replace("random", "as-written")));
        assert_ne!(one.runs, written.runs);
        // Frozen: a campaign that was begun by an earlier version goes on in its order.
        assert_eq!(one.fingerprint, "4d3410e84e2c9a73");
    }

    #[test]
    fn a_campaign_that_is_taken_up_warms_up_first() {
        let schedule = Schedule::of(&plan(FULL));
        assert_eq!(schedule.from(0)[..3], [0, 1, 2]);
        assert_eq!(schedule.from(20), [vec![0], (20..27).collect()].concat());
        assert_eq!(schedule.from(27), Vec::<usize>::new());
    }
}
