//! The plan of a campaign as TOML. What `rigd diagnose --plan-next` writes is one: `[[runs]]` alone suffices.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::CampaignError;
use crate::profile::Profile;
use crate::run::admission::{Terms, admit_heat, admit_load, admit_speed};
use crate::run::job::{Kind, RunSpec, Settle};
use crate::run::run_job::Suspend;
use crate::run::senses::Senses;

/// Most runs of a plan, repeats included.
const MOST_RUNS: usize = 10_000;
/// Most revolutions of a run.
const MOST_REVOLUTIONS: u32 = 100_000;

/// A campaign's plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CampaignPlan {
    /// What it is called.
    pub name: String,
    /// Who runs it, for the logs.
    pub operator: String,
    /// What it is for, for the logs.
    pub note: String,
    /// Sampling, Hz.
    pub rate_hz: f64,
    /// How often all runs are done.
    pub repeats: u32,
    /// The order of the runs.
    pub order: Order,
    /// Seed of a random order.
    pub seed: u64,
    /// A lost device is waited for this long, s.
    pub reconnect_s: f64,
    /// Turns under load before the first run.
    pub warm_up: Option<WarmUp>,
    /// Settling by what is measured.
    pub settle: Option<SettlePlan>,
    /// The same runs first and last.
    pub reference: Option<Reference>,
    /// What suspends the campaign instead of ending it.
    pub suspend: Option<SuspendPlan>,
    /// Every direction × load × speed.
    pub matrix: Vec<Matrix>,
    /// Single runs.
    pub runs: Vec<Single>,
}

impl Default for CampaignPlan {
    fn default() -> Self {
        Self {
            name: String::new(),
            operator: String::new(),
            note: String::new(),
            rate_hz: 10_000.0,
            repeats: 1,
            order: Order::AsWritten,
            seed: 1,
            reconnect_s: 300.0,
            warm_up: None,
            settle: None,
            reference: None,
            suspend: None,
            matrix: Vec::new(),
            runs: Vec::new(),
        }
    }
}

/// The order of the runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// As the plan has them.
    AsWritten,
    /// Shuffled, so that what drifts with time is no effect of load or speed.
    Random,
}

/// Turns under load before the first run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarmUp {
    /// Sense.
    pub direction: Senses,
    /// Load at the driven gear, N·m.
    pub load_nm: f64,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// How long in each sense, min.
    pub minutes: f64,
}

/// Settling by what is measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SettlePlan {
    /// Largest change of TE over a revolution, µrad.
    pub te_change_urad: f64,
    /// After so many turns the run is recorded all the same.
    pub turns_max: f64,
}

/// The same runs first and last.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Sense.
    pub direction: Senses,
    /// Load at the driven gear, N·m.
    pub load_nm: f64,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Revolutions.
    pub revolutions: u32,
}

/// What suspends the campaign.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuspendPlan {
    /// A brake at its limit has to cool to this, °C.
    pub cool_to_c: f64,
    /// Longest wait, min.
    pub patience_min: f64,
    /// What it takes to go on once the emergency stop is released.
    #[serde(default)]
    pub after_emergency_stop: AfterEmergencyStop,
}

/// What it takes to go on once the emergency stop is released.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AfterEmergencyStop {
    /// The operator says so: key p or SIGUSR1.
    #[default]
    Operator,
    /// Nothing more. Only where nobody can be near the rig.
    Release,
}

/// Every direction × load × speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Matrix {
    /// Senses.
    pub directions: Vec<Senses>,
    /// Loads at the driven gear, N·m.
    pub loads_nm: Vec<f64>,
    /// Speeds of the driver, rpm.
    pub speeds_rpm: Vec<f64>,
    /// Revolutions of each.
    pub revolutions: u32,
}

/// A single run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Single {
    /// Sense.
    pub direction: Senses,
    /// Load at the driven gear, N·m.
    pub load_nm: f64,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Revolutions.
    pub revolutions: u32,
}

impl CampaignPlan {
    /// Reads a plan; its text goes to the logs.
    ///
    /// # Errors
    /// [`CampaignError`] with file, line and key.
    pub fn load(path: &Path) -> Result<(Self, String), CampaignError> {
        let text = std::fs::read_to_string(path).map_err(|source| CampaignError::Read { path: path.into(), source })?;
        let plan = Self::parse(&text, path)?;
        Ok((plan, text))
    }

