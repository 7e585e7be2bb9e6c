//! Sums of two named effects that a third could feign, and the other way round.

use super::context::Context;
use super::findings::Finding;
use crate::diagnosis::Verdict;
use crate::posterior::{angle_deg, angle_to_sum_deg};

/// A warning for each such sum.
pub(super) fn warnings(context: &Context<'_>, findings: &[Finding], verdict: &[Verdict]) -> Vec<String> {
    let settings = &context.settings.report;
    let mut warnings = Vec::new();
    if verdict.is_empty() {
        return warnings;
    }
    let width = |block: usize| context.design.blocks[block].width();
    let with_block = |f: &'_ Finding| f.block.map(|block| (f.name(), block));
    let named: Vec<(&str, usize)> =
        findings.iter().filter(|f| f.probability > settings.mimic_probability).filter_map(with_block).collect();
    let others = findings.iter().filter(|f| f.probability < settings.mimic_probability).filter_map(with_block);
    // Where one alone looks like it, or both are one group, the sum says nothing new.
    let near = |m: usize, n: usize| angle_deg(context.design, context.whitened, m, n) < settings.mimic_deg;
    for (target, block) in others.filter(|(_, block)| width(*block) <= settings.mimic_columns) {
        for (n, (a, x)) in named.iter().enumerate() {
            for (b, y) in &named[n + 1..] {
                let (x, y) = (*x, *y);
                if width(x) + width(y) > settings.mimic_sum_columns
                    || near(block, x)
                    || near(block, y)
                    || near(x, y)
                    || warnings.len() >= settings.most_mimics
                {
                    continue;
                }
                if angle_to_sum_deg(context.design, context.whitened, block, x, y) < settings.mimic_deg {
                    warnings.push(format!(
                        "{a} + {b} together can look like {target} under this plan: their sum stands under {} deg from it",
                        settings.mimic_deg
                    ));
                }
            }
        }
    }
    warnings
}
