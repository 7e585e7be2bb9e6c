//! The limits of the profile, supervised during motion, and the brake's heat account. Pure: what is observed against what is allowed.

use thiserror::Error;

use crate::profile::Limits;

/// Ramps overshoot a set-point at the limit a little, and a current source regulates: the supervised limit is this much wider than
/// the one that set-points are refused by.
pub const OVERSHOOT: f64 = 1.1;

/// The heat account holds what this many seconds of the whole continuous power bring in.
pub const HEAT_SECONDS: f64 = 60.0;

/// What is supervised.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Observed {
    /// Driver speed by the encoder, rpm.
    pub speed_rpm: f64,
    /// Load at the driven gear by the brake's current, N·m.
    pub load_nm: f64,
    /// Temperature of the brake or its driver, °C.
    pub brake_temperature_c: f64,
    /// Largest departure of TE from the model since the run began, rad.
    pub excursion_rad: f64,
}

/// A limit that is supervised during motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Limit {
    /// Speed of the driver, with its overshoot.
    Speed,
    /// Load at the driven gear, with its overshoot.
    Load,
    /// Temperature of the brake or its driver.
    BrakeTemperature,
    /// Departure of TE from the model.
    TeExcursion,
    /// The brake's heat account.
    BrakeHeat,
    /// Speed while turning for set-up, against the speed asked for.
    SetUpSpeed,
    /// Torque at the driver while the brake is calibrated.
    SweepTorque,
}

impl Limit {
    /// What goes over.
    #[must_use]
    pub fn quantity(self) -> &'static str {
        match self {
            Self::Speed | Self::SetUpSpeed => "driver speed",
            Self::Load => "load",
            Self::BrakeTemperature => "brake temperature",
            Self::TeExcursion => "TE excursion",
            Self::BrakeHeat => "brake heat account",
            Self::SweepTorque => "torque at the driver",
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Speed | Self::SetUpSpeed => "rpm",
            Self::Load | Self::SweepTorque => "N·m",
            Self::BrakeTemperature => "°C",
            Self::TeExcursion => "mrad",
            Self::BrakeHeat => "J",
        }
    }

    /// Where in the profile it is set.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Speed => "limits.speed_rpm, and a tenth",
            Self::Load => "limits.load_nm, and a tenth",
            Self::BrakeTemperature => "limits.brake_temperature_c",
            Self::TeExcursion => "limits.te_excursion_mrad",
            Self::BrakeHeat => "60 s of limits.slip_power_w",
            Self::SetUpSpeed => "one and a half times --rpm",
            Self::SweepTorque => "three times limits.load_nm",
        }
    }

    /// What to do next.
    #[must_use]
    pub fn advice(self) -> &'static str {
        match self {
            Self::Speed => "check servo.reduction and the drive's tuning",
            Self::Load => "check the brake's current source and its calibration",
            Self::BrakeTemperature => "let the brake cool, or lower load or speed",
            Self::TeExcursion => "inspect the teeth before the next run",
            Self::BrakeHeat => "lower load or speed, or pause between runs",
            Self::SetUpSpeed => "check servo.reduction and the encoder's lines",
            Self::SweepTorque => "calibrate up to a smaller current (--max-current)",
        }
    }

    /// A brake that has cooled is within it again.
    #[must_use]
    pub fn is_remedied_by_cooling(self) -> bool {
        matches!(self, Self::BrakeTemperature | Self::BrakeHeat)
    }

    /// Checks a value; one that is no number is over its limit.
    ///
    /// # Errors
    /// [`Exceeded`] names quantity, value, limit and the profile's key.
    pub fn check(self, value: f64, allowed: f64) -> Result<(), Exceeded> {
        if value <= allowed { Ok(()) } else { Err(Exceeded { limit: self, value, allowed }) }
    }
}

/// A value over its limit.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "{} {value:.4} {} is over the limit {allowed} {} of the profile ({}); {}",
    limit.quantity(), limit.unit(), limit.unit(), limit.key(), limit.advice()
)]
pub struct Exceeded {
    /// Which limit.
    pub limit: Limit,
    /// What was observed, in the limit's unit.
    pub value: f64,
    /// The limit.
    pub allowed: f64,
}

/// Checks everything that is observed against its limit.
///
/// # Errors
/// The first that is [`Exceeded`].
pub fn check(limits: &Limits, observed: &Observed) -> Result<(), Exceeded> {
    Limit::Speed.check(observed.speed_rpm.abs(), limits.speed_rpm * OVERSHOOT)?;
    Limit::Load.check(observed.load_nm, limits.load_nm * OVERSHOOT)?;
    Limit::BrakeTemperature.check(observed.brake_temperature_c, limits.brake_temperature_c)?;
    Limit::TeExcursion.check(observed.excursion_rad * 1e3, limits.te_excursion_mrad)
}

