//! A campaign on the simulated rig, driven directly and faster than the daemon does it: home, then for each run approach, settle and
//! record, as `rigd run` does.

use std::f64::consts::TAU;

use gearmodel::Direction;
use riglog::proto::Phase;

use super::error::BlindError;
use rigsim::plant::{Plant, PlantSpec};

/// Speed while homing, rpm of the driver.
const HOME_RPM: f64 = 15.0;
/// The drive's ramp for 3000 motor rpm, ms.
const RAMP_MS: f64 = 1000.0;
/// Waiting for the brake's torque to fall or rise, s: four of its time constants and more.
const LOAD_S: f64 = 1.5;
/// The driver turns this far under load before a run is recorded, rad.
const SETTLE_RAD: f64 = 0.15 * TAU;
/// A state is noted this often, s.
const STATE_S: f64 = 0.2;
/// The brake's current source gives up to this, V.
const BRAKE_V: f64 = 60.0;

/// Set-points of one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunPlan {
    /// The driver's sense.
    pub direction: Direction,
    /// Load at the driven gear, N·m.
    pub load_nm: f64,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
}

/// What is run.
#[derive(Debug, Clone, PartialEq)]
pub struct WithheldPlan {
    /// The runs, in this order.
    pub runs: Vec<RunPlan>,
    /// Driver revolutions of each.
    pub revolutions: f64,
    /// Sampling of both encoders, Hz.
    pub rate_hz: f64,
}

impl WithheldPlan {
    /// Both senses at 0.5, 5, 10 and 15 N·m and 5 rpm, and at 10 N·m and 2.5 and 10 rpm; four revolutions each.
    #[must_use]
    pub fn usual(rate_hz: f64) -> Self {
        let conditions = [(0.5, 5.0), (5.0, 5.0), (10.0, 5.0), (15.0, 5.0), (10.0, 2.5), (10.0, 10.0)];
        let runs = conditions
            .into_iter()
            .flat_map(|(load_nm, speed_rpm)| {
                [Direction::Ccw, Direction::Cw].map(|direction| RunPlan { direction, load_nm, speed_rpm })
            })
            .collect();
        Self { runs, revolutions: 4.0, rate_hz }
    }
}

/// The rig's state at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Number of the sample.
    pub sample: usize,
    /// What the rig does.
    pub phase: Phase,
    /// The run that is approached or recorded.
    pub run: Option<RunPlan>,
    /// Speed of the driver as the drive reports it, rpm.
    pub speed_rpm: f64,
    /// Current in the brake, A.
    pub brake_current_a: f64,
    /// Temperature of the brake, °C.
    pub brake_temperature_c: f64,
}

/// One recorded run: the samples `from..to`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedSpan {
    /// Its set-points.
    pub plan: RunPlan,
    /// First sample.
    pub from: usize,
    /// First sample after it.
    pub to: usize,
}

/// What a campaign recorded: all samples from switching on, the runs among them.
#[derive(Debug, Clone, PartialEq)]
pub struct WithheldCampaign {
    /// Sampling, Hz.
    pub rate_hz: f64,
    /// Input and output counts.
    pub counts: Vec<[i64; 2]>,
    /// Counts at which the indices passed.
    pub index_counts: [i64; 2],
    /// Counts per revolution.
    pub counts_per_rev: [u64; 2],
    /// Lines of the discs.
    pub lines: [u32; 2],
    /// States, in order.
    pub states: Vec<State>,
    /// The runs.
    pub runs: Vec<RecordedSpan>,
    /// Times that counts were lost from the first recorded sample on.
    pub count_losses: u64,
}

impl WithheldCampaign {
    /// θ1 and θ2 of a sample, rad.
    #[must_use]
    pub fn angles_rad(&self, sample: usize) -> [f64; 2] {
        // θ = 2π (counts − index counts)/counts per revolution
        [0, 1].map(|n| TAU * (self.counts[sample][n] - self.index_counts[n]) as f64 / self.counts_per_rev[n] as f64)
    }
}

/// The rig under way.
struct Driver<'a> {
    plant: Plant,
    plan: &'a WithheldPlan,
    campaign: WithheldCampaign,
    phase: Phase,
    run: Option<RunPlan>,
    next_state: usize,
}

