//! What is asked of a rig against what its profile allows, before anything moves. Every way into a run passes here: the command line and
//! plans, so that a person is told at once, and [`super::sequence::prepare`], which nothing that turns the motor goes around.

use thiserror::Error;

use super::job::Job;
use super::limits::slip_power_w;
use crate::profile::{Profile, SLOWEST_RPM};

/// What the two quantities are called where they were asked for, so that a refusal names what a person wrote.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Terms {
    /// The load.
    pub load: &'static str,
    /// The speed.
    pub speed: &'static str,
}

impl Terms {
    /// Options of a command.
    pub const OPTIONS: Self = Self { load: "--load", speed: "--rpm" };
    /// Keys of a plan.
    pub const KEYS: Self = Self { load: "load_nm =", speed: "speed_rpm =" };
    /// Set-points of a run under way.
    pub const SET_POINTS: Self = Self { load: "load", speed: "speed" };
}

/// Why a load or a speed is refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Refusal {
    /// Over its limit.
    #[error(
        "{term} {value} {unit} is over the limit {limit} {unit} ({key} in profile '{profile}'); lower it, or raise the limit if the rig allows it"
    )]
    OverLimit {
        /// What it is called.
        term: &'static str,
        /// What was asked for.
        value: f64,
        /// Unit of both.
        unit: &'static str,
        /// The limit.
        limit: f64,
        /// Its key.
        key: &'static str,
        /// The profile's name.
        profile: String,
    },
    /// No revolution would end.
    #[error(
        "{term} {speed_rpm} is under {SLOWEST_RPM} rpm, too slow: a revolution would take hours; use from {SLOWEST_RPM} to {limit_rpm} rpm"
    )]
    TooSlow {
        /// What it is called.
        term: &'static str,
        /// What was asked for, rpm of the driver.
        speed_rpm: f64,
        /// The largest, rpm.
        limit_rpm: f64,
    },
    /// Negative, or no number.
    #[error("{term} {load_nm} N·m is no load; use from 0 to {limit_nm} N·m (limits.load_nm in profile '{profile}')")]
    NoLoad {
        /// What it is called.
        term: &'static str,
        /// What was asked for, N·m.
        load_nm: f64,
        /// The largest, N·m.
        limit_nm: f64,
        /// The profile's name.
        profile: String,
    },
    /// The brake's curve or its coil ends before it.
    #[error(
        "{term} {load_nm} N·m is beyond the brake's calibrated curve or its current limit {limit_a} A (brake.rising, brake.current_limit_a in profile '{profile}'); lower the load, or calibrate further"
    )]
    BeyondBrake {
        /// What it is called.
        term: &'static str,
        /// What was asked for, N·m.
        load_nm: f64,
        /// The coil's limit, A.
        limit_a: f64,
        /// The profile's name.
        profile: String,
    },
    /// The brake cannot shed so much heat.
    #[error(
        "{} {load_nm} N·m at {} {speed_rpm} rpm makes {power_w:.0} W of heat in the brake, over {limit_w} W (limits.slip_power_w in profile '{profile}'); lower load or speed",
        terms.load, terms.speed
    )]
    TooHot {
        /// What both are called.
        terms: Terms,
        /// The load, N·m.
        load_nm: f64,
        /// The speed, rpm of the driver.
        speed_rpm: f64,
        /// Slip power of both, W.
        power_w: f64,
        /// The continuous one, W.
        limit_w: f64,
        /// The profile's name.
        profile: String,
    },
}

/// Admits a run at a load and a speed of the driver.
///
/// # Errors
/// [`Refusal`]: the first limit of the profile that it is beyond.
pub fn admit(profile: &Profile, terms: Terms, load_nm: f64, speed_rpm: f64) -> Result<(), Refusal> {
    admit_speed(profile, terms, speed_rpm)?;
    admit_load(profile, terms, load_nm)?;
    admit_heat(profile, terms, load_nm, speed_rpm)
}

/// Admits every run of a job.
///
/// # Errors
/// As [`admit`].
pub fn admit_job(profile: &Profile, job: &Job) -> Result<(), Refusal> {
    job.runs.iter().try_for_each(|run| admit(profile, Terms::SET_POINTS, run.load_nm, run.speed_rpm))
}

/// Admits turning at a speed.
///
/// # Errors
/// [`Refusal::OverLimit`], [`Refusal::TooSlow`]; a speed that is no number is too slow.
pub fn admit_speed(profile: &Profile, terms: Terms, speed_rpm: f64) -> Result<(), Refusal> {
    let (term, limit) = (terms.speed, profile.limits.speed_rpm);
    over_limit(profile, term, speed_rpm, "rpm", limit, "limits.speed_rpm")?;
    if speed_rpm >= SLOWEST_RPM { Ok(()) } else { Err(Refusal::TooSlow { term, speed_rpm, limit_rpm: limit }) }
}

