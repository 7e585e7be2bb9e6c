//! Errors of single teeth: pitch, profile, damage.
//!
//! Sign convention of a lead: mm along the common normal, positive where it moves the driven gear ahead (+θ2), in both
//! senses. A tooth displaced as a whole is then equal on both flanks, a thicker tooth opposite.

use std::f64::consts::{PI, TAU};

use crate::geometry_error::{GeometryError, check_range};
use crate::{Direction, GearPair};

/// The same profile deviation on every tooth of a flank, over the phase u in pitches of rolling from the pitch point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// Lead per pitch of rolling, mm: a wrong pressure angle.
    pub slope_mm: f64,
    /// Relief half a pitch from the pitch point, mm, growing with u²: material missing, a lag in either sense.
    pub crown_mm: f64,
    /// Form waves: (amplitude mm, phase rad) of mesh order 1, 2, …: lead = Σ amplitude·cos(2π n u − phase).
    pub waves: Vec<(f64, f64)>,
}

/// Material missing on one flank of one driver tooth: a lag depth·cos²(π u/(2 w)) for |u| < w.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToothDamage {
    /// Tooth of the driver, 0..Z1.
    pub tooth: u32,
    /// Flank, by the driving sense in which it carries.
    pub flank: Direction,
    /// Depth along the normal, mm.
    pub depth_mm: f64,
    /// Half length w in pitches of rolling: half the depth is left at w/2, none at w.
    pub width: f64,
}

/// Errors of the teeth of both gears. The default has none; empty tables mean perfect teeth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ToothErrors {
    /// Lead of each driver tooth, mm: [ccw flanks, cw flanks], Z1 values each or none.
    pub driver_pitch_mm: [Vec<f64>; 2],
    /// Lead by each tooth space of the driven gear, mm: [ccw flanks, cw flanks], Z2 values each or none; entry j mates with
    /// driver tooth j.
    pub driven_pitch_mm: [Vec<f64>; 2],
    /// Profile of the pair's [ccw, cw] flanks, driver and driven together.
    pub profile: [Profile; 2],
    /// Damaged driver teeth.
    pub damage: Vec<ToothDamage>,
}

/// Largest tooth error accepted, in modules: more is a missing tooth, not an error of one.
const MAX_ERROR_MODULES: f64 = 1.0;

impl ToothErrors {
    /// Passes errors that fit a pair.
    pub(super) fn check(&self, pair: &GearPair) -> Result<(), GeometryError> {
        let limit = MAX_ERROR_MODULES * pair.module_mm().max(f64::MIN_POSITIVE);
        let length = |quantity: &'static str, value: f64| {
            check_range(quantity, value, "mm", (-limit, limit), "a tooth error is smaller than the module").map(|_| ())
        };
        let (z1, z2) = pair.teeth();
        for (gear, teeth, tables) in [(1, z1, &self.driver_pitch_mm), (2, z2, &self.driven_pitch_mm)] {
            for table in tables {
                if !table.is_empty() && table.len() != teeth as usize {
                    return Err(GeometryError::ToothTable { gear, given: table.len(), teeth });
                }
                table.iter().try_for_each(|value| length("pitch error", *value))?;
            }
        }
        for profile in &self.profile {
            length("profile slope", profile.slope_mm)?;
            length("profile crown", profile.crown_mm)?;
            for (amplitude, phase) in &profile.waves {
                length("profile wave", *amplitude)?;
                check_range("profile wave phase", *phase, "rad", (-1e9, 1e9), "reduce it by whole turns")?;
            }
        }
        for damage in &self.damage {
            if damage.tooth >= z1 {
                return Err(GeometryError::NoSuchTooth { tooth: damage.tooth, teeth: z1 });
            }
            check_range("damage depth", damage.depth_mm, "mm", (0.0, limit), "material can only be missing")?;
            check_range("damage width", damage.width, "pitches", (1e-6, 4.0), "a tooth is in contact for about two")?;
        }
        Ok(())
    }

    /// Lead of a tooth pair that does not change along the flank, mm.
    pub(super) fn pitch_lead_mm(&self, tooth: i64, direction: Direction) -> f64 {
        let side = direction.index();
        let of = |table: &[f64]| match table.len() {
            0 => 0.0,
            teeth => table[tooth.rem_euclid(teeth as i64) as usize],
        };
        of(&self.driver_pitch_mm[side]) + of(&self.driven_pitch_mm[side])
    }

    /// Smallest and largest lead that any two teeth's pitch errors can make, mm.
    pub(super) fn pitch_lead_range_mm(&self, direction: Direction) -> (f64, f64) {
        let side = direction.index();
        let tables = [&self.driver_pitch_mm[side], &self.driven_pitch_mm[side]];
        tables.into_iter().filter(|table| !table.is_empty()).fold((0.0, 0.0), |(low, high), table| {
            let (least, most) = table
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), lead| (lead.min(least), lead.max(most)));
            (low + least, high + most)
        })
    }

    /// Whether the lead of any tooth pair changes along the flank.
    pub(super) fn any_shape(&self, direction: Direction) -> bool {
        self.profile[direction.index()] != Profile::default()
            || self.damage.iter().any(|damage| damage.flank == direction)
    }

    /// Whether a tooth pair's lead changes along the flank.
    pub(super) fn has_shape(&self, tooth: i64, teeth: u32, direction: Direction) -> bool {
        self.profile[direction.index()] != Profile::default()
            || self.damage.iter().any(|damage| damage.hits(tooth, teeth, direction))
    }

    /// Lead of a tooth pair that changes along the flank, mm, at the phase u in pitches from the pitch point.
    pub(super) fn shape_lead_mm(&self, tooth: i64, teeth: u32, phase: f64, direction: Direction) -> f64 {
        let profile = &self.profile[direction.index()];
        let lag_sign = -direction.sign();
        let mut lead = profile.slope_mm * phase + lag_sign * profile.crown_mm * 4.0 * phase * phase;
        for (order, (amplitude, shift)) in (1_u32..).zip(&profile.waves) {
            lead += amplitude * (TAU * f64::from(order) * phase - shift).cos();
        }
        for damage in &self.damage {
            if damage.hits(tooth, teeth, direction) && phase.abs() < damage.width {
                let cos = (PI * phase / (2.0 * damage.width)).cos();
                lead += lag_sign * damage.depth_mm * cos * cos;
            }
        }
        lead
    }
}

impl ToothDamage {
    fn hits(&self, tooth: i64, teeth: u32, direction: Direction) -> bool {
        self.flank == direction && tooth.rem_euclid(i64::from(teeth.max(1))) == i64::from(self.tooth)
    }
}