/// Runs the plan on a rig.
///
/// # Errors
/// [`BlindError`] for a rig that cannot be built, a load that the brake has not, and a rig that does not move.
pub fn run(spec: &PlantSpec, plan: &WithheldPlan, seed: u64) -> Result<WithheldCampaign, BlindError> {
    let mut plant = Plant::new(spec, plan.rate_hz, seed)?;
    plant.set_ramp_ms(RAMP_MS, RAMP_MS);
    let (input, output) = plant.counts_per_rev();
    let (input_lines, output_lines) = plant.lines();
    let campaign = WithheldCampaign {
        rate_hz: plan.rate_hz,
        counts: Vec::new(),
        index_counts: [0; 2],
        counts_per_rev: [input, output],
        lines: [input_lines, output_lines],
        states: Vec::new(),
        runs: Vec::new(),
        count_losses: 0,
    };
    let mut driver = Driver { plant, plan, campaign, phase: Phase::Homing, run: None, next_state: 0 };
    driver.home()?;
    let mut losses_before = 0;
    for (n, run) in plan.runs.iter().enumerate() {
        driver.approach(*run)?;
        if n == 0 {
            // Time and wear count from the first sample that the diagnosis sees.
            driver.plant.renew();
            losses_before = driver.plant.truth().count_losses;
        }
        driver.record(*run)?;
    }
    driver.campaign.count_losses = driver.plant.truth().count_losses - losses_before;
    driver.enter(Phase::Stopping, None);
    driver.sample();
    Ok(driver.campaign)
}

impl Driver<'_> {
    fn enter(&mut self, phase: Phase, run: Option<RunPlan>) {
        self.phase = phase;
        self.run = run;
        self.next_state = self.campaign.counts.len();
    }

    fn sample(&mut self) {
        let sample = self.plant.step();
        let number = self.campaign.counts.len();
        if number >= self.next_state {
            self.next_state = number + (STATE_S * self.plan.rate_hz).ceil() as usize;
            self.campaign.states.push(State {
                sample: number,
                phase: self.phase,
                run: self.run,
                speed_rpm: self.plant.speed_rpm() / self.plant.spec().drive.reduction,
                brake_current_a: self.plant.current_a(),
                brake_temperature_c: self.plant.temperature_c(),
            });
        }
        self.campaign.counts.push([sample.input_counts, sample.output_counts]);
    }

    fn wait(&mut self, seconds: f64) {
        for _ in 0..(seconds * self.plan.rate_hz).ceil() as usize {
            self.sample();
        }
    }

    /// Samples until `done`; an error after `patience_s`.
    fn until(&mut self, what: &'static str, patience_s: f64, done: impl Fn(&Plant) -> bool) -> Result<(), BlindError> {
        let samples = (patience_s * self.plan.rate_hz).ceil() as usize;
        for _ in 0..samples {
            self.sample();
            if done(&self.plant) {
                return Ok(());
            }
        }
        Err(BlindError::Stuck { what, patience_s })
    }

    fn set_speed(&mut self, rpm: f64) {
        self.plant.set_speed_reference_rpm(rpm * self.plant.spec().drive.reduction);
    }

    fn home(&mut self) -> Result<(), BlindError> {
        self.plant.set_enabled(true);
        self.set_speed(HOME_RPM);
        let both = |plant: &Plant| plant.input_index_counts().is_some() && plant.output_index_counts().is_some();
        self.until("both indices to pass", 3.0 * 60.0 / HOME_RPM, both)?;
        let index = (self.plant.input_index_counts(), self.plant.output_index_counts());
        if let (Some(input), Some(output)) = index {
            self.campaign.index_counts = [input, output];
        }
        Ok(())
    }

    fn approach(&mut self, run: RunPlan) -> Result<(), BlindError> {
        self.enter(Phase::Approach, Some(run));
        let current_a = current_a(self.plant.spec(), run.load_nm)
            .ok_or(BlindError::BeyondBrake { load_nm: run.load_nm, where_: "the brake's rising branch" })?;
        // From no current upwards, so that the torque lies on the branch that was calibrated.
        self.plant.set_drive(false, 0.0, BRAKE_V);
        let rpm = run.speed_rpm * run.direction.sign();
        self.set_speed(rpm);
        let turning = move |plant: &Plant| {
            let now = plant.speed_rpm() / plant.spec().drive.reduction;
            (now - rpm).abs() < 0.05 * rpm.abs()
        };
        self.until("the ramp to speed", 10.0, turning)?;
        self.wait(LOAD_S);
        self.plant.set_drive(true, current_a, BRAKE_V);
        self.wait(LOAD_S);
        self.enter(Phase::Settle, Some(run));
        self.travel(SETTLE_RAD, run.speed_rpm)
    }

    fn travel(&mut self, angle_rad: f64, speed_rpm: f64) -> Result<(), BlindError> {
        let from = self.plant.truth().angles_rad[0];
        let patience_s = 2.0 + 1.2 * angle_rad / TAU * 60.0 / speed_rpm;
        self.until("the driver to turn", patience_s, |plant| (plant.truth().angles_rad[0] - from).abs() >= angle_rad)
    }

    fn record(&mut self, run: RunPlan) -> Result<(), BlindError> {
        self.enter(Phase::Record, Some(run));
        let from = self.campaign.counts.len();
        self.travel(self.plan.revolutions * TAU, run.speed_rpm)?;
        self.campaign.runs.push(RecordedSpan { plan: run, from, to: self.campaign.counts.len() });
        Ok(())
    }
}

