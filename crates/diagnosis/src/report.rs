//! From the models seen to the fields of the diagnosis: probabilities → what held-out runs say → verdict → unknown → budget.

mod budget;
mod confusability;
mod context;
mod findings;
mod held_out;
mod mimics;
mod parameters;
mod plausibility;
mod unknown;
mod verdict;

use gearmodel::effect::LIBRARY;
use gearmodel::effect::predict::{Found, FoundEffect};

use super::diagnosis::{Diagnosis, EffectFinding, Group, Verdict};
use super::experiment_design;
use super::localisation;
use super::posterior::posterior;
use super::solve::Solution;
use context::Context;
use findings::Finding;
use verdict::Named;

/// The diagnosis that a solution amounts to; `None` where no model could be fitted.
pub(crate) fn report(solution: &Solution<'_>) -> Option<Diagnosis> {
    let context = Context::new(solution)?;
    let posterior = posterior(context.design, &solution.models, context.settings.report.sharpness);
    let findings = findings::findings(&context, &posterior, &mut solution.search());
    let measured = held_out::measure(&context, &findings);
    let findings = held_out::with_shrink(&context, &measured, findings);
    let findings = by_probability(plausibility::limited(&context, &measured, findings));

    let Named { groups, mut verdict, identical } =
        verdict::named(&context, &findings, &solution.models, &posterior.weights);
    let findings = by_probability(verdict::shared_alike(findings, &identical));
    let unknown = unknown::unknown(&context, &posterior, measured.gap.floor_rad);
    if unknown.probability > context.settings.report.named {
        verdict.push(Verdict::Name("unknown".to_owned()));
    }

    let mut gap = measured.gap;
    gap.budget = budget::budget(&context, measured.reducible_rad2);
    let mut warnings = localisation::warnings(context.grid, context.noise, context.settings);
    warnings.extend(mimics::warnings(&context, &findings, &verdict));
    let next = experiment_design::experiments(context.grid, &still_open(&findings, &groups), &unknown, &warnings);
    Some(Diagnosis {
        gap,
        location: localisation::locate(&localisation::Inputs {
            rig: context.rig,
            grid: context.grid,
            design: context.design,
            noise: context.noise,
            best: &context.best.fit,
            lines: &context.taken_off.lines,
        }),
        effects: findings.iter().map(|f| effect_finding(&context, f)).collect(),
        groups,
        unknown,
        next,
        warnings,
        confusability: confusability::confusability(&context, &findings),
        found: found(&context, &findings, &verdict),
        curves: localisation::curves(context.grid, context.design, &context.best.fit),
        verdict,
        settings: *context.settings,
    })
}

/// Most probable first; of equals in the library's order.
fn by_probability(mut findings: Vec<Finding>) -> Vec<Finding> {
    findings.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(a.number.cmp(&b.number)));
    findings
}

/// The effects of the verdict with their amplitudes; of a group its most probable member.
fn found(context: &Context<'_>, findings: &[Finding], verdict: &[Verdict]) -> Found {
    let effects = verdict
        .iter()
        .filter_map(|item| {
            let names: Vec<&str> = match item {
                Verdict::Name(name) => vec![name],
                Verdict::Group { members, .. } => members.iter().map(String::as_str).collect(),
            };
            findings.iter().find(|f| names.contains(&f.name())).and_then(|f| {
                Some(FoundEffect { effect: LIBRARY[f.number], shape: f.shape.clone(), estimate: f.estimate.clone()? })
            })
        })
        .collect();
    Found { rig: Some(context.rig.clone()), effects }
}

/// What further experiments should separate.
fn still_open(findings: &[Finding], groups: &[Group]) -> experiment_design::Open {
    experiment_design::Open {
        groups: groups.iter().filter(|g| g.probability > 0.2).map(|g| g.members.clone()).collect(),
        unsure: findings
            .iter()
            .filter(|f| f.probability > 0.05 && f.probability < 0.95 && f.confusable.is_empty())
            .map(|f| f.name().to_owned())
            .collect(),
    }
}

/// An effect in the words of the contract.
fn effect_finding(context: &Context<'_>, finding: &Finding) -> EffectFinding {
    let effect = LIBRARY[finding.number];
    EffectFinding {
        name: effect.name().to_owned(),
        probability: finding.probability,
        parameters: parameters::parameters(context, finding),
        shrink: finding.shrink.filter(|s| s.is_finite()),
        component: effect.component().to_owned(),
        confused_with: finding.confusable.iter().map(|(n, _)| LIBRARY[*n].name().to_owned()).collect(),
        rms_rad: finding.rms_rad,
    }
}
