//! Things that give way for good: the clamp of the output encoder's shaft, and the counter of the output.

use super::error::{PlantError, in_range};
use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// Clamp between gear 2 and the output encoder.
#[derive(Debug, Clone, PartialEq)]
pub struct ClampSpec {
    /// Creep per driver revolution and per N·m above the threshold, rad/(N·m); 0 switches it off.
    pub creep_rad_per_rev_nm: f64,
    /// Torque up to which the clamp holds, N·m.
    pub threshold_nm: f64,
    /// Mean size of one slip, rad.
    pub event_rad: f64,
}

impl Default for ClampSpec {
    fn default() -> Self {
        Self { creep_rad_per_rev_nm: 0.0, threshold_nm: 0.0, event_rad: 2e-6 }
    }
}

impl ClampSpec {
    pub(super) fn validate(&self) -> Result<(), PlantError> {
        let creep = self.creep_rad_per_rev_nm;
        in_range("clamp.creep_rad_per_rev_nm", creep, "rad/(N·m)", (0.0, 0.01), "per driver revolution")?;
        in_range("clamp.threshold_nm", self.threshold_nm, "N·m", (0.0, 1e4), "torque up to which it holds")?;
        in_range("clamp.event_rad", self.event_rad, "rad", (1e-9, 0.01), "mean size of one slip")
    }
}

/// The creeping clamp: the excess torque uses up the grip over the angle travelled, then the clamp slips by as much.
#[derive(Debug, Clone)]
pub(super) struct Creep {
    creep_rad_per_rad_nm: f64,
    threshold_nm: f64,
    mean_event_rad: f64,
    pending_rad: f64,
    event_rad: f64,
    slipped_rad: f64,
    rng: Pcg64Mcg,
}

impl Creep {
    /// `None` for a clamp that holds.
    pub fn new(spec: &ClampSpec, mut rng: Pcg64Mcg) -> Option<Self> {
        if spec.creep_rad_per_rev_nm == 0.0 {
            return None;
        }
        let draw: f64 = Exp1.sample(&mut rng);
        Some(Self {
            creep_rad_per_rad_nm: spec.creep_rad_per_rev_nm / TAU,
            threshold_nm: spec.threshold_nm,
            mean_event_rad: spec.event_rad,
            pending_rad: 0.0,
            event_rad: spec.event_rad * draw,
            slipped_rad: 0.0,
            rng,
        })
    }

    /// Lag of the encoder's side behind gear 2 after `travel_rad` of driver rotation under `torque_nm`, rad.
    #[inline]
    pub fn advance(&mut self, travel_rad: f64, torque_nm: f64) -> f64 {
        let excess = (torque_nm.abs() - self.threshold_nm).max(0.0);
        self.pending_rad += (self.creep_rad_per_rad_nm * excess * travel_rad).copysign(torque_nm);
        if self.pending_rad.abs() >= self.event_rad {
            self.slipped_rad += self.pending_rad;
            self.pending_rad = 0.0;
            let draw: f64 = Exp1.sample(&mut self.rng);
            self.event_rad = self.mean_event_rad * draw;
        }
        self.slipped_rad
    }
}

/// A counter that misses edges: events at random over the angle travelled.
#[derive(Debug, Clone)]
pub(super) struct CountLoss {
    counts: i64,
    mean_interval_rad: f64,
    remaining_rad: f64,
    rng: Pcg64Mcg,
}

impl CountLoss {
    /// `None` for a counter that counts.
    pub fn new(counts: i64, losses_per_rev: f64, mut rng: Pcg64Mcg) -> Option<Self> {
        if counts == 0 || losses_per_rev == 0.0 {
            return None;
        }
        let mean_interval_rad = TAU / losses_per_rev;
        let draw: f64 = Exp1.sample(&mut rng);
        Some(Self { counts, mean_interval_rad, remaining_rad: mean_interval_rad * draw, rng })
    }

    /// Counts lost over `travel_rad` of driver rotation.
    #[inline]
    pub fn advance(&mut self, travel_rad: f64) -> i64 {
        self.remaining_rad -= travel_rad;
        let mut lost = 0;
        while self.remaining_rad <= 0.0 {
            lost += self.counts;
            let draw: f64 = Exp1.sample(&mut self.rng);
            // A draw of zero would make no progress.
            self.remaining_rad += self.mean_interval_rad * draw.max(1e-9);
        }
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn the_clamp_creeps_per_revolution_above_its_threshold_only() {
        let spec = ClampSpec { creep_rad_per_rev_nm: 1e-6, threshold_nm: 4.0, event_rad: 2e-6 };
        let mut creep = Creep::new(&spec, Pcg64Mcg::seed_from_u64(2)).unwrap();
        let mut turn = |torque: f64| (0..1000).map(|_| creep.advance(TAU / 10.0, torque)).last().unwrap();
        assert_eq!(turn(3.9), 0.0);
        let slipped = turn(10.0);
        assert!((slipped - 100.0 * 6e-6).abs() < 2e-5, "{slipped}");
        // The other sense slips back.
        assert!(turn(-10.0).abs() < 4e-5);
    }

    #[test]
    fn losses_come_at_their_mean_rate() {
        let mut loss = CountLoss::new(-5, 2.0, Pcg64Mcg::seed_from_u64(2)).unwrap();
        let lost: i64 = (0..100_000).map(|_| loss.advance(TAU / 100.0)).sum();
        assert!((lost + 10_000).abs() < 900, "{lost}");
    }

    #[test]
    fn what_holds_costs_nothing() {
        assert!(Creep::new(&ClampSpec::default(), Pcg64Mcg::seed_from_u64(2)).is_none());
        assert!(CountLoss::new(3, 0.0, Pcg64Mcg::seed_from_u64(2)).is_none());
    }
}