/// Coil current for a load on the rising branch, A; `None` beyond the curve. Below the drag there is none to set.
fn current_a(spec: &PlantSpec, load_nm: f64) -> Option<f64> {
    let curve = spec.brake.nominal_curve();
    if curve.first().is_some_and(|point| load_nm <= point.rising_nm) {
        return Some(0.0);
    }
    curve.windows(2).find(|pair| pair[1].rising_nm >= load_nm).map(|pair| {
        let share = (load_nm - pair[0].rising_nm) / (pair[1].rising_nm - pair[0].rising_nm);
        pair[0].current_a + share * (pair[1].current_a - pair[0].current_a)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_turn_in_their_sense_for_their_revolutions_under_their_load() {
        let mut plan = WithheldPlan::usual(500.0);
        plan.runs.truncate(4);
        plan.revolutions = 1.0;
        let campaign = run(&PlantSpec::default(), &plan, 3).unwrap();
        assert_eq!(campaign.runs.len(), 4);
        for span in &campaign.runs {
            let travel = campaign.angles_rad(span.to - 1)[0] - campaign.angles_rad(span.from)[0];
            assert!((travel * span.plan.direction.sign() - TAU).abs() < 0.02, "{travel}");
            let seconds = (span.to - span.from) as f64 / 500.0;
            assert!((seconds - 60.0 / span.plan.speed_rpm).abs() < 0.1, "{seconds}");
        }
        // Angles count from the indices: θ2 is f(θ1) but for the transmission error.
        let plant = Plant::new(&PlantSpec::default(), 500.0, 3).unwrap();
        let span = campaign.runs[1];
        let [theta1, theta2] = campaign.angles_rad(span.from + 100);
        assert!((theta2 - plant.nominal_driven_rad(theta1)).abs() < 0.01);
        assert!(campaign.states.iter().any(|state| state.phase == Phase::Record && state.sample == span.from));
    }

    #[test]
    fn a_sound_rig_is_what_its_nominal_model_says() {
        let (_, model) = riglog::pair::load(None).unwrap();
        let spec = crate::plant_of_pair::plant_of_pair(&model).unwrap().quiet();
        let mut plan = WithheldPlan::usual(250.0);
        plan.revolutions = 1.0;
        let campaign = run(&spec, &plan, 3).unwrap();
        for span in &campaign.runs {
            let misses: Vec<f64> = (span.from..span.to)
                .map(|sample| {
                    let [theta1, theta2] = campaign.angles_rad(sample);
                    let te = theta2 - model.pair.theta2(theta1);
                    te - model.te_rad(theta1, span.plan.direction, span.plan.load_nm)
                })
                .collect();
            let count = misses.len() as f64;
            let mean = misses.iter().sum::<f64>() / count;
            let rms = (misses.iter().map(|miss| (miss - mean).powi(2)).sum::<f64>() / count).sqrt();
            // Counting steps of both encoders leave 0.4 µrad; then the load's inertia and what is second order.
            assert!(rms < 1e-6, "{:?}: {rms}", span.plan);
            assert!(mean.abs() < 2e-6, "{:?}: {mean}", span.plan);
        }
    }

    #[test]
    fn the_current_makes_the_load() {
        let spec = PlantSpec::default();
        for load in [0.5, 5.0, 15.0] {
            let current = current_a(&spec, load).unwrap();
            let mut plant = Plant::new(&spec.clone().quiet(), 1000.0, 1).unwrap();
            plant.set_enabled(true);
            plant.set_speed_reference_rpm(100.0);
            plant.set_drive(true, current, BRAKE_V);
            for _ in 0..5000 {
                plant.step();
            }
            assert!((plant.truth().brake_torque_nm - load).abs() < 0.02, "{load}");
        }
        assert_eq!(current_a(&spec, 0.1), Some(0.0));
        assert_eq!(current_a(&spec, 1e4), None);
    }
}
