//! How often one may ask: a bucket of requests for each address, refilled with time.

use std::collections::HashMap;
use std::net::IpAddr;
use std::time::{Duration, Instant};

/// Addresses that are remembered; beyond, those that have rested longest are forgotten.
const ADDRESSES: usize = 1024;

/// A limit of so many at once, and so many a second.
#[derive(Debug, Clone, Copy)]
pub struct Rate {
    /// At once.
    pub burst: f64,
    /// Sustained, 1/s.
    pub per_second: f64,
}

/// Requests of any kind: a page asks four times a second, and there may be some pages.
pub const REQUESTS: Rate = Rate { burst: 200.0, per_second: 100.0 };
/// Wrong tokens: enough for a person who mistypes, not for a program that guesses.
pub const WRONG_TOKENS: Rate = Rate { burst: 5.0, per_second: 0.1 };

/// Counts requests by address.
#[derive(Debug)]
pub struct Limiter {
    rate: Rate,
    buckets: HashMap<IpAddr, (f64, Instant)>,
}

impl Limiter {
    /// A limiter of this rate.
    #[must_use]
    pub fn new(rate: Rate) -> Self {
        Self { rate, buckets: HashMap::new() }
    }

    /// Whether `address` has a request left now; takes it where `take` says so. Otherwise how long to wait.
    ///
    /// # Errors
    /// The time until there is one.
    pub fn ask(&mut self, address: IpAddr, now: Instant, take: bool) -> Result<(), Duration> {
        if self.buckets.len() >= ADDRESSES && !self.buckets.contains_key(&address) {
            let oldest = self.buckets.iter().min_by_key(|(_, (_, seen))| *seen).map(|(address, _)| *address);
            oldest.map(|address| self.buckets.remove(&address));
        }
        let (left, seen) = self.buckets.entry(address).or_insert((self.rate.burst, now));
        let rested = now.saturating_duration_since(*seen).as_secs_f64() * self.rate.per_second;
        *left = (*left + rested).min(self.rate.burst);
        *seen = now;
        if *left < 1.0 {
            return Err(Duration::from_secs_f64((1.0 - *left) / self.rate.per_second));
        }
        if take {
            *left -= 1.0;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_is_allowed_and_then_the_rate() {
        let mut limiter = Limiter::new(Rate { burst: 3.0, per_second: 2.0 });
        let (one, two) = (IpAddr::from([10, 0, 0, 1]), IpAddr::from([10, 0, 0, 2]));
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        assert!((0..3).all(|_| limiter.ask(one, start, true).is_ok()));
        assert_eq!(limiter.ask(one, start, true), Err(Duration::from_millis(500)));
        assert!(limiter.ask(two, start, true).is_ok(), "each address for itself");
        assert!(limiter.ask(one, at(499), true).is_err());
        assert!(limiter.ask(one, at(501), false).is_ok() && limiter.ask(one, at(501), true).is_ok());
        assert!(limiter.ask(one, at(501), true).is_err());
        assert!((0..3).all(|_| limiter.ask(one, at(60_000), true).is_ok()));
        assert!(limiter.ask(one, at(60_000), true).is_err(), "no more than the burst is saved up");
    }

    #[test]
    fn memory_is_bounded_whoever_asks() {
        let mut limiter = Limiter::new(REQUESTS);
        let start = Instant::now();
        for n in 0..5_000u32 {
            let _ = limiter.ask(IpAddr::from(n.to_be_bytes()), start + Duration::from_millis(u64::from(n)), true);
        }
        assert_eq!(limiter.buckets.len(), ADDRESSES);
    }
}