    /// Reads a plan's text; `path` is for the error.
    ///
    /// # Errors
    /// [`CampaignError::Parse`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, CampaignError> {
        toml::from_str(text).map_err(|source| CampaignError::Parse { path: path.into(), source: Box::new(source) })
    }

    /// Every run of the matrices and the single ones once, in the order of the plan.
    #[must_use]
    pub fn measurements(&self) -> Vec<RunSpec> {
        let mut runs = Vec::new();
        for matrix in &self.matrix {
            for &speed_rpm in &matrix.speeds_rpm {
                for &load_nm in &matrix.loads_nm {
                    for senses in &matrix.directions {
                        let single = Single { direction: *senses, load_nm, speed_rpm, revolutions: matrix.revolutions };
                        runs.extend(single.runs(Kind::Measure));
                    }
                }
            }
        }
        runs.extend(self.runs.iter().flat_map(|single| single.runs(Kind::Measure)));
        runs
    }

    /// How many there are, without making them.
    fn count(&self) -> usize {
        let senses = |senses: &[Senses]| senses.iter().map(|senses| senses.list().len()).sum::<usize>();
        let matrix = |matrix: &Matrix| {
            senses(&matrix.directions).saturating_mul(matrix.loads_nm.len()).saturating_mul(matrix.speeds_rpm.len())
        };
        let single = |single: &Single| single.direction.list().len();
        let counts = self.matrix.iter().map(matrix).chain(self.runs.iter().map(single));
        counts.fold(0, usize::saturating_add)
    }

    /// The reference's runs.
    #[must_use]
    pub fn reference_runs(&self) -> Vec<RunSpec> {
        let single = |reference: &Reference| Single {
            direction: reference.direction,
            load_nm: reference.load_nm,
            speed_rpm: reference.speed_rpm,
            revolutions: reference.revolutions,
        };
        self.reference.iter().flat_map(|reference| single(reference).runs(Kind::Reference)).collect()
    }

    /// The warm-up, whole turns of at least the time that it shall last.
    #[must_use]
    pub fn warm_up_runs(&self) -> Vec<RunSpec> {
        let runs = |warm_up: &WarmUp| {
            let WarmUp { direction, load_nm, speed_rpm, minutes } = *warm_up;
            let run = move |direction| RunSpec {
                kind: Kind::WarmUp,
                direction,
                load_nm,
                speed_rpm,
                revolutions: (minutes * speed_rpm).ceil(),
            };
            direction.list().into_iter().map(run).collect::<Vec<_>>()
        };
        self.warm_up.iter().flat_map(runs).collect()
    }

    /// How runs settle.
    #[must_use]
    pub fn settle(&self) -> Option<Settle> {
        self.settle.map(|settle| Settle { te_change_rad: settle.te_change_urad * 1e-6, turns_max: settle.turns_max })
    }

    /// What suspends it.
    #[must_use]
    pub fn suspend(&self) -> Option<Suspend> {
        self.suspend.map(|suspend| Suspend {
            cool_to_c: suspend.cool_to_c,
            go_on_when_released: suspend.after_emergency_stop == AfterEmergencyStop::Release,
            patience_s: suspend.patience_min * 60.0,
        })
    }

    /// Checks every value against its range and the profile's limits; all faults at once.
    ///
    /// # Errors
    /// [`CampaignError::Faults`].
    pub fn check(&self, profile: &Profile, path: &Path) -> Result<(), CampaignError> {
        let mut faults = Vec::new();
        self.check_values(profile, &mut faults);
        let count = self.count();
        if count == 0 {
            faults.push("there is no run in it; write [[runs]] or [[matrix]]".into());
        }
        if count.saturating_mul(self.repeats as usize) > MOST_RUNS {
            faults.push(format!("{count} runs × repeats = {} are more than {MOST_RUNS}", self.repeats));
        }
        // Three long lists multiply to more runs than there is memory for.
        let measurements = if count > MOST_RUNS { Vec::new() } else { self.measurements() };
        let named = |what: &'static str, runs: Vec<RunSpec>| runs.into_iter().enumerate().map(move |run| (what, run));
        let all = named("warm_up", self.warm_up_runs())
            .chain(named("reference", self.reference_runs()))
            .chain(named("run", measurements));
        for (what, (n, run)) in all {
            let name = format!("{what} {}", n + 1);
            check_run(&name, &run, profile, &mut faults);
        }
        faults.dedup();
        if faults.is_empty() { Ok(()) } else { Err(CampaignError::Faults { path: path.into(), faults }) }
    }

    fn check_values(&self, profile: &Profile, faults: &mut Vec<String>) {
        let mut range = |key: &str, value: f64, low: f64, high: f64, unit: &str| {
            if !(low..=high).contains(&value) {
                faults.push(format!("{key} = {value} must be from {low} to {high} {unit}"));
            }
        };
        range("rate_hz", self.rate_hz, 10.0, 1e6, "Hz");
        range("repeats", f64::from(self.repeats), 1.0, 1000.0, "");
        range("reconnect_s", self.reconnect_s, 0.0, 86_400.0, "s");
        if let Some(warm_up) = &self.warm_up {
            range("warm_up.minutes", warm_up.minutes, 0.01, 1440.0, "min");
        }
        if let Some(settle) = &self.settle {
            range("settle.te_change_urad", settle.te_change_urad, 0.01, 1e4, "µrad");
            range("settle.turns_max", settle.turns_max, 1.25, 1000.0, "turns (five quarters are needed to compare)");
        }
        if let Some(suspend) = &self.suspend {
            range("suspend.patience_min", suspend.patience_min, 0.01, 10_080.0, "min");
            let limit = profile.limits.brake_temperature_c;
            range("suspend.cool_to_c", suspend.cool_to_c, 0.0, limit, "°C (limits.brake_temperature_c)");
        }
    }
}

