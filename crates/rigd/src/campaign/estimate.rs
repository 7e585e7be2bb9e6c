//! How long a campaign takes, and how warm it makes the brake: the dry run, and the time left while it runs.

use serde::Serialize;

use crate::profile::Profile;
use crate::run::job::{Kind, RunSpec, Settle};
use crate::run::limits::{HeatAccount, slip_power_w};

/// Turns after which measured settling is taken to have succeeded: the least that it needs, and a quarter.
const SETTLE_TURNS: f64 = 1.5;
/// Connecting, identifying and preparing the devices, s.
const CONNECT_S: f64 = 3.0;
/// Polls that a run's steps wait for on average; each step ends with the poll that sees it done.
const POLLS: f64 = 6.0;

/// What a campaign takes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Each run with the way to it, s.
    #[serde(skip)]
    pub runs_s: Vec<f64>,
    /// All of it, s.
    pub duration_s: f64,
    /// Of that, recorded, s.
    pub recorded_s: f64,
    /// Heat that the brake has to shed, J.
    pub heat_j: f64,
    /// Mean slip power, W.
    pub mean_power_w: f64,
    /// The largest slip power of a run, W.
    pub largest_power_w: f64,
    /// The largest part of the heat account that is taken at any time.
    pub heat_account: f64,
}

/// Estimates the runs in their order on a rig.
#[must_use]
pub fn estimate(runs: &[RunSpec], settle: Option<Settle>, profile: &Profile) -> Estimate {
    let sequence = &profile.sequence;
    let ramp_s = |rpm: f64| rpm.abs() * profile.servo.reduction / 3000.0 * profile.servo.accel_ms * 1e-3;
    let mut account = HeatAccount::default();
    let (mut heat_account, mut heat_j, mut recorded_s, mut largest_power_w) = (0.0_f64, 0.0, 0.0, 0.0_f64);
    let homing_s = ramp_s(sequence.home_rpm) + 0.75 * 60.0 / sequence.home_rpm;
    let mut speed_rpm = sequence.home_rpm;
    let mut runs_s = Vec::with_capacity(runs.len());
    for run in runs {
        let wanted = run.speed_rpm * run.direction.sign();
        // No load while it reverses and comes to speed.
        let unloaded_s = ramp_s(wanted - speed_rpm) + sequence.load_s;
        let turn_s = 60.0 / run.speed_rpm;
        let settle_turns = sequence.settle_turns
            + settle.filter(|_| run.kind != Kind::WarmUp).map_or(0.0, |settle| settle.turns_max.min(SETTLE_TURNS));
        let settle_s = sequence.load_s + sequence.settle_s.max(0.0) + settle_turns * turn_s;
        let record_s = run.revolutions * turn_s;
        let (power_w, loaded_s) = (slip_power_w(run.load_nm, run.speed_rpm), settle_s + record_s);
        account.book(&profile.limits, 0.0, 0.0, unloaded_s);
        account.book(&profile.limits, run.load_nm, run.speed_rpm, loaded_s);
        heat_account = heat_account.max(account.fraction(&profile.limits));
        heat_j += power_w * loaded_s;
        largest_power_w = largest_power_w.max(power_w);
        if run.kind != Kind::WarmUp {
            recorded_s += record_s;
        }
        runs_s.push(unloaded_s + loaded_s + POLLS * sequence.poll_ms * 1e-3);
        speed_rpm = wanted;
    }
    let duration_s = CONNECT_S + homing_s + ramp_s(speed_rpm) + runs_s.iter().sum::<f64>();
    Estimate {
        runs_s,
        duration_s,
        recorded_s,
        heat_j,
        mean_power_w: heat_j / duration_s,
        largest_power_w,
        heat_account,
    }
}

/// A time for people.
#[must_use]
pub fn time(seconds: f64) -> String {
    let minutes = (seconds / 60.0).floor() as u64;
    match (minutes / 60, minutes % 60) {
        (0, 0) => format!("{seconds:.0} s"),
        (0, minutes) => format!("{minutes} min {:02.0} s", (seconds - 60.0 * minutes as f64).floor()),
        (hours, minutes) => format!("{hours} h {minutes:02} min"),
    }
}

#[cfg(test)]
mod tests {
    use gearmodel::Direction;

    use super::*;

    fn run(load_nm: f64, speed_rpm: f64, revolutions: f64) -> RunSpec {
        RunSpec { kind: Kind::Measure, direction: Direction::Ccw, load_nm, speed_rpm, revolutions }
    }

    #[test]
    fn revolutions_at_speed_are_recorded_time_and_slip_heat() {
        let profile = Profile::simulated();
        let one = estimate(&[run(10.0, 5.0, 4.0)], None, &profile);
        assert_eq!(one.recorded_s, 48.0);
        assert!(one.duration_s > 48.0 && one.duration_s < 75.0, "{one:?}");
        // 10 N·m at 5 rpm are 5.24 W over the recording, the load's rise and the settling.
        let power_w = 10.0 * std::f64::consts::TAU * 5.0 / 60.0;
        assert!((one.heat_j - power_w * (48.0 + 3.0 + 3.0)).abs() < 1e-9, "{one:?}");
        assert_eq!(one.heat_account, 0.0, "below the continuous power the account stays empty");
        let longer = estimate(&[run(10.0, 5.0, 5.0)], None, &profile);
        assert!((longer.duration_s - one.duration_s - 12.0).abs() < 1e-9);
    }

    #[test]
    fn heat_that_the_brake_cannot_shed_fills_the_account() {
        let mut profile = Profile::simulated();
        profile.limits.slip_power_w = 20.0;
        // 10 N·m at 30 rpm are 31.4 W: 11.4 W too much.
        let estimate = estimate(&[run(10.0, 30.0, 30.0)], None, &profile);
        assert!(estimate.heat_account > 0.5 && estimate.heat_account < 1.0, "{estimate:?}");
    }

    #[test]
    fn times_for_people() {
        assert_eq!([time(12.4), time(754.0), time(8000.0)], ["12 s", "12 min 34 s", "2 h 13 min"]);
    }
}
