//! What the nominal model predicts at a sample, exact where teeth are known.

use std::f64::consts::TAU;

use gearmodel::contact::ContactModel;
use gearmodel::effect::predict::Condition;
use gearmodel::effect::{Carrier, NominalRig, Term};
use gearmodel::increment::common_normal;
use gearmodel::{Direction, NominalModel};

/// Angles a turn at which exact contact is tabulated against the first order.
const STEPS: usize = 1440;

/// The nominal model with a table of what exact contact adds to the first order.
#[derive(Clone, Debug)]
pub struct Nominal {
    model: NominalModel,
    rig: NominalRig,
    /// Exact less first-order TE over a turn of the driver, rad, ccw then cw; empty where it cannot be tabulated.
    correction_rad: [Vec<f64>; 2],
}

impl Nominal {
    /// Tabulates exact contact where the driven gear closes with the driver's turn; elsewhere the first order stands. `lines` are
    /// those of the input and of the output encoder, where known.
    #[must_use]
    pub fn new(model: NominalModel, lines: [Option<f64>; 2], output_counts_per_rev: Option<f64>) -> Self {
        let pair = &model.pair;
        let errors = model.errors;
        let closes = (pair.closure() - pair.closure().round()).abs() < 1e-12;
        let displaced = errors.e1_mm != 0.0 || errors.e2_mm != 0.0;
        let exact =
            (closes && displaced && pair.has_teeth()).then(|| ContactModel::new(pair.clone(), &errors).ok()).flatten();
        let correction_rad = Direction::BOTH.map(|direction| {
            let Some(exact) = &exact else { return Vec::new() };
            (0..STEPS)
                .map(|step| {
                    let theta1_rad = TAU * step as f64 / STEPS as f64;
                    let first_order_rad = common_normal::te_rad(pair, &errors, theta1_rad, direction);
                    // Where no pair is within its tips the first order stands.
                    exact.te_rad(theta1_rad, direction).map_or(0.0, |te_rad| te_rad - first_order_rad)
                })
                .collect()
        });
        let rig = model.rig(lines, output_counts_per_rev);
        Self { model, rig, correction_rad }
    }

    /// The nominal model.
    #[must_use]
    pub fn model(&self) -> &NominalModel {
        &self.model
    }

    /// The rig that effects are linearised about.
    #[must_use]
    pub fn rig(&self) -> &NominalRig {
        &self.rig
    }

    /// Notes the encoders' lines.
    pub fn set_lines(&mut self, lines: [Option<f64>; 2]) {
        self.rig.lines = lines;
    }

    /// Nominal TE of pair and errors, without documented effects, rad: those are taken off by [`Nominal::take_off_effects`].
    #[must_use]
    pub fn te_rad(&self, theta1_rad: f64, direction: Direction, load_nm: f64) -> f64 {
        let table = &self.correction_rad[usize::from(direction == Direction::Cw)];
        let correction_rad = if table.is_empty() {
            0.0
        } else {
            let place = (theta1_rad / TAU).rem_euclid(1.0) * STEPS as f64;
            let (low, part) = (place as usize % STEPS, place.fract());
            table[low] + part * (table[(low + 1) % STEPS] - table[low])
        };
        let model = &self.model;
        model.te_at_rad(&model.pair.at(theta1_rad), direction, load_nm) + correction_rad
    }

    /// Nominal TE with its documented effects, rad.
    #[must_use]
    pub fn te_under_rad(&self, theta1_rad: f64, under: &Condition) -> f64 {
        self.te_rad(theta1_rad, under.direction, under.load_nm) + self.model.effects_te_rad(theta1_rad, under)
    }

    /// Documented sub-divisional errors of the encoders, which are taken off sample by sample.
    pub(super) fn line_errors(&self) -> impl Iterator<Item = &Term> {
        self.model.effects.terms().iter().filter(|term| carried_by_line(term))
    }
}

pub(super) fn carried_by_line(term: &Term) -> bool {
    term.effect.signature().carrier == Carrier::EncoderLine
}