/// Admits a load at the driven gear, whatever turns.
///
/// # Errors
/// [`Refusal::OverLimit`], [`Refusal::NoLoad`], [`Refusal::BeyondBrake`].
pub fn admit_load(profile: &Profile, terms: Terms, load_nm: f64) -> Result<(), Refusal> {
    let (term, limit_nm) = (terms.load, profile.limits.load_nm);
    over_limit(profile, term, load_nm, "N·m", limit_nm, "limits.load_nm")?;
    if load_nm.is_nan() || load_nm < 0.0 {
        return Err(Refusal::NoLoad { term, load_nm, limit_nm, profile: profile.name.clone() });
    }
    if profile.brake.current_a(load_nm).is_none() {
        let limit_a = profile.brake.current_limit_a;
        return Err(Refusal::BeyondBrake { term, load_nm, limit_a, profile: profile.name.clone() });
    }
    Ok(())
}

/// Admits the heat that a load makes in the brake while the driver turns, for as long as it likes.
///
/// # Errors
/// [`Refusal::TooHot`].
pub fn admit_heat(profile: &Profile, terms: Terms, load_nm: f64, speed_rpm: f64) -> Result<(), Refusal> {
    let (power_w, limit_w) = (slip_power_w(load_nm, speed_rpm), profile.limits.slip_power_w);
    if power_w > limit_w {
        return Err(Refusal::TooHot { terms, load_nm, speed_rpm, power_w, limit_w, profile: profile.name.clone() });
    }
    Ok(())
}

fn over_limit(
    profile: &Profile,
    term: &'static str,
    value: f64,
    unit: &'static str,
    limit: f64,
    key: &'static str,
) -> Result<(), Refusal> {
    if value > limit {
        return Err(Refusal::OverLimit { term, value, unit, limit, key, profile: profile.name.clone() });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 40 rpm, 10 N·m and 31.42 W: 10 N·m at 30 rpm are 31.416 W.
    fn profile() -> Profile {
        let mut profile = Profile::simulated();
        let limits = &mut profile.limits;
        (limits.speed_rpm, limits.load_nm, limits.slip_power_w) = (40.0, 10.0, 31.42);
        profile
    }

    fn said(load_nm: f64, speed_rpm: f64) -> String {
        admit(&profile(), Terms::OPTIONS, load_nm, speed_rpm).expect_err("beyond a limit").to_string()
    }

    #[test]
    fn each_limit_from_both_sides() {
        let admitted = |load_nm, speed_rpm| admit(&profile(), Terms::OPTIONS, load_nm, speed_rpm);
        for (load_nm, speed_rpm) in [(5.0, 40.0), (10.0, 30.0), (0.0, 40.0), (10.0, SLOWEST_RPM)] {
            assert_eq!(admitted(load_nm, speed_rpm), Ok(()), "{load_nm} N·m at {speed_rpm} rpm");
        }
        for (load_nm, speed_rpm, needle) in [
            (5.0, 40.01, "--rpm 40.01 rpm is over the limit 40 rpm (limits.speed_rpm"),
            (5.0, 0.0099, "--rpm 0.0099 is under 0.01 rpm, too slow"),
            (5.0, 0.0, "too slow"),
            (5.0, f64::NAN, "too slow"),
            (10.01, 20.0, "--load 10.01 N·m is over the limit 10 N·m (limits.load_nm"),
            (-0.01, 20.0, "no load"),
            (f64::NAN, 20.0, "no load"),
            (10.0, 30.01, "31 W of heat in the brake, over 31.42 W (limits.slip_power_w"),
        ] {
            assert!(said(load_nm, speed_rpm).contains(needle), "{needle}: {}", said(load_nm, speed_rpm));
        }
    }

    #[test]
    fn the_brakes_coil_is_a_limit_too() {
        let mut profile = profile();
        profile.brake.current_limit_a = profile.brake.current_a(8.0).expect("within the curve");
        assert_eq!(admit_load(&profile, Terms::KEYS, 8.0), Ok(()));
        let said = admit_load(&profile, Terms::KEYS, 8.01).expect_err("beyond it").to_string();
        assert!(said.starts_with("load_nm = 8.01 N·m is beyond") && said.contains("brake.current_limit_a"), "{said}");
    }
}
