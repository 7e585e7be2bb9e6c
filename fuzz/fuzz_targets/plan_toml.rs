//! Any text as a campaign's plan: an error, or a plan whose schedule and estimate can be made, never a panic and never more memory than the
//! runs that are allowed need.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use rigd::campaign::estimate::estimate;
use rigd::campaign::plan::CampaignPlan;
use rigd::campaign::schedule::Schedule;
use rigd::profile::Profile;

static PROFILE: LazyLock<Profile> = LazyLock::new(Profile::simulated);

fuzz_target!(|text: &str| {
    let path = Path::new("fuzzed.toml");
    let checked = CampaignPlan::parse(text, path).and_then(|plan| plan.check(&PROFILE, path).map(|()| plan));
    match checked {
        Err(error) => drop(error.to_string()),
        Ok(plan) => {
            let schedule = Schedule::of(&plan);
            assert_eq!(Schedule::of(&plan).fingerprint, schedule.fingerprint, "one plan, one order");
            let found = estimate(&schedule.runs, plan.settle(), &PROFILE);
            assert_eq!(found.runs_s.len(), schedule.runs.len());
            assert!(found.duration_s.is_finite() && found.duration_s >= 0.0, "{}", found.duration_s);
            assert!(found.heat_j.is_finite() && found.largest_power_w <= PROFILE.limits.slip_power_w);
        }
    }
});
