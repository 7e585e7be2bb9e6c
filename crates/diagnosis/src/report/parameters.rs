//! Parameters as the contract writes them: names, values, standard deviations and units as JSON.

use gearmodel::effect::{LIBRARY, Parameter, ParameterKind, Value};
use serde_json::{Map, Value as Json, json};

use super::context::Context;
use super::findings::Finding;
use crate::settings::ReportSettings;

/// All parameters of a finding; none where it was not fitted.
pub(super) fn parameters(context: &Context<'_>, finding: &Finding) -> Map<String, Json> {
    let Some(estimate) = &finding.estimate else { return Map::new() };
    let effect = LIBRARY[finding.number];
    let mut found = effect.parameters(context.rig, &finding.shape, estimate);
    let revolutions = context.grid.plan.revolutions.max(f64::MIN_POSITIVE);
    let over_the_campaign = effect.over_a_campaign(&found, revolutions);
    found.extend(over_the_campaign);
    found.iter().map(|parameter| (parameter.name.to_owned(), entry(parameter, &context.settings.report))).collect()
}

fn entry(parameter: &Parameter, settings: &ReportSettings) -> Json {
    let value = match &parameter.value {
        Value::Number(x) => json!(x),
        Value::Table(values) => json!(values),
        Value::Text(text) => json!(text),
    };
    // Traces are linearised and evaluated at bins: what the fit is sure of to less than that, it is not.
    let std = match (&parameter.value, parameter.std) {
        (Value::Number(x), Some(std)) => {
            // A phase has no size of its own.
            let phase = parameter.kind == ParameterKind::Phase;
            let inexact = if phase { settings.linearised } else { settings.linearised * x.abs() };
            Some(if std > 0.0 { (settings.wider * std).hypot(inexact) } else { std })
        }
        (_, std) => std,
    };
    json!({"value": value, "std": std, "unit": parameter.unit})
}
