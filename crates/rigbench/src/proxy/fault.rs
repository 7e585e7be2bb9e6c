//! The faults of a line, how often they come, and how many came.

use std::time::Duration;

use rand::RngExt as _;
use rand_pcg::Pcg64;
use serde::Serialize;

/// What goes wrong with one transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// The answer comes late, and with it all that follows it.
    Late,
    /// The answer comes late, and later answers overtake it.
    Overtaken,
    /// The answer comes in two parts.
    Split,
    /// The answer is held back and comes in one piece with the next.
    Merged,
    /// The request is echoed before the answer.
    Echoed,
    /// Up to three bits of the answer flip, or a burst of up to 16.
    Corrupt,
    /// The answer's end is missing.
    Truncated,
    /// The answer comes a second time, later.
    Duplicated,
    /// The answer names another unit, with a good CRC.
    WrongUnit,
    /// The answer never comes.
    Silence,
    /// The request never arrives.
    LostRequest,
    /// The request arrives damaged.
    CorruptRequest,
    /// Noise comes while nobody talks.
    Noise,
    /// The port hangs up.
    HangUp,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Late,
        Self::Overtaken,
        Self::Split,
        Self::Merged,
        Self::Echoed,
        Self::Corrupt,
        Self::Truncated,
        Self::Duplicated,
        Self::WrongUnit,
        Self::Silence,
        Self::LostRequest,
        Self::CorruptRequest,
        Self::Noise,
        Self::HangUp,
    ];

    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Late => "late",
            Self::Overtaken => "overtaken",
            Self::Split => "split",
            Self::Merged => "merged",
            Self::Echoed => "echoed",
            Self::Corrupt => "corrupt",
            Self::Truncated => "truncated",
            Self::Duplicated => "duplicated",
            Self::WrongUnit => "wrong_unit",
            Self::Silence => "silence",
            Self::LostRequest => "lost_request",
            Self::CorruptRequest => "corrupt_request",
            Self::Noise => "noise",
            Self::HangUp => "hang_up",
        }
    }

    /// Concerns the request, not its answer.
    #[must_use]
    pub fn is_of_request(self) -> bool {
        matches!(self, Self::Echoed | Self::LostRequest | Self::CorruptRequest | Self::Noise | Self::HangUp)
    }
}

/// How often which faults come, and how late answers may be.
#[derive(Debug, Clone)]
pub struct FaultPlan {
    /// Share of requests, and of answers, that a fault meets; both may meet one transaction.
    pub share: f64,
    /// Faults that are drawn from, each as likely as the other; a hang-up comes a hundred times more rarely.
    pub kinds: Vec<Fault>,
    /// An answer is late by up to this.
    pub latest: Duration,
    /// A repetition comes up to this after the answer.
    pub latest_repetition: Duration,
    random: Pcg64,
}

/// A hang-up costs a reconnection; one in so many of those drawn happens.
const HANG_UP_ONE_IN: u32 = 20;

impl FaultPlan {
    /// All faults, reproducible by `seed`.
    #[must_use]
    pub fn new(seed: u64, share: f64, latest: Duration, latest_repetition: Duration) -> Self {
        let random = Pcg64::new(u128::from(seed), 0x0a02_bdbf_7bb3_c0a7_ac28_fa16_a64a_bf96);
        Self { share, kinds: Fault::ALL.to_vec(), latest, latest_repetition, random }
    }

    /// The fault of a request, or of an answer.
    pub fn draw(&mut self, of_request: bool) -> Option<Fault> {
        if self.kinds.is_empty() || self.random.random::<f64>() >= self.share {
            return None;
        }
        let kinds: Vec<Fault> = self.kinds.iter().copied().filter(|kind| kind.is_of_request() == of_request).collect();
        let kind = *kinds.get(self.random.random_range(0..kinds.len().max(1)))?;
        (kind != Fault::HangUp || self.random.random_range(0..HANG_UP_ONE_IN) == 0).then_some(kind)
    }

    /// A time up to `longest`.
    pub fn delay(&mut self, longest: Duration) -> Duration {
        longest.mul_f64(self.random.random::<f64>())
    }

    /// A number below `end`, which is at least 1.
    pub fn below(&mut self, end: usize) -> usize {
        self.random.random_range(0..end.max(1))
    }

    /// Flips up to three bits anywhere, or a burst of up to 16: damage that a CRC of 16 bits always shows (its polynomial has the
    /// factor x + 1 and period 32 767 bits; Modbus over Serial Line V1.02, §6.2).
    pub fn damage(&mut self, bytes: &mut [u8]) {
        let bits = bytes.len() * 8;
        if bits == 0 {
            return;
        }
        let mut flip = |bit: usize| bytes[bit / 8] ^= 1 << (bit % 8);
        if self.random.random::<bool>() {
            let count = self.random.random_range(1..=3);
            // Different ones, or two flips would be none.
            let first = self.random.random_range(0..bits);
            let step = self.random.random_range(1..=(bits / 3).max(1));
            (0..count).for_each(|n| flip((first + n * step) % bits));
        } else {
            let length = self.random.random_range(1..=16.min(bits));
            let start = self.random.random_range(0..=bits - length);
            flip(start);
            (1..length).filter(|_| self.random.random::<bool>()).for_each(|n| flip(start + n));
        }
    }

    /// Bytes of noise.
    pub fn noise(&mut self) -> Vec<u8> {
        let count = self.random.random_range(1..=12);
        (0..count).map(|_| self.random.random()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damage_is_always_damage_and_a_crc_shows_it() {
        let mut plan = FaultPlan::new(7, 1.0, Duration::ZERO, Duration::ZERO);
        let request = wire::modbus::Request::ReadHolding { address: 0x58, count: 4 };
        let good = wire::modbus::encode_response(1, 3, &wire::modbus::Response::Registers(vec![1, 2, 3, 4])).unwrap();
        for _ in 0..100_000 {
            let mut bytes = good.clone();
            plan.damage(&mut bytes);
            assert_ne!(bytes, good);
            let outcome = wire::modbus::ClientDecoder::new(1, &request).feed(&bytes);
            assert!(!matches!(outcome, Ok(Some(_))), "{bytes:02X?}: {outcome:?}");
        }
    }

    #[test]
    fn every_kind_is_drawn_and_the_seed_decides() {
        let draw = |seed| {
            let mut plan = FaultPlan::new(seed, 0.5, Duration::ZERO, Duration::ZERO);
            (0..20_000).map(|n| plan.draw(n % 2 == 0)).collect::<Vec<_>>()
        };
        let drawn = draw(1);
        assert!(Fault::ALL.iter().all(|kind| drawn.contains(&Some(*kind))));
        assert_eq!(drawn, draw(1));
        assert_ne!(drawn, draw(2));
    }
}
