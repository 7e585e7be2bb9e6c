//! Who looks like whom: angles between the subspaces of the effects that matter here.

use super::context::Context;
use super::findings::Finding;
use crate::diagnosis::Confusability;
use crate::posterior::angle_deg;

/// Most effects of the table: what can be read.
const MOST: usize = 16;

/// Those that matter first: in the model or probable; then the rest up to a readable table.
pub(super) fn confusability(context: &Context<'_>, findings: &[Finding]) -> Confusability {
    let set = &context.best.fit.set;
    let mut chosen: Vec<&Finding> = findings.iter().filter(|f| f.block.is_some()).collect();
    chosen.sort_by_key(|f| !f.block.is_some_and(|b| set.contains(&b)));
    chosen.truncate(MOST);
    let angle = |a: &Finding, b: &Finding| match (a.block, b.block) {
        (Some(a), Some(b)) if a != b => angle_deg(context.design, context.whitened, a, b),
        _ => 0.0,
    };
    Confusability {
        names: chosen.iter().map(|f| f.name().to_owned()).collect(),
        angle_deg: chosen.iter().map(|a| chosen.iter().map(|b| angle(a, b)).collect()).collect(),
    }
}
