//! What no effect of the library explains: patterns in the best model, tones, knocks.

use gearmodel::effect::{Carrier, Parity, Signature};

use super::context::Context;
use super::plausibility::least_rad;
use crate::design_matrix::Candidate;
use crate::diagnosis::{Unknown, UnknownLocation};
use crate::nuisance_patterns::Pattern;
use crate::posterior::Posterior;
use crate::transients::Transients;

/// The unknown with its probability, its size and where it lies.
pub(super) fn unknown(context: &Context<'_>, posterior: &Posterior, floor_rad: f64) -> Unknown {
    let settings = &context.settings.report;
    let parts = Parts::of(context);
    let transients = foreign_transients(context);
    let taken_off = context.taken_off;
    let square = parts.unknown_rad2 + (taken_off.tones_rad2() + transients.map_or(0.0, |t| t.mean_square_rad2));
    let rms_rad = square.sqrt();
    let least_rad = least_rad(parts.effects_rad2.max(context.lines_rad2()), context.rings_rad2(), floor_rad, settings);
    if let Some(transients) = transients.filter(|transients| transients.mean_square_rad2.sqrt() > least_rad) {
        let signature = Signature::steady(Carrier::None, Parity::Mixed);
        let location = Some(UnknownLocation { description: describe(transients), signature });
        return Unknown { probability: settings.event_probability, rms_rad, location };
    }
    if let Some(tone) = taken_off.tones.first().filter(|tone| tone.amplitude_rad > least_rad) {
        let location = Some(locate(&Pattern::Tone { frequency_hz: tone.frequency_hz }));
        return Unknown { probability: settings.event_probability, rms_rad, location };
    }
    // Effects are linearised and their shapes lie on grids: a small part of them may stay behind. Scatter wanders too.
    let of_floor = match parts.strongest {
        Some(Pattern::RandomWalk { .. }) => settings.wanders_of_floor,
        Some(Pattern::Step { .. }) => settings.steps_of_floor,
        _ => 0.0,
    };
    let least_rad = least_rad.max(of_floor * floor_rad);
    let inexact = square > 0.0 && rms_rad < least_rad;
    let probability = if inexact { posterior.unknown.min(settings.inexact_probability) } else { posterior.unknown };
    let location = parts.strongest.filter(|_| probability > settings.located).map(locate);
    Unknown { probability: probability.min(1.0), rms_rad, location }
}

/// The best model by what it is made of.
struct Parts<'a> {
    /// Mean square of the patterns, rad².
    unknown_rad2: f64,
    /// Mean square of the effects, rad².
    effects_rad2: f64,
    /// The largest pattern.
    strongest: Option<&'a Pattern>,
}

impl<'a> Parts<'a> {
    fn of(context: &Context<'a>) -> Self {
        let (design, fit) = (context.design, &context.best.fit);
        let mut parts = Self { unknown_rad2: 0.0, effects_rad2: 0.0, strongest: None };
        let mut largest_rad2 = f64::NEG_INFINITY;
        for (n, b) in fit.set.iter().enumerate() {
            let size = fit.rms_rad(design, n).powi(2);
            match &design.blocks[*b].candidate {
                Candidate::Unknown(pattern) => {
                    parts.unknown_rad2 += size;
                    if size > largest_rad2 {
                        largest_rad2 = size;
                        parts.strongest = Some(pattern);
                    }
                }
                Candidate::Effect { .. } => parts.effects_rad2 += size,
            }
        }
        parts
    }
}

/// Knocks that are no resonance's own: one that was found rings whenever anything excites it; faster than the bins show, it cannot be
/// told from knocks.
fn foreign_transients<'a>(context: &Context<'a>) -> Option<&'a Transients> {
    let grid = context.grid;
    let slowest_hz = grid.plan.speeds_rad_per_s.first().map_or(0.0, |speed| speed / std::f64::consts::TAU);
    let shown_hz = 0.5 * grid.bins as f64 * slowest_hz;
    let own = |transients: &&Transients| {
        context
            .rings_hz()
            .any(|(_, hz)| hz > shown_hz || (transients.ring_hz / hz).ln().abs() < context.settings.report.same_ring)
    };
    context.taken_off.transients.as_ref().filter(|transients| !own(transients))
}

fn describe(transients: &Transients) -> String {
    format!(
        "{} knocks or lost readings of up to {:.0} urad, the first at {:.2} s",
        transients.count,
        transients.peak_rad * 1e6,
        transients.first_s
    )
}

fn locate(pattern: &Pattern) -> UnknownLocation {
    UnknownLocation { description: pattern.describe(), signature: pattern.signature() }
}
