//! Random choices for drawing faults.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// A stream of random choices.
#[derive(Debug, Clone)]
pub struct FaultRng(Pcg64Mcg);

impl FaultRng {
    /// The stream of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Evenly from `from` to `to`.
    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        let draw: f64 = StandardUniform.sample(&mut self.0);
        from + (to - from) * draw
    }

    /// Evenly in the logarithm from `from` to `to`, both positive.
    pub fn spread(&mut self, from: f64, to: f64) -> f64 {
        self.between(from.ln(), to.ln()).exp()
    }

    /// An angle of the full turn, rad.
    pub fn angle(&mut self) -> f64 {
        self.between(0.0, TAU)
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// +1 or −1.
    pub fn sign(&mut self) -> f64 {
        if self.below(2) == 0 { 1.0 } else { -1.0 }
    }

    /// A whole number from 0 to `count` − 1; 0 for an empty range.
    pub fn below(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f64) as usize).min(count.saturating_sub(1))
    }

    /// A seed for a stream of its own.
    pub fn seed(&mut self) -> u64 {
        StandardUniform.sample(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_stay_in_their_ranges_and_reach_all_of_them() {
        let mut rng = FaultRng::new(3);
        let mut seen = [0usize; 5];
        for _ in 0..5000 {
            seen[rng.below(5)] += 1;
            assert!((2.0..3.0).contains(&rng.between(2.0, 3.0)));
            assert!((1e-3..1.0).contains(&rng.spread(1e-3, 1.0)));
        }
        assert!(seen.iter().all(|count| (900..1100).contains(count)), "{seen:?}");
        let plus = (0..1000).filter(|_| rng.sign() > 0.0).count();
        assert!((430..570).contains(&plus));
    }
}
