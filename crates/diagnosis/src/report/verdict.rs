//! Groups of effects that this data cannot tell apart, and what is named.

use gearmodel::effect::LIBRARY;

use super::context::Context;
use super::findings::Finding;
use crate::design_matrix::Candidate;
use crate::diagnosis::{Group, Verdict};
use crate::search::Model;

/// What is named, and groups whose members have one and the same trace with the probability that one of them is there.
pub(super) struct Named {
    pub(super) groups: Vec<Group>,
    pub(super) verdict: Vec<Verdict>,
    pub(super) identical: Vec<(Vec<usize>, f64)>,
}

/// Groups and what is named, from findings with the most probable first; `weights` are those of the models.
pub(super) fn named(context: &Context<'_>, findings: &[Finding], models: &[Model], weights: &[f64]) -> Named {
    let settings = &context.settings.report;
    let mut named = Named { groups: Vec::new(), verdict: Vec::new(), identical: Vec::new() };
    let mut done: Vec<usize> = Vec::new();
    for finding in findings {
        // A member of a group that was named before, or one that could only stand in for it.
        if done.contains(&finding.number) || finding.confusable.iter().any(|(n, _)| done.contains(n)) {
            continue;
        }
        let members: Vec<usize> =
            std::iter::once(finding.number).chain(finding.confusable.iter().map(|(n, _)| *n)).collect();
        let probability = if finding.block.is_none() {
            finding.probability
        } else {
            let with_one = models.iter().zip(weights).filter(|(model, _)| holds_one_of(context, model, &members));
            with_one.map(|(_, weight)| weight).sum::<f64>().min(1.0)
        };
        let probability = probability.min(finding.most);
        let in_best = finding.block.is_none() || holds_one_of(context, context.best, &members);
        if members.len() > 1 {
            if probability < settings.compared {
                continue;
            }
            let angle_deg = finding.confusable.iter().map(|(_, a)| *a).fold(0.0, f64::max);
            let names: Vec<String> = members.iter().map(|n| LIBRARY[*n].name().to_owned()).collect();
            if angle_deg < settings.identical_deg {
                named.identical.push((members.clone(), probability));
            }
            named.groups.push(Group { members: names.clone(), angle_deg, probability });
            done.extend(&members);
            if probability > settings.named && in_best {
                named.verdict.push(Verdict::Group { members: names, angle_deg });
            }
        } else if probability > settings.named && in_best {
            done.push(finding.number);
            named.verdict.push(Verdict::Name(finding.name().to_owned()));
        }
    }
    named
}

/// True where a block of one of these effects is in a model.
fn holds_one_of(context: &Context<'_>, model: &Model, members: &[usize]) -> bool {
    let of_one = |b: &usize| matches!(&context.design.blocks[*b].candidate, Candidate::Effect { number, .. } if members.contains(number));
    model.fit.set.iter().any(of_one)
}

/// Which of the same traces the search met first says nothing: they are equally probable.
pub(super) fn shared_alike(mut findings: Vec<Finding>, identical: &[(Vec<usize>, f64)]) -> Vec<Finding> {
    for (members, probability) in identical {
        for finding in findings.iter_mut().filter(|f| members.contains(&f.number)) {
            finding.probability = probability / members.len() as f64;
        }
    }
    findings
}
