//! Which tooth pairs can touch: the tips of both gears.

use std::ops::RangeInclusive;

use super::solve::Touch;
use crate::Direction;
use crate::tip_reach::Tips;

impl Tips {
    /// Teeth that could be in contact.
    pub(super) fn candidates(&self, touch: &Touch) -> RangeInclusive<i64> {
        let (low_mm, high_mm) = (touch.arc_a_mm.min(touch.arc_b_mm), touch.arc_a_mm.max(touch.arc_b_mm));
        self.candidates_between((low_mm, high_mm), touch.direction)
    }

    /// Position of a tooth's contact in pitches of rolling from its pitch point, when it is within both tips.
    pub(super) fn phase_in_zone(&self, touch: &Touch, tooth: i64) -> Option<f64> {
        let half = if touch.direction == Direction::Ccw { 0.0 } else { 0.5 };
        let (begin_mm, end_mm) = self.passage_mm(tooth, touch.direction);
        let within = touch.begins_mm() >= begin_mm && touch.ends_mm() <= end_mm;
        within.then_some(touch.arc_a_mm / self.pitch_mm - (tooth as f64 + half))
    }
}
