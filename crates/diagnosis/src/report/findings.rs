//! What is known of every effect: its probability, its amplitudes as if it were the one, and who cannot be told from it.

use gearmodel::effect::{Estimate, LIBRARY, Shape};
use nalgebra::DMatrix;

use super::context::Context;
use crate::design_matrix::Candidate;
use crate::evidence;
use crate::line_errors;
use crate::posterior::{Posterior, angle_deg, confusable};
use crate::search::{Model, Search};

/// What is known of one effect.
pub(super) struct Finding {
    /// Place in the library.
    pub(super) number: usize,
    pub(super) probability: f64,
    /// Its best block; `None` of what is found on the samples.
    pub(super) block: Option<usize>,
    pub(super) estimate: Option<Estimate>,
    pub(super) shape: Shape,
    pub(super) rms_rad: f64,
    /// Share of the reducible gap that it closes alone.
    pub(super) shrink: Option<f64>,
    /// Effects that cannot be told from it, with the angle to them, deg.
    pub(super) confusable: Vec<(usize, f64)>,
    /// Most that its probability may be, whatever the evidence.
    pub(super) most: f64,
}

impl Finding {
    /// Its effect's name.
    pub(super) fn name(&self) -> &'static str {
        LIBRARY[self.number].name()
    }
}

/// Every effect that this rig and this plan could show.
pub(super) fn findings(context: &Context<'_>, posterior: &Posterior, search: &mut Search<'_>) -> Vec<Finding> {
    let empty = search.model(Vec::new(), None);
    LIBRARY
        .iter()
        .enumerate()
        .filter_map(|(number, effect)| match line_errors::encoder_of(*effect) {
            Some(encoder) => Some(line_finding(context, number, encoder)),
            None => finding(context, posterior, search, empty.as_ref(), number),
        })
        .collect()
}

/// An effect with its best block; `None` where it has none.
fn finding(
    context: &Context<'_>,
    posterior: &Posterior,
    search: &mut Search<'_>,
    empty: Option<&Model>,
    number: usize,
) -> Option<Finding> {
    let settings = &context.settings.report;
    let (design, whitened, best) = (context.design, context.whitened, context.best);
    let own: Vec<usize> = (0..design.blocks.len())
        .filter(|b| matches!(&design.blocks[*b].candidate, Candidate::Effect { number: n, .. } if *n == number))
        .collect();
    let block = posterior.block[number].or_else(|| {
        // Never part of a good model: the shape that fits best alone.
        let gains = evidence::scan(design, whitened, &empty?.fit, &own);
        own.iter().zip(gains).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(b, _)| *b)
    })?;
    // The block of the best model that this one would stand in for: itself, or one with the same trace.
    let set = || best.fit.set.iter().copied();
    let stands_for = set()
        .find(|b| *b == block)
        .or_else(|| set().find(|b| angle_deg(design, whitened, *b, block) < settings.same_deg));
    let in_best = stands_for == Some(block);
    let mut model_with = |out: Option<usize>, b: usize| {
        let mut set: Vec<usize> = set().filter(|x| Some(*x) != out).collect();
        set.push(b);
        search.model(set, Some(&best.fit))
    };
    let reference =
        if in_best { Some(best.score) } else { stands_for.and_then(|b| model_with(Some(b), block)).map(|m| m.score) };
    let confusable = match reference.filter(|_| posterior.probability[number] > settings.compared) {
        Some(reference) => confusable(
            design,
            whitened,
            posterior,
            number,
            &mut |b| model_with(stands_for, b).map(|m| m.score),
            reference.max(best.score - settings.reference_nats),
            settings,
        ),
        None => Vec::new(),
    };
    // Amplitudes: in the best model, in place of one with its trace or of another shape there, or beside it.
    let other_shape = set().find(|b| own.contains(b));
    let model = if in_best { Some(best.clone()) } else { model_with(other_shape.or(stands_for), block) };
    let estimate = model.as_ref().and_then(|m| {
        let n = m.fit.set.iter().position(|b| *b == block)?;
        Some((context.estimate(m, n), m.fit.rms_rad(design, n)))
    });
    let shape = match &design.blocks[block].candidate {
        Candidate::Effect { shape, .. } => shape.clone(),
        Candidate::Unknown(_) => Shape::new(),
    };
    Some(Finding {
        number,
        probability: posterior.probability[number].min(1.0),
        block: Some(block),
        rms_rad: estimate.as_ref().map_or(0.0, |(_, rms)| *rms),
        estimate: estimate.map(|(e, _)| e),
        shape,
        shrink: None,
        confusable,
        most: 1.0,
    })
}

/// The errors within an encoder's line, which were found on the samples.
fn line_finding(context: &Context<'_>, number: usize, encoder: usize) -> Finding {
    let own = || context.taken_off.lines.iter().filter(|l| l.encoder == encoder);
    let strongest = own().max_by(|a, b| a.log_bayes_factor.total_cmp(&b.log_bayes_factor));
    let odds = strongest.map_or(f64::NEG_INFINITY, |l| l.log_bayes_factor + context.settings.search.effect_odds.ln());
    let rms_rad = own().map(|l| l.explained_rad2 / context.grid.samples).sum::<f64>().max(0.0).sqrt();
    Finding {
        number,
        probability: 1.0 / (1.0 + (-odds).exp()),
        block: None,
        estimate: strongest.map(|l| Estimate {
            beta: l.amplitudes.to_vec(),
            covariance: DMatrix::from_column_slice(2, 2, l.covariance.as_slice()),
        }),
        shape: strongest.and_then(|l| Some(vec![l.order as f64, context.rig.lines[encoder]?])).unwrap_or_default(),
        rms_rad,
        shrink: None,
        confusable: Vec::new(),
        most: 1.0,
    }
}
