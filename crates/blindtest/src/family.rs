//! Families of withheld cases, and the order in which a set goes through them.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use rigsim::plant::faults::{FAULTS, FaultRng, UNMODELLED_FAULTS};

/// Sizes at which single effects are drawn, rad RMS.
pub const SINGLE_SIZES_RAD: [f64; 4] = [3e-6, 1e-5, 3e-5, 1e-4];

/// What a case is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum Family {
    /// Nothing is wrong.
    Null,
    /// One effect, at one of four sizes.
    Single,
    /// Two effects.
    Pair,
    /// Three effects.
    Triple,
    /// One effect that the diagnosis does not know.
    Outside,
    /// One effect that it knows and one that it does not.
    Mixed,
    /// One effect that it knows, but is told to do without.
    LeftOut,
}

impl Family {
    /// As in labels and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Single => "single",
            Self::Pair => "pair",
            Self::Triple => "triple",
            Self::Outside => "outside",
            Self::Mixed => "mixed",
            Self::LeftOut => "left_out",
        }
    }

    /// All, with how many cases of each a whole set has.
    #[must_use]
    pub fn shares() -> [(Self, usize); 7] {
        [
            (Self::Null, 60),
            (Self::Single, SINGLE_SIZES_RAD.len() * FAULTS.len()),
            (Self::Pair, 40),
            (Self::Triple, 30),
            (Self::Outside, 3 * UNMODELLED_FAULTS.len()),
            (Self::Mixed, 30),
            (Self::LeftOut, 12),
        ]
    }
}

/// Family of case `number`, and how many of that family came before it. Without a wish the set goes through all of them, mixed, so
/// that every part of it has about the same shares.
#[must_use]
pub fn of_case(number: usize, only: Option<Family>) -> (Family, usize) {
    if let Some(family) = only {
        return (family, number);
    }
    let order = order();
    let (round, place) = (number / order.len(), number % order.len());
    let family = order[place];
    let in_a_round = order.iter().filter(|other| **other == family).count();
    (family, round * in_a_round + order[..place].iter().filter(|other| **other == family).count())
}

/// A whole set, shuffled the same way for every seed.
fn order() -> Vec<Family> {
    let mut order: Vec<Family> =
        Family::shares().into_iter().flat_map(|(family, count)| std::iter::repeat_n(family, count)).collect();
    let mut rng = FaultRng::new(1);
    for n in (1..order.len()).rev() {
        order.swap(n, rng.below(n + 1));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_set_has_its_shares_and_numbers_them_through() {
        let total: usize = Family::shares().iter().map(|(_, count)| count).sum();
        for (family, count) in Family::shares() {
            let mut numbers: Vec<usize> =
                (0..total).map(|n| of_case(n, None)).filter(|(f, _)| *f == family).map(|(_, k)| k).collect();
            numbers.sort_unstable();
            assert_eq!(numbers, (0..count).collect::<Vec<_>>(), "{family:?}");
        }
        assert_eq!(of_case(total, None).0, of_case(0, None).0);
        assert_eq!(of_case(7, Some(Family::Null)), (Family::Null, 7));
    }
}
