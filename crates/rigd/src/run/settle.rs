//! Whether the rig has settled, by what is measured: TE of the same quarter of a turn, a revolution apart.
//!
//! Quarters a revolution apart are compared, for whatever the model does not know repeats with the revolution and is no drift.

use super::job::Settle;

/// Quarters of a turn that a revolution has.
const QUARTERS: usize = 4;

/// Collects TE less the model over quarters of a turn.
#[derive(Debug, Clone)]
pub struct SettleMonitor {
    settle: Settle,
    from_rad: f64,
    quarter: Option<i64>,
    sum_rad: f64,
    count: u32,
    means_rad: Vec<f64>,
}

impl SettleMonitor {
    /// Begins at a driver angle.
    #[must_use]
    pub fn new(settle: Settle, from_rad: f64) -> Self {
        Self { settle, from_rad, quarter: None, sum_rad: 0.0, count: 0, means_rad: Vec::new() }
    }

    /// Takes TE less the model at a driver angle.
    pub fn push(&mut self, theta1_rad: f64, residual_rad: f64) {
        if !residual_rad.is_finite() {
            return;
        }
        let turned = (theta1_rad - self.from_rad).abs();
        let quarter = (turned / std::f64::consts::FRAC_PI_2).floor() as i64;
        if self.quarter.is_some_and(|before| before != quarter) && self.count > 0 {
            self.means_rad.push(self.sum_rad / f64::from(self.count));
            (self.sum_rad, self.count) = (0.0, 0);
        }
        self.quarter = Some(quarter);
        self.sum_rad += residual_rad;
        self.count += 1;
    }

    /// The change over the last revolution, rad; `None` before five whole quarters.
    #[must_use]
    pub fn change_rad(&self) -> Option<f64> {
        let last = self.means_rad.len().checked_sub(1)?;
        let before = last.checked_sub(QUARTERS)?;
        Some((self.means_rad[last] - self.means_rad[before]).abs())
    }

    /// It has settled.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        self.change_rad().is_some_and(|change| change <= self.settle.te_change_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns until stable when TE is `te` of the turns so far.
    fn turns_until_stable(limit_rad: f64, te: impl Fn(f64) -> f64) -> Option<f64> {
        let mut monitor = SettleMonitor::new(Settle { te_change_rad: limit_rad, turns_max: 20.0 }, 0.7);
        (0..20_000).map(|n| f64::from(n) * 1e-3).find(|turns| {
            monitor.push(0.7 - turns * std::f64::consts::TAU, te(*turns));
            monitor.is_stable()
        })
    }

    #[test]
    fn what_repeats_with_the_revolution_is_stable_after_five_quarters() {
        let wave = |turns: f64| 1e-3 * (turns * std::f64::consts::TAU).sin();
        let turns = turns_until_stable(1e-9, wave).expect("stable");
        assert!((turns - 1.25).abs() < 0.01, "{turns}");
    }

    #[test]
    fn a_decay_is_waited_for_until_its_change_a_revolution_is_small_enough() {
        let decay = |turns: f64| 100e-6 * (-turns / 2.0).exp();
        let turns = turns_until_stable(5e-6, decay).expect("stable");
        // Change over a revolution: 100·e^(−t/2)·(e^(1/2) − 1) = 5 µrad at t = 5.1 turns, seen from a quarter's middle at its end.
        assert!((5.0..5.6).contains(&turns), "{turns}");
        assert_eq!(turns_until_stable(5e-6, |turns| 6e-6 * turns), None, "a steady drift never settles");
        assert!(turns_until_stable(5e-6, |turns| 4e-6 * turns).is_some());
    }
}
