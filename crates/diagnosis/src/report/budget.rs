//! Shares of the reducible gap: each effect's part of the whole fitted trace.

use super::context::Context;
use crate::design_matrix::Candidate;
use crate::diagnosis::BudgetRow;
use crate::{evidence, line_errors};

/// Standard deviations on either side of a 90 % interval.
const NINETY: f64 = 1.645;

/// The rows, largest first, and what is left.
pub(super) fn budget(context: &Context<'_>, reducible_rad2: f64) -> Vec<BudgetRow> {
    if reducible_rad2 <= 0.0 {
        return Vec::new();
    }
    let mut rows = of_best(context, reducible_rad2);
    let mut explained: f64 = 0.0;
    for row in &rows {
        explained += row.share;
    }
    for line in &context.taken_off.lines {
        let Some(effect) = line_errors::effect_of(line.encoder) else { continue };
        let share = line.explained_rad2 / context.grid.samples / reducible_rad2;
        explained += share;
        match rows.iter_mut().find(|row| row.effect == effect.name()) {
            Some(row) => row.share += share,
            None => rows.push(BudgetRow { effect: effect.name().to_owned(), share, interval: None }),
        }
    }
    rows.sort_by(|a, b| b.share.total_cmp(&a.share));
    rows.push(BudgetRow { effect: "unexplained".to_owned(), share: 1.0 - explained, interval: None });
    rows
}

/// Rows of the best model's blocks.
fn of_best(context: &Context<'_>, reducible_rad2: f64) -> Vec<BudgetRow> {
    let (design, fit) = (context.design, &context.best.fit);
    let columns = &fit.columns;
    let covariance = |m: usize| -> f64 {
        (1..columns.len()).map(|n| fit.mean[m] * fit.mean[n] * design.covariance(columns[m], columns[n])).sum::<f64>()
    };
    let of_amplitudes = evidence::covariance(design, context.whitened, fit);
    let row = |(n, b): (usize, &usize)| {
        let place = fit.place(design, n);
        let share = place.clone().map(covariance).sum::<f64>() / reducible_rad2;
        let deviation =
            place.map(|m| of_amplitudes[(m, m)]).sum::<f64>().sqrt() * 2.0 * (share.abs() / reducible_rad2).sqrt();
        let effect = match &design.blocks[*b].candidate {
            Candidate::Effect { effect, .. } => effect.name().to_owned(),
            Candidate::Unknown(pattern) => format!("unknown: {}", pattern.describe()),
        };
        BudgetRow { effect, share, interval: Some([share - NINETY * deviation, share + NINETY * deviation]) }
    };
    fit.set.iter().enumerate().map(row).collect()
}
