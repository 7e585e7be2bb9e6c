//! How far the flanks reach to their tips, as a table: what a pair keeps and the contact reads.

use std::ops::RangeInclusive;

use crate::Direction;
use crate::gear::Gear;

/// How far along the rack each tooth's flank reaches to its tip, mm of rolling from the pitch point.
///
/// Tips lie on the curve that stands off the pitch curve by the addendum: a true distance, measured at the foot of the
/// tip, not at the rolling position that generates it.
#[derive(Clone, Debug)]
pub(crate) struct Tips {
    /// Pitch along the pitch curve, mm.
    pub(crate) pitch_mm: f64,
    /// How far thinning moves each gear's flank along the rack, mm.
    pub(crate) thinning_mm: f64,
    /// Reach of gear 1's flanks, ccw then cw, by tooth: contact beyond it (in the sense of motion) is off the tip.
    pub(crate) driver_mm: [Vec<f64>; 2],
    /// Reach of gear 2's flanks: contact before it has not reached the tip yet.
    pub(crate) driven_mm: [Vec<f64>; 2],
    /// Largest reach of all, for bounding the search.
    pub(crate) longest_mm: f64,
}

impl Tips {
    /// Reach of a gear's flanks of one side to their tips, by tooth, mm of rolling.
    pub(crate) fn reaches_mm(&self, gear: Gear, side: Direction) -> &[f64] {
        match gear {
            Gear::Driver => &self.driver_mm[side.index()],
            Gear::Driven => &self.driven_mm[side.index()],
        }
    }

    /// Teeth that could be in contact while the contact's arc lengths stay within `arcs_mm`.
    pub(crate) fn candidates_between(&self, arcs_mm: (f64, f64), direction: Direction) -> RangeInclusive<i64> {
        let half = if direction == Direction::Ccw { 0.0 } else { 0.5 };
        let reach_mm = self.longest_mm + self.thinning_mm;
        let (low, high) = ((arcs_mm.0 - reach_mm) / self.pitch_mm, (arcs_mm.1 + reach_mm) / self.pitch_mm);
        ((low - half).ceil() as i64)..=((high - half).floor() as i64)
    }

    /// Pitches of rolling for which a tooth's flank can be in contact.
    pub(crate) fn contact_ratio(&self, tooth: i64, direction: Direction) -> f64 {
        let side = direction.index();
        let reach = |table: &[f64]| {
            table.get(tooth.rem_euclid(table.len().max(1) as i64) as usize).copied().unwrap_or(f64::NAN)
        };
        (reach(&self.driver_mm[side]) + reach(&self.driven_mm[side])) / self.pitch_mm
    }

    /// Where a tooth pair's contact begins and ends as θ1 grows, mm of arc length: it has begun once the contact on one
    /// gear's flank (`begins_mm`) is past the first value, and ends when that on the other gear's
    /// (`ends_mm`) passes the second. NaN without teeth.
    pub(crate) fn passage_mm(&self, tooth: i64, direction: Direction) -> (f64, f64) {
        let side = direction.index();
        let half = if direction == Direction::Ccw { 0.0 } else { 0.5 };
        let origin_mm = (tooth as f64 + half) * self.pitch_mm;
        let reach = |table: &[f64]| {
            table.get(tooth.rem_euclid(table.len().max(1) as i64) as usize).copied().unwrap_or(f64::NAN)
        };
        let (driver_mm, driven_mm) = (reach(&self.driver_mm[side]), reach(&self.driven_mm[side]));
        // Towards the tip of gear 1 the rack's offset grows on the ccw flank and falls on the cw flank.
        let (before_mm, after_mm) = match direction {
            Direction::Ccw => (driven_mm, driver_mm),
            Direction::Cw => (driver_mm, driven_mm),
        };
        (origin_mm - self.thinning_mm - before_mm, origin_mm + self.thinning_mm + after_mm)
    }
}