impl Single {
    fn runs(self, kind: Kind) -> Vec<RunSpec> {
        let Self { load_nm, speed_rpm, revolutions, .. } = self;
        let run = |direction| RunSpec { kind, direction, load_nm, speed_rpm, revolutions: f64::from(revolutions) };
        self.direction.list().into_iter().map(run).collect()
    }
}

/// A run against the limits of the profile.
fn check_run(name: &str, run: &RunSpec, profile: &Profile, faults: &mut Vec<String>) {
    let refusals = [
        admit_speed(profile, Terms::KEYS, run.speed_rpm),
        admit_load(profile, Terms::KEYS, run.load_nm),
        admit_heat(profile, Terms::KEYS, run.load_nm, run.speed_rpm),
    ];
    faults.extend(refusals.into_iter().filter_map(Result::err).map(|refusal| format!("{name}: {refusal}")));
    if run.kind != Kind::WarmUp && !(1.0..=f64::from(MOST_REVOLUTIONS)).contains(&run.revolutions) {
        faults.push(format!("{name}: revolutions = {} must be from 1 to {MOST_REVOLUTIONS}", run.revolutions));
    }
}

#[cfg(test)]
mod tests {
    use gearmodel::Direction;

    use super::*;

    const NEXT: &str = "# record the other sense\n\n[[runs]]\ndirection = \"ccw\"\nload_nm = 5.0\nspeed_rpm = 5.0\nrevolutions = 4\n\n[[runs]]\ndirection = \"cw\"\nload_nm = 5.0\nspeed_rpm = 5.0\nrevolutions = 4\n";

    fn faults(text: &str) -> String {
        let path = Path::new("plan.toml");
        CampaignPlan::parse(text, path)
            .and_then(|plan| plan.check(&Profile::simulated(), path))
            .expect_err("a fault")
            .to_string()
    }

    #[test]
    fn what_diagnose_writes_is_a_plan() {
        let plan = CampaignPlan::parse(NEXT, Path::new("next.toml")).expect("a plan");
        plan.check(&Profile::simulated(), Path::new("next.toml")).expect("within limits");
        let runs = plan.measurements();
        assert_eq!(runs.len(), 2);
        assert_eq!((runs[1].direction, runs[1].load_nm, runs[1].revolutions), (Direction::Cw, 5.0, 4.0));
    }

