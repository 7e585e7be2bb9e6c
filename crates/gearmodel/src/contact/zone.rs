//! Which tooth pairs can touch: the tips of both gears.

use std::ops::RangeInclusive;

use super::solve::Touch;
use super::tooth_errors::side_index;
use crate::flank::Gear;
use crate::{Direction, GearPair};

/// How far along the rack each tooth's flank reaches to its tip, mm of rolling from the pitch point.
///
/// Tips lie on the curve that stands off the pitch curve by the addendum: a true distance, measured at the foot of the
/// tip, not at the rolling position that generates it.
#[derive(Clone, Debug)]
pub(crate) struct Tips {
    pitch_mm: f64,
    /// How far thinning moves each gear's flank along the rack, mm.
    thinning_mm: f64,
    /// Reach of gear 1's flanks, ccw then cw, by tooth: contact beyond it (in the sense of motion) is off the tip.
    driver_mm: [Vec<f64>; 2],
    /// Reach of gear 2's flanks: contact before it has not reached the tip yet.
    driven_mm: [Vec<f64>; 2],
    /// Largest reach of all, for bounding the search.
    longest_mm: f64,
}

impl Tips {
    /// Tips of a pair; empty without teeth.
    pub(crate) fn of(pair: &GearPair) -> Self {
        let pitch_mm = pair.pitch_mm().unwrap_or(f64::NAN);
        let thinning_mm = 0.25 * pair.backlash_mm();
        let (z1, z2) = pair.teeth();
        let reaches = |gear: Gear, teeth: u32| {
            Direction::BOTH
                .map(|side| (0..teeth).map(|tooth| pair.tip_of(gear, i64::from(tooth), side).reach_mm).collect())
        };
        let driver_mm: [Vec<f64>; 2] = reaches(Gear::Driver, z1);
        let driven_mm: [Vec<f64>; 2] = reaches(Gear::Driven, z2);
        let longest_mm = driver_mm.iter().chain(&driven_mm).flatten().copied().fold(0.0, f64::max);
        Self { pitch_mm, thinning_mm, driver_mm, driven_mm, longest_mm }
    }

    /// Pitch along the pitch curve, mm.
    pub(super) fn pitch_mm(&self) -> f64 {
        self.pitch_mm
    }

    /// Reach of a gear's flanks of one side to their tips, by tooth, mm of rolling.
    pub(crate) fn reaches_mm(&self, gear: Gear, side: Direction) -> &[f64] {
        match gear {
            Gear::Driver => &self.driver_mm[side_index(side)],
            Gear::Driven => &self.driven_mm[side_index(side)],
        }
    }

    /// Teeth that could be in contact.
    pub(super) fn candidates(&self, touch: &Touch) -> RangeInclusive<i64> {
        let (low_mm, high_mm) = (touch.arc_a_mm.min(touch.arc_b_mm), touch.arc_a_mm.max(touch.arc_b_mm));
        self.candidates_between((low_mm, high_mm), touch.direction)
    }

    /// Teeth that could be in contact while the contact's arc lengths stay within `arcs_mm`.
    pub(super) fn candidates_between(&self, arcs_mm: (f64, f64), direction: Direction) -> RangeInclusive<i64> {
        let half = if direction == Direction::Ccw { 0.0 } else { 0.5 };
        let reach_mm = self.longest_mm + self.thinning_mm;
        let (low, high) = ((arcs_mm.0 - reach_mm) / self.pitch_mm, (arcs_mm.1 + reach_mm) / self.pitch_mm);
        ((low - half).ceil() as i64)..=((high - half).floor() as i64)
    }

    /// Pitches of rolling for which a tooth's flank can be in contact.
    pub(super) fn contact_ratio(&self, tooth: i64, direction: Direction) -> f64 {
        let side = side_index(direction);
        let reach = |table: &[f64]| {
            table.get(tooth.rem_euclid(table.len().max(1) as i64) as usize).copied().unwrap_or(f64::NAN)
        };
        (reach(&self.driver_mm[side]) + reach(&self.driven_mm[side])) / self.pitch_mm
    }

    /// Where a tooth pair's contact begins and ends as θ1 grows, mm of arc length: it has begun once the contact on one
    /// gear's flank ([`Touch::begins_mm`]) is past the first value, and ends when that on the other gear's
    /// ([`Touch::ends_mm`]) passes the second. NaN without teeth.
    pub(super) fn passage_mm(&self, tooth: i64, direction: Direction) -> (f64, f64) {
        let side = side_index(direction);
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

    /// Position of a tooth's contact in pitches of rolling from its pitch point, when it is within both tips.
    pub(super) fn phase_in_zone(&self, touch: &Touch, tooth: i64) -> Option<f64> {
        let half = if touch.direction == Direction::Ccw { 0.0 } else { 0.5 };
        let (begin_mm, end_mm) = self.passage_mm(tooth, touch.direction);
        let within = touch.begins_mm() >= begin_mm && touch.ends_mm() <= end_mm;
        within.then_some(touch.arc_a_mm / self.pitch_mm - (tooth as f64 + half))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CircularSpec;

    #[test]
    fn reach_of_a_circular_gear_is_that_of_its_tip_circle() {
        let pair = GearPair::circular(&CircularSpec { teeth: (23, 47), ..Default::default() }).unwrap();
        let tips = Tips::of(&pair);
        let alpha = pair.pressure_angle_rad();
        for (table, teeth) in [(&tips.driver_mm, 23.0), (&tips.driven_mm, 47.0)] {
            let (radius, base, tip) = (1.5 * teeth, 1.5 * teeth * alpha.cos(), 1.5 * teeth + 3.0);
            // Length of the line of action from the pitch point to the tip circle is d cos α.
            let expected = ((tip * tip - base * base).sqrt() - radius * alpha.sin()) / alpha.cos();
            for reach in table.iter().flatten() {
                assert!((reach - expected).abs() < 1e-8, "{reach} {expected}");
            }
        }
    }
}
