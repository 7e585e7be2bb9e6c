//! The two gears of a pair, by name.

/// Which gear of the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Gear {
    /// Gear 1, at the origin.
    Driver,
    /// Gear 2, at (a, 0).
    Driven,
}

impl Gear {
    /// 1 or 2.
    #[must_use]
    pub fn number(self) -> u8 {
        match self {
            Self::Driver => 1,
            Self::Driven => 2,
        }
    }
}