    #[test]
    fn a_matrix_is_every_direction_load_and_speed() {
        let text =
            "[[matrix]]\ndirections = [\"both\"]\nloads_nm = [5, 10, 15]\nspeeds_rpm = [5, 10]\nrevolutions = 2\n";
        let plan = CampaignPlan::parse(text, Path::new("x")).expect("a plan");
        assert_eq!((plan.measurements().len(), plan.count()), (12, 12));
    }

    #[test]
    fn a_plan_of_more_runs_than_there_is_memory_for_is_refused_without_making_them() {
        let list = |word: &str| vec![word; 5000].join(",");
        let (senses, numbers) = (list("\"both\""), list("1.0"));
        let text =
            format!("[[matrix]]\ndirections=[{senses}]\nloads_nm=[{numbers}]\nspeeds_rpm=[{numbers}]\nrevolutions=1\n");
        let said = faults(&text);
        assert!(said.contains("250000000000 runs") && said.contains("10000"), "{said}");
    }

    #[test]
    fn all_faults_are_told_at_once_with_key_value_and_limit() {
        let text = "repeats = 0\nrate_hz = 1\n[settle]\nte_change_urad = 5\nturns_max = 1\n[[runs]]\ndirection = \"cw\"\nload_nm = 500\nspeed_rpm = 61\nrevolutions = 0\n";
        let said = faults(text);
        for needle in [
            "repeats = 0",
            "rate_hz = 1 ",
            "turns_max = 1",
            "load_nm = 500",
            "20 N·m",
            "speed_rpm = 61",
            "60 rpm",
            "revolutions = 0",
        ] {
            assert!(said.contains(needle), "no '{needle}' in {said}");
        }
        assert!(faults("").contains("no run"));
        assert!(faults("[[runs]]\ndirection=\"up\"\nload_nm=1\nspeed_rpm=1\nrevolutions=1").contains("plan.toml"));
        assert!(faults("[[runs]]\ndirection=\"cw\"\nlaod_nm=1\nspeed_rpm=1\nrevolutions=1").contains("laod_nm"));
        assert!(
            faults("[[runs]]\ndirection=\"cw\"\nload_nm=nan\nspeed_rpm=1\nrevolutions=1").contains("load_nm = NaN")
        );
    }

    #[test]
    fn a_speed_at_which_no_revolution_ends_is_refused() {
        let at = |rpm: f64| format!("[[runs]]\ndirection=\"cw\"\nload_nm=1.0\nspeed_rpm={rpm}\nrevolutions=1");
        let plan = CampaignPlan::parse(&at(0.01), Path::new("x")).expect("a plan");
        plan.check(&Profile::simulated(), Path::new("x")).expect("slow");
        assert!(faults(&at(0.0099)).contains("from 0.01 to 60 rpm"));
        assert!(faults(&at(1e-300)).contains("from 0.01"), "of which no time can be computed");
    }

    #[test]
    fn load_and_speed_are_tried_from_both_sides() {
        let at = |load: f64, rpm: f64| {
            format!("[[runs]]\ndirection=\"cw\"\nload_nm={load:?}\nspeed_rpm={rpm:?}\nrevolutions=1")
        };
        for text in [at(20.0, 5.0), at(0.0, 5.0), at(5.0, 60.0)] {
            let plan = CampaignPlan::parse(&text, Path::new("x")).expect("a plan");
            plan.check(&Profile::simulated(), Path::new("x")).expect("just within");
        }
        assert!(faults(&at(20.01, 5.0)).contains("load_nm = 20.01 N·m is over the limit 20 N·m (limits.load_nm"));
        assert!(faults(&at(-0.01, 5.0)).contains("load_nm = -0.01 N·m is no load"));
        assert!(faults(&at(5.0, 60.01)).contains("speed_rpm = 60.01 rpm is over the limit 60 rpm (limits.speed_rpm"));
    }

    #[test]
    fn slip_power_is_tried_from_both_sides() {
        // 120 W at 60 rpm are 19.0986 N·m.
        let at = |load: f64| format!("[[runs]]\ndirection=\"cw\"\nload_nm={load}\nspeed_rpm=60.0\nrevolutions=1");
        let plan = CampaignPlan::parse(&at(19.09), Path::new("x")).expect("a plan");
        plan.check(&Profile::simulated(), Path::new("x")).expect("just within");
        assert!(faults(&at(19.11)).contains("over 120 W"));
    }
}