/// Power that the brake turns into heat: W = T·ω of the driven gear; its mean speed is the driver's.
#[must_use]
pub fn slip_power_w(load_nm: f64, speed_rpm: f64) -> f64 {
    load_nm * speed_rpm.abs() * std::f64::consts::TAU / 60.0
}

/// Heat in the brake above what it sheds for ever, as the I²t account of a motor drive: what goes in above the continuous power
/// comes out at the same rate.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HeatAccount {
    heat_j: f64,
}

impl HeatAccount {
    /// Books `seconds` of slip: dQ/dt = T·2πn/60 − P, never below 0, P the continuous power of `limits.slip_power_w`.
    pub fn book(&mut self, limits: &Limits, load_nm: f64, speed_rpm: f64, seconds: f64) {
        let power_w = slip_power_w(load_nm, speed_rpm);
        self.heat_j = (self.heat_j + (power_w - limits.slip_power_w) * seconds).max(0.0);
    }

    /// What is in it, J.
    #[must_use]
    pub fn heat_j(&self) -> f64 {
        self.heat_j
    }

    /// Part of its room that is taken; above 1 it is spent.
    #[must_use]
    pub fn fraction(&self, limits: &Limits) -> f64 {
        self.heat_j / (limits.slip_power_w * HEAT_SECONDS)
    }

    /// Checks that there is room left.
    ///
    /// # Errors
    /// [`Limit::BrakeHeat`] is [`Exceeded`] when it is spent.
    pub fn check(&self, limits: &Limits) -> Result<(), Exceeded> {
        Limit::BrakeHeat.check(self.heat_j, limits.slip_power_w * HEAT_SECONDS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::Profile;

    fn limits() -> Limits {
        Profile::simulated().limits
    }

    fn key(outcome: Result<(), Exceeded>) -> Option<&'static str> {
        outcome.err().map(|exceeded| exceeded.limit.key())
    }

    #[test]
    fn each_limit_from_both_sides() {
        let limits = limits();
        let (speed, load) = (limits.speed_rpm * OVERSHOOT, limits.load_nm * OVERSHOOT);
        let just = Observed {
            speed_rpm: -speed,
            load_nm: load,
            brake_temperature_c: limits.brake_temperature_c,
            excursion_rad: limits.te_excursion_mrad * 1e-3,
        };
        assert_eq!(key(check(&limits, &just)), None, "at every limit at once");
        let hair = 1.0 + 1e-9;
        for (over, expected) in [
            (Observed { speed_rpm: speed * hair, ..just }, "limits.speed_rpm, and a tenth"),
            (Observed { speed_rpm: -speed * hair, ..just }, "limits.speed_rpm, and a tenth"),
            (Observed { load_nm: load * hair, ..just }, "limits.load_nm, and a tenth"),
            (Observed { brake_temperature_c: limits.brake_temperature_c * hair, ..just }, "limits.brake_temperature_c"),
            (Observed { excursion_rad: just.excursion_rad * hair, ..just }, "limits.te_excursion_mrad"),
        ] {
            assert_eq!(key(check(&limits, &over)), Some(expected), "{over:?}");
        }
    }

    #[test]
    fn a_value_that_is_no_number_is_over_its_limit() {
        let nan = Observed { brake_temperature_c: f64::NAN, ..Observed::default() };
        assert_eq!(key(check(&limits(), &nan)), Some("limits.brake_temperature_c"));
        assert!(key(check(&limits(), &Observed { speed_rpm: f64::NAN, ..Observed::default() })).is_some());
    }

    #[test]
    fn slip_power_is_torque_times_angular_speed() {
        assert!((slip_power_w(10.0, -60.0) - 20.0 * std::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn the_heat_account_fills_above_the_continuous_power_and_drains_below() {
        let limits = limits();
        // Twice the continuous power fills it in a minute, to the second.
        let load_nm = 2.0 * limits.slip_power_w / slip_power_w(1.0, 100.0);
        let mut account = HeatAccount::default();
        for _ in 0..600 {
            account.book(&limits, load_nm, 100.0, 0.1);
        }
        assert!((account.fraction(&limits) - 1.0).abs() < 1e-9);
        let (mut just, mut over) = (account, account);
        just.book(&limits, 0.0, 0.0, 0.001);
        assert_eq!(key(just.check(&limits)), None);
        over.book(&limits, load_nm, 100.0, 0.001);
        assert_eq!(key(over.check(&limits)), Some("60 s of limits.slip_power_w"));
        // At the continuous power nothing changes; without slip it is empty after a minute, and no emptier.
        just.book(&limits, 0.5 * load_nm, 100.0, 1e4);
        assert!((just.fraction(&limits) - 1.0).abs() < 1e-4);
        just.book(&limits, 0.0, 0.0, HEAT_SECONDS);
        assert_eq!(just.heat_j(), 0.0);
    }
}
