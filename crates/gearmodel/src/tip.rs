//! Where flanks end: the tips.
//!
//! Tips lie on the curve that stands off the pitch curve by the addendum: a true distance, measured at the foot of the tip,
//! not at the rolling position that generates it.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::gear::Gear;
use crate::tip_reach::Tips;
use crate::{Direction, GearPair};

/// The end of a flank.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tip {
    /// Rack offset |d| at which the flank reaches its tip, mm of rolling from the pitch point.
    pub(crate) reach_mm: f64,
    /// Rolling position of the foot of the tip on the pitch curve, rad.
    pub(crate) foot_rad: f64,
}

/// +1 where the flank is met root first as θ1 grows (gear 1's ccw flanks, gear 2's cw flanks), −1 where tip first.
pub(crate) fn rising(gear: Gear, side: Direction) -> f64 {
    match gear {
        Gear::Driver => side.sign(),
        Gear::Driven => -side.sign(),
    }
}

impl GearPair {
    /// Arc length at which a flank, thinned by its share of the backlash, passes the pitch point, mm.
    pub(crate) fn flank_origin_mm(&self, gear: Gear, tooth: i64, side: Direction) -> f64 {
        let half = if side == Direction::Ccw { 0.0 } else { 0.5 };
        (tooth as f64 + half) * PI * self.module_mm() + rising(gear, side) * 0.25 * self.backlash_mm()
    }

    /// A flank's point in its gear's body, mm, and the rolling position that generates it, by rack offset.
    pub(crate) fn flank_point(&self, gear: Gear, tooth: i64, side: Direction, d_mm: f64) -> ([f64; 2], f64) {
        let roll = self.roll(self.theta1_at_arc_length(self.flank_origin_mm(gear, tooth, side) + d_mm));
        (self.to_body(gear, &roll, self.rack_contact(&roll, d_mm, side)), roll.at.theta1_rad)
    }

    /// The tip of a flank: false position (Illinois) on the true height over the pitch curve.
    pub(crate) fn tip_of(&self, gear: Gear, tooth: i64, side: Direction) -> Tip {
        let addendum_mm = self.addendum() * self.module_mm();
        let (sin_alpha, cos_alpha) = self.pressure_angle_rad().sin_cos();
        let rising = rising(gear, side);
        let excess = |reach_mm: f64| {
            let (body, theta_rad) = self.flank_point(gear, tooth, side, rising * reach_mm);
            let (height_mm, foot_rad) = self.height_over_pitch_curve(gear, body, theta_rad);
            (height_mm - addendum_mm, foot_rad)
        };
        // The rack itself would reach the height here; a convex curve bends away and brings the tip nearer.
        let mut high = addendum_mm / (sin_alpha * cos_alpha);
        let (mut at_high, mut foot_rad) = excess(high);
        if at_high < 0.0 {
            // A concave pitch curve bends the tip out of the rack's reach.
            high *= 2.0;
            (at_high, foot_rad) = excess(high);
        }
        let (mut low, mut at_low) = (0.0, -addendum_mm);
        for _ in 0..60 {
            let middle = (low * at_high - high * at_low) / (at_high - at_low);
            let (at_middle, foot) = excess(middle);
            foot_rad = foot;
            if at_middle.abs() < 1e-11 || (high - low).abs() < 1e-12 {
                return Tip { reach_mm: middle, foot_rad };
            }
            if at_middle * at_high < 0.0 {
                (low, at_low) = (high, at_high);
            } else {
                at_low *= 0.5;
            }
            (high, at_high) = (middle, at_middle);
        }
        Tip { reach_mm: high, foot_rad }
    }

    /// How far every flank reaches to its tip: found when first asked for, and kept with the pair.
    pub(crate) fn tips(&self) -> Arc<Tips> {
        self.kept_tips().get_or_init(|| Arc::new(reach(self))).clone()
    }
}

/// Reach of every flank of a pair; empty without teeth.
fn reach(pair: &GearPair) -> Tips {
    let pitch_mm = pair.pitch_mm().unwrap_or(f64::NAN);
    let thinning_mm = 0.25 * pair.backlash_mm();
    let (z1, z2) = pair.teeth();
    let reaches = |gear: Gear, teeth: u32| {
        Direction::BOTH.map(|side| (0..teeth).map(|tooth| pair.tip_of(gear, i64::from(tooth), side).reach_mm).collect())
    };
    let driver_mm: [Vec<f64>; 2] = reaches(Gear::Driver, z1);
    let driven_mm: [Vec<f64>; 2] = reaches(Gear::Driven, z2);
    let longest_mm = driver_mm.iter().chain(&driven_mm).flatten().copied().fold(0.0, f64::max);
    Tips { pitch_mm, thinning_mm, driver_mm, driven_mm, longest_mm }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CircularSpec;

    #[test]
    fn reach_of_a_circular_gear_is_that_of_its_tip_circle() {
        let pair = GearPair::circular(&CircularSpec { teeth: (23, 47), ..Default::default() }).unwrap();
        let tips = pair.tips();
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
