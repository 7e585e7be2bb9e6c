//! What runs that were left out say: the gap before and after, and how much of it each effect closes alone.

use super::context::Context;
use super::findings::Finding;
use crate::cross_validation::{self, Errors, HeldOut, Selection};
use crate::diagnosis::Gap;
use crate::search::Model;

/// The gap as measured on what was left out.
pub(super) struct Measured {
    pub(super) held_out: HeldOut,
    /// Without any effect, and with the best model.
    pub(super) before: Errors,
    pub(super) after: Errors,
    /// Size of the gap; its budget is still empty.
    pub(super) gap: Gap,
    /// Mean square of what was taken off before the fit, rad².
    pub(super) explained_rad2: f64,
    /// Mean square above the floor, rad².
    pub(super) reducible_rad2: f64,
}

/// Measures the gap with the best model, ready for the blocks of all findings.
pub(super) fn measure(context: &Context<'_>, findings: &[Finding]) -> Measured {
    let Context { grid, design, noise, taken_off, best, .. } = *context;
    let mut columns: Vec<usize> = best.fit.columns.clone();
    columns.extend(findings.iter().filter_map(|f| f.block).flat_map(|b| design.blocks[b].columns.clone()));
    columns.sort_unstable();
    columns.dedup();
    let held_out = HeldOut::new(grid, design, noise, &columns);
    let floor_rad2 = held_out.floor_rad2(grid, noise);
    let before = held_out.errors(&Selection::default());
    let after = held_out.errors(&selection(context, best, None));
    let found = !best.fit.set.is_empty() || !taken_off.is_empty();
    let explained_rad2 = context.lines_rad2() + taken_off.events_rad2();
    // What the place's own samples scatter, less what the lines explain of it.
    let within_rad2 = grid.within_rad2 / grid.samples;
    let gap = cross_validation::gap(
        &before,
        &after,
        floor_rad2,
        within_rad2,
        explained_rad2,
        found,
        context.settings.report.resamples,
    );
    let reducible_rad2 = before.mean() + explained_rad2 - floor_rad2;
    Measured { held_out, before, after, gap, explained_rad2, reducible_rad2 }
}

/// A model's columns, without one of its blocks.
pub(super) fn selection(context: &Context<'_>, model: &Model, left_out: Option<usize>) -> Selection {
    let mut selection = Selection::default();
    for (n, (block, scale)) in model.fit.set.iter().zip(&model.fit.scales_rad).enumerate() {
        if Some(n) != left_out {
            let columns = context.design.blocks[*block].columns.clone();
            selection.prior_rad2.extend(columns.clone().map(|_| scale * scale / columns.len() as f64));
            selection.columns.extend(columns);
        }
    }
    selection
}

/// The findings with the share of the reducible gap that each closes alone.
pub(super) fn with_shrink(context: &Context<'_>, measured: &Measured, mut findings: Vec<Finding>) -> Vec<Finding> {
    let reducible = measured.reducible_rad2;
    for finding in &mut findings {
        finding.shrink = match finding.block {
            Some(block) if reducible > 0.0 => {
                let block = &context.design.blocks[block];
                let d = block.width() as f64;
                let scale = finding.rms_rad.max(context.settings.evidence.smallest_scale_rad);
                let alone = measured.held_out.errors(&Selection {
                    columns: block.columns.clone().collect(),
                    prior_rad2: vec![scale * scale / d; d as usize],
                });
                Some((measured.before.mean() - alone.mean()) / reducible)
            }
            None if finding.probability > context.settings.report.named && reducible > 0.0 => {
                Some(measured.explained_rad2 / reducible)
            }
            _ => None,
        };
    }
    findings
}
