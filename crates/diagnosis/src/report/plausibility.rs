//! What is too small to be told from the inexactness of what was found, or does not predict, is not claimed.

use gearmodel::effect::LIBRARY;

use super::context::Context;
use super::findings::Finding;
use super::held_out::{Measured, selection};
use crate::design_matrix::Candidate;
use crate::settings::ReportSettings;

/// Smallest RMS worth naming beside what was found and what does not repeat.
pub(super) fn least_rad(found_rad2: f64, rings_rad2: f64, floor_rad: f64, settings: &ReportSettings) -> f64 {
    let part = (settings.inexact * found_rad2.sqrt()).max(settings.inexact_ringing * rings_rad2.sqrt());
    part.max(settings.inexact_of_floor * floor_rad)
}

/// The findings, none more probable than its size and its predictions allow.
pub(super) fn limited(context: &Context<'_>, measured: &Measured, mut findings: Vec<Finding>) -> Vec<Finding> {
    let settings = &context.settings.report;
    let (design, best) = (context.design, context.best);
    let total_rad2 = findings
        .iter()
        .filter(|f| f.probability > settings.named && f.block.is_some_and(|b| best.fit.set.contains(&b)))
        .map(|f| f.rms_rad * f.rms_rad)
        .sum::<f64>();
    // What is too small to matter beside what was found, or beside what does not repeat.
    let unknown_rad2: f64 = (0..best.fit.set.len())
        .filter(|n| matches!(design.blocks[best.fit.set[*n]].candidate, Candidate::Unknown(_)))
        .map(|n| best.fit.rms_rad(design, n).powi(2))
        .sum();
    let found_rad2 = total_rad2 + unknown_rad2 + measured.explained_rad2;
    let least_rad = least_rad(found_rad2, context.rings_rad2(), measured.gap.floor_rad, settings);
    let left: Vec<(&[&str], f64)> = findings
        .iter()
        .filter(|f| f.probability > settings.named)
        .map(|f| (LIBRARY[f.number].leaves(), f.rms_rad))
        .map(|((names, part), rms_rad)| (names, part * rms_rad))
        .collect();
    for finding in &mut findings {
        let name = finding.name();
        let left_rad = left.iter().filter(|(names, _)| names.contains(&name)).map(|(_, rad)| *rad);
        let least_rad = left_rad.fold(least_rad, f64::max);
        if finding.rms_rad < least_rad {
            finding.most = settings.inexact_probability;
        } else if LIBRARY[finding.number].steps() && !predicts(context, measured, finding) {
            finding.most = settings.unpredictive_probability;
        }
        finding.probability = finding.probability.min(finding.most);
    }
    findings
}

/// Steps stand where this data wants them: that says little unless they hold for the runs that are left out.
fn predicts(context: &Context<'_>, measured: &Measured, finding: &Finding) -> bool {
    let left_out = context.best.fit.set.iter().position(|b| finding.block == Some(*b));
    let without = left_out.map(|n| measured.held_out.errors(&selection(context, context.best, Some(n))).mean());
    without.is_none_or(|without| without > measured.after.mean())
}
