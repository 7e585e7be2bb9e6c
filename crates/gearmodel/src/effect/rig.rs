//! The rig as documented: what effects are linearised about.

use std::f64::consts::TAU;

use super::Station;
use crate::contact::ContactModel;
use crate::increment::common_normal;
use crate::pitch_curve::AnyCurve;
use crate::{Direction, Errors, GearPair, NominalModel};

/// Angles a turn at which the teeth in contact are tabulated.
const ZONE_STEPS: usize = 2880;

/// A nominal model and what was noted about its encoders.
#[derive(Clone, Debug)]
pub struct Rig {
    model: NominalModel,
    /// Lines of the input and of the output encoder, where known.
    pub lines: [Option<f64>; 2],
    /// Counts a revolution of the output encoder, where known or seen in the data.
    pub output_counts_per_rev: Option<f64>,
    /// Driver teeth in contact over one turn, by sense: up to three, ending with none.
    zone: [Vec<[Option<u16>; 3]>; 2],
    /// Share of the rolled arc on which one pair alone carries, by sense.
    duty: [f64; 2],
    pitch_mm: f64,
}

impl Rig {
    /// A rig of a nominal model.
    #[must_use]
    pub fn new(model: NominalModel, lines: [Option<f64>; 2], output_counts_per_rev: Option<f64>) -> Self {
        let zone = zones(&model.pair);
        let pitch_mm = model.pair.pitch_mm().unwrap_or(f64::NAN);
        // Weighted by the rolled arc, so that a pitch counts as a pitch wherever it lies.
        let duty = [0, 1].map(|side: usize| {
            let steps = zone[side].len().max(1);
            let (mut single, mut all) = (0.0, 0.0);
            for (step, entry) in zone[side].iter().enumerate() {
                let at = model.pair.at(TAU * (step as f64 + 0.5) / steps as f64);
                let arc = at.r1_mm / at.mu_rad.cos();
                all += arc;
                if entry.iter().flatten().count() < 2 {
                    single += arc;
                }
            }
            if all > 0.0 { single / all } else { 0.0 }
        });
        Self { model, lines, output_counts_per_rev, zone, duty, pitch_mm }
    }

    /// The pair.
    #[must_use]
    pub fn pair(&self) -> &GearPair {
        &self.model.pair
    }

    /// The nominal model.
    #[must_use]
    pub fn model(&self) -> &NominalModel {
        &self.model
    }

    /// k of an elliptic pair.
    #[must_use]
    pub fn eccentricity(&self) -> Option<f64> {
        match self.pair().pitch_curve() {
            AnyCurve::Ellipse(ellipse) => Some(ellipse.eccentricity()),
            _ => None,
        }
    }

    /// Fills in what follows from angle and sense.
    #[must_use]
    pub fn station(&self, theta1_rad: f64, theta2_rad: f64, direction: Direction) -> Station {
        let at = self.pair().at(theta1_rad);
        let sense = direction.sign();
        let pressure_rad = common_normal::effective_pressure_angle_rad(self.pair(), &at, direction);
        let pitches = if self.pair().has_teeth() {
            let half = if direction == Direction::Ccw { 0.0 } else { 0.5 };
            self.pair().arc_length_mm(theta1_rad) / self.pitch_mm - half
        } else {
            0.0
        };
        Station {
            theta1_rad,
            theta2_rad,
            sense,
            ratio: at.ratio,
            r2_mm: at.r2_mm,
            pressure_rad,
            arm_mm: at.r2_mm * pressure_rad.cos(),
            pitches,
            ..Station::default()
        }
    }

    /// Driver teeth in nominal contact.
    pub fn teeth_in_contact(&self, at: &Station) -> impl Iterator<Item = usize> + '_ {
        let side = usize::from(at.sense < 0.0);
        let step = ((at.theta1_rad / TAU).rem_euclid(1.0) * ZONE_STEPS as f64) as usize;
        let entry = self.zone[side].get(step.min(ZONE_STEPS - 1)).copied().unwrap_or_default();
        entry.into_iter().flatten().map(usize::from)
    }

    /// Whether one pair alone carries there, 0 or 1.
    #[must_use]
    pub fn single_pair_share(&self, at: &Station) -> f64 {
        f64::from(u8::from(self.teeth_in_contact(at).count() < 2))
    }

    /// Share of the pitch about a station on which one pair alone carries: its mean over the turn of the driver's sense.
    #[must_use]
    pub fn single_pair_duty(&self, at: &Station) -> f64 {
        self.duty[usize::from(at.sense < 0.0)]
    }

    /// The same, both senses together.
    #[must_use]
    pub fn mean_single_pair_duty(&self) -> f64 {
        0.5 * (self.duty[0] + self.duty[1])
    }

    /// Compliance of the whole train at the driven encoder, rad/(N·m): C_out + C_in i² + C_mesh/A²; 1 rad/(N·m) at the output
    /// where none is documented.
    #[must_use]
    pub fn train_compliance_rad_per_nm(&self, at: &Station) -> f64 {
        let Errors {
            shaft_compliance_output_rad_per_nm: output,
            shaft_compliance_input_rad_per_nm: input,
            mesh_compliance_mm2_rad_per_nm: mesh,
            ..
        } = self.model.errors;
        if output == 0.0 && input == 0.0 && mesh == 0.0 {
            return 1.0;
        }
        output + input * at.ratio * at.ratio + mesh / (at.arm_mm * at.arm_mm)
    }
}

fn zones(pair: &GearPair) -> [Vec<[Option<u16>; 3]>; 2] {
    let Ok(contact) = ContactModel::new(pair.clone(), &Errors::default()) else { return [Vec::new(), Vec::new()] };
    let teeth = i64::from(pair.teeth().0.max(1));
    Direction::BOTH.map(|direction| {
        (0..ZONE_STEPS)
            .map(|step| {
                let theta1_rad = TAU * (step as f64 + 0.5) / ZONE_STEPS as f64;
                let mut entry = [None; 3];
                let mut filled = 0;
                // Angles without contact stay without teeth: the columns are zero there.
                let _ = contact.for_each_pair(theta1_rad, direction, |touch| {
                    if filled < entry.len() {
                        entry[filled] = u16::try_from(touch.tooth.rem_euclid(teeth)).ok();
                        filled += 1;
                    }
                });
                entry
            })
            .collect()
    })
}
