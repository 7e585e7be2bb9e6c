//! Sums of two named effects that a third could feign, and the other way round.

use super::context::Context;
use super::findings::Finding;
use crate::diagnosis::Verdict;
use crate::posterior::{angle_deg, angle_to_sum_deg};

/// A sum of two effects nearer than this to a third looks like it, deg.
const MIMIC_DEG: f64 = 4.0;
/// Most warnings of such sums.
const MOST_MIMICS: usize = 5;
/// Probability that parts the effects of a sum from what feigns it.
const PROBABLE: f64 = 0.3;
/// Widest target, and widest sum: what has many columns looks like anything.
const WIDEST_TARGET: usize = 4;
const WIDEST_SUM: usize = 8;

/// A warning for each such sum.
pub(super) fn warnings(context: &Context<'_>, findings: &[Finding], verdict: &[Verdict]) -> Vec<String> {
    let mut warnings = Vec::new();
    if verdict.is_empty() {
        return warnings;
    }
    let width = |block: usize| context.design.blocks[block].width();
    let with_block = |f: &'_ Finding| f.block.map(|block| (f.name(), block));
    let named: Vec<(&str, usize)> =
        findings.iter().filter(|f| f.probability > PROBABLE).filter_map(with_block).collect();
    let others = findings.iter().filter(|f| f.probability < PROBABLE).filter_map(with_block);
    // Where one alone looks like it, or both are one group, the sum says nothing new.
    let near = |m: usize, n: usize| angle_deg(context.design, context.whitened, m, n) < MIMIC_DEG;
    for (target, block) in others.filter(|(_, block)| width(*block) <= WIDEST_TARGET) {
        for (n, (a, x)) in named.iter().enumerate() {
            for (b, y) in &named[n + 1..] {
                let (x, y) = (*x, *y);
                if width(x) + width(y) > WIDEST_SUM
                    || near(block, x)
                    || near(block, y)
                    || near(x, y)
                    || warnings.len() >= MOST_MIMICS
                {
                    continue;
                }
                if angle_to_sum_deg(context.design, context.whitened, block, x, y) < MIMIC_DEG {
                    warnings.push(format!(
                        "{a} + {b} together can look like {target} under this plan: their sum stands under 4 deg from it"
                    ));
                }
            }
        }
    }
    warnings
}
