//! The limits of the profile, supervised during motion, and the brake's heat account. Pure: what is observed against what is allowed.

use super::halt::Halt;
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

/// Checks everything that is observed against its limit; a value that is no number is over it.
///
/// # Errors
/// [`Halt::Limit`] names quantity, value, limit and the profile's key.
pub fn check(limits: &Limits, observed: &Observed) -> Result<(), Halt> {
    let over = |quantity, value: f64, limit: f64, unit, key, advice| {
        if value <= limit { Ok(()) } else { Err(Halt::Limit { quantity, value, limit, unit, key, advice }) }
    };
    over(
        "driver speed",
        observed.speed_rpm.abs(),
        limits.speed_rpm * OVERSHOOT,
        "rpm",
        "limits.speed_rpm, and a tenth",
        "check servo.reduction and the drive's tuning",
    )?;
    over(
        "load",
        observed.load_nm,
        limits.load_nm * OVERSHOOT,
        "N·m",
        "limits.load_nm, and a tenth",
        "check the brake's current source and its calibration",
    )?;
    over(
        "brake temperature",
        observed.brake_temperature_c,
        limits.brake_temperature_c,
        "°C",
        KEY_TEMPERATURE,
        "let the brake cool, or lower load or speed",
    )?;
    over(
        "TE excursion",
        observed.excursion_rad * 1e3,
        limits.te_excursion_mrad,
        "mrad",
        "limits.te_excursion_mrad",
        "inspect the teeth before the next run",
    )
}

/// Key of the temperature's limit.
pub const KEY_TEMPERATURE: &str = "limits.brake_temperature_c";
/// Key of the heat account.
pub const KEY_HEAT: &str = "60 s of limits.slip_power_w";

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

    /// DeviceKind of its room that is taken; above 1 it is spent.
    #[must_use]
    pub fn fraction(&self, limits: &Limits) -> f64 {
        self.heat_j / (limits.slip_power_w * HEAT_SECONDS)
    }

    /// Checks that there is room left.
    ///
    /// # Errors
    /// [`Halt::Limit`] when it is spent.
    pub fn check(&self, limits: &Limits) -> Result<(), Halt> {
        let limit = limits.slip_power_w * HEAT_SECONDS;
        if self.heat_j <= limit {
            return Ok(());
        }
        Err(Halt::Limit {
            quantity: "brake heat account",
            value: self.heat_j,
            limit,
            unit: "J",
            key: KEY_HEAT,
            advice: "lower load or speed, or pause between runs",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::Profile;

    fn limits() -> Limits {
        Profile::simulated().limits
    }

    fn key(outcome: Result<(), Halt>) -> Option<&'static str> {
        match outcome {
            Ok(()) => None,
            Err(Halt::Limit { key, .. }) => Some(key),
            Err(other) => panic!("{other}"),
        }
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
            (Observed { brake_temperature_c: limits.brake_temperature_c * hair, ..just }, KEY_TEMPERATURE),
            (Observed { excursion_rad: just.excursion_rad * hair, ..just }, "limits.te_excursion_mrad"),
        ] {
            assert_eq!(key(check(&limits, &over)), Some(expected), "{over:?}");
        }
    }

    #[test]
    fn a_value_that_is_no_number_is_over_its_limit() {
        let nan = Observed { brake_temperature_c: f64::NAN, ..Observed::default() };
        assert_eq!(key(check(&limits(), &nan)), Some(KEY_TEMPERATURE));
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
        assert_eq!(key(over.check(&limits)), Some(KEY_HEAT));
        // At the continuous power nothing changes; without slip it is empty after a minute, and no emptier.
        just.book(&limits, 0.5 * load_nm, 100.0, 1e4);
        assert!((just.fraction(&limits) - 1.0).abs() < 1e-4);
        just.book(&limits, 0.0, 0.0, HEAT_SECONDS);
        assert_eq!(just.heat_j(), 0.0);
    }
}
