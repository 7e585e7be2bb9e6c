//! One answer of the diagnosis against its label.

use serde::Serialize;
use serde_json::Value;

use super::family::Family;
use super::label::{Label, LabelledEffect};
use super::signature;
use rigsim::plant::faults::{self, find};

/// A group counts as an answer only where physics ties its members: under this angle, degrees.
const TIED_UNDER_DEG: f64 = 2.0;
/// Half width of a 90 % interval in standard deviations.
const NINETY_PERCENT: f64 = 1.644_854;
/// Parameters are scored where the effect is at least this probable.
const NAMED_FROM: f64 = 0.5;

/// What the diagnosis would stake its name on.
#[derive(Debug, Clone, PartialEq)]
struct Claim {
    members: Vec<String>,
    tied: bool,
}

impl Claim {
    fn text(&self) -> String {
        self.members.join(" | ")
    }

    fn is(&self, name: &str) -> bool {
        self.tied && self.members.iter().any(|member| member == name)
    }
}

/// One true effect and what came of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrueEffect {
    /// Its name.
    pub name: String,
    /// Its size alone, rad RMS.
    pub rms_rad: f64,
    /// Its size in standard errors of the diagnosis' own estimate.
    pub standard_errors: Option<f64>,
    /// Whether the verdict names it, alone or in a group.
    pub named: bool,
    /// Members of the claim that names it.
    pub group_size: usize,
    /// Its probability, or its group's.
    pub probability: f64,
    /// Parameters with a standard deviation: name, and whether the 90 % interval holds the truth.
    pub covered: Vec<(String, bool)>,
}

/// One case, scored.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseScore {
    /// Number of the case.
    pub case: usize,
    /// Its family.
    pub family: Family,
    /// The effects that it shall name.
    pub truths: Vec<TrueEffect>,
    /// What it must call unknown, if anything.
    pub hidden: Vec<String>,
    /// Claims that name no true effect.
    pub false_names: Vec<String>,
    /// Whether the verdict says unknown.
    pub says_unknown: bool,
    /// The verdict is the truth and nothing else.
    pub exact: bool,
    /// Probabilities with what came true.
    pub events: Vec<(f64, bool)>,
    /// Share of what the effects add that the found effects take away, held out; 1 is an oracle's.
    pub shrink: Option<f64>,
    /// Whether the signature is right, where the effect has a clear one.
    pub signature: Option<bool>,
    /// RMS of all effects together, rad.
    pub rms_rad: f64,
    /// Time for the diagnosis, s.
    pub seconds: f64,
    /// Why there is no answer.
    pub no_answer: Option<String>,
}

impl CaseScore {
    /// A case that the diagnosis did not answer: nothing is named, and nothing is right, not even a null.
    #[must_use]
    pub fn unanswered(label: &Label, reason: String) -> Self {
        Self { exact: false, no_answer: Some(reason), ..score_case(label, &Value::Null, 0.0) }
    }
}

/// Scores an answer (`to_dict()` of the diagnosis). Fields that are missing count as not said.
#[must_use]
pub fn score_case(label: &Label, answer: &Value, seconds: f64) -> CaseScore {
    let (mut claims, says_unknown) = claims(&answer["verdict"]);
    let groups: Vec<(Vec<String>, f64)> = list(&answer["groups"])
        .map(|group| (names(&group["members"]), group["probability"].as_f64().unwrap_or(0.0)))
        .collect();
    let effects: Vec<(&str, &Value)> =
        list(&answer["effects"]).filter_map(|effect| Some((effect["name"].as_str()?, effect))).collect();

    let hidden_here = |effect: &LabelledEffect| effect.outside || label.exclude.contains(&effect.name);
    let (hidden, open): (Vec<_>, Vec<_>) = label.effects.iter().partition(|effect| hidden_here(effect));
    let present = |name: &str| open.iter().any(|effect| effect.name == name);

    let mut truths = Vec::new();
    for effect in &open {
        let claim = claims.iter().position(|claim| claim.is(&effect.name)).map(|n| claims.remove(n));
        let reported = effects.iter().find(|(name, _)| *name == effect.name).map(|(_, value)| *value);
        let alone = reported.and_then(|value| value["probability"].as_f64()).unwrap_or(0.0);
        // A group's probability is that one of its members is present: a true member makes it true.
        let grouped = groups.iter().filter(|(members, _)| members.contains(&effect.name)).map(|(_, p)| *p);
        let probability = grouped.fold(alone, f64::max);
        let parameters = reported.map(|value| &value["parameters"]).unwrap_or(&Value::Null);
        truths.push(TrueEffect {
            name: effect.name.clone(),
            rms_rad: effect.rms_rad,
            standard_errors: standard_errors(effect, parameters),
            named: claim.is_some(),
            group_size: claim.as_ref().map_or(0, |claim| claim.members.len()),
            probability,
            covered: if probability >= NAMED_FROM { covered(effect, parameters) } else { Vec::new() },
        });
    }

    let false_names: Vec<String> = claims.iter().map(Claim::text).collect();
    let exact = truths.iter().all(|truth| truth.named) && false_names.is_empty() && says_unknown != hidden.is_empty();

    let mut events: Vec<(f64, bool)> =
        groups.iter().map(|(members, p)| (*p, members.iter().any(|member| present(member)))).collect();
    for (name, effect) in &effects {
        let in_group = groups.iter().any(|(members, _)| members.iter().any(|member| member == name));
        if let Some(p) = effect["probability"].as_f64().filter(|_| !in_group) {
            events.push((p, present(name)));
        }
    }
    if let Some(p) = answer["unknown"]["probability"].as_f64() {
        events.push((p, !hidden.is_empty()));
    }

    let signature = match label.effects.as_slice() {
        [only] if label.family == Family::Single => signature::right(&only.name, &answer["where"]["signature"]),
        _ => None,
    };
    CaseScore {
        case: label.case,
        family: label.family,
        truths,
        hidden: hidden.iter().map(|effect| effect.name.clone()).collect(),
        false_names,
        says_unknown,
        exact,
        events,
        shrink: shrink(label, &answer["gap"]).filter(|_| hidden.is_empty()),
        signature,
        rms_rad: label.rms_rad,
        seconds,
        no_answer: None,
    }
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn names(value: &Value) -> Vec<String> {
    list(value).filter_map(|name| name.as_str().map(str::to_owned)).collect()
}

/// The verdict's claims, and whether "unknown" is among them.
fn claims(verdict: &Value) -> (Vec<Claim>, bool) {
    let (mut claims, mut says_unknown) = (Vec::new(), false);
    for item in list(verdict) {
        match item.as_str() {
            Some("unknown") => says_unknown = true,
            Some(name) => claims.push(Claim { members: vec![name.to_owned()], tied: true }),
            None => {
                let angle_deg = item["angle_deg"].as_f64().unwrap_or(f64::INFINITY);
                claims.push(Claim { members: names(&item["members"]), tied: angle_deg < TIED_UNDER_DEG });
            }
        }
    }
    (claims, says_unknown)
}

/// (value, standard deviation) of a parameter in the answer.
fn estimate(parameters: &Value, name: &str) -> Option<(f64, f64)> {
    let parameter = &parameters[name];
    let std = parameter["std"].as_f64().filter(|std| *std > 0.0)?;
    Some((parameter["value"].as_f64()?, std))
}

/// The true size in the diagnosis' own standard errors, all amounts of the effect together.
fn standard_errors(effect: &LabelledEffect, parameters: &Value) -> Option<f64> {
    let amounts = find(&effect.name)?.amounts;
    let squares: Vec<f64> = amounts
        .iter()
        .filter_map(|(name, _)| {
            let (_, std) = estimate(parameters, name)?;
            Some((effect.parameters.number(name) / std).powi(2))
        })
        .collect();
    if squares.is_empty() { None } else { Some(squares.iter().sum::<f64>().sqrt()) }
}

/// Which parameters' 90 % intervals hold the truth. Angles are compared around the turn.
fn covered(effect: &LabelledEffect, parameters: &Value) -> Vec<(String, bool)> {
    effect
        .parameters
        .iter()
        .filter_map(|(name, value)| {
            let faults::Value::Number(truth) = value else { return None };
            let (value, std) = estimate(parameters, name)?;
            let mut miss = value - truth;
            if name == "phase_rad" || name.starts_with("ph") && name.ends_with("_rad") && name != "phasing_rad" {
                let turns = (miss / std::f64::consts::TAU).round();
                miss -= turns * std::f64::consts::TAU;
            }
            Some((name.to_owned(), miss.abs() <= NINETY_PERCENT * std))
        })
        .collect()
}

/// (before² − after²) of the diagnosis over what an oracle takes away, the mean square of the effects themselves. Sizes under the
/// reach of one campaign say nothing.
fn shrink(label: &Label, gap: &Value) -> Option<f64> {
    const FROM_RAD: f64 = 1e-5;
    let (before, after) = (gap["before_rad"].as_f64()?, gap["after_rad"].as_f64()?);
    (label.rms_rad >= FROM_RAD).then(|| (before * before - after * after) / (label.rms_rad * label.rms_rad))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use rigsim::plant::faults::Parameters;
    use serde_json::json;

    /// A label with these effects: name, outside, RMS in µrad.
    pub fn label(family: Family, effects: &[(&str, bool, f64)]) -> Label {
        let effects = effects.iter().map(|&(name, outside, rms)| LabelledEffect {
            name: name.into(),
            outside,
            parameters: Parameters::of(&[("eps", 4e-5), ("phase_rad", 0.1), ("dj_mm", 0.02)]),
            rms_rad: rms * 1e-6,
        });
        let effects: Vec<_> = effects.collect();
        let rms_rad = effects.iter().map(|effect| effect.rms_rad.powi(2)).sum::<f64>().sqrt();
        Label {
            seed: 1,
            case: 0,
            family,
            effects,
            rms_rad,
            exclude: Vec::new(),
            white_rad: 1e-5,
            run_out_rad: 1e-6,
            rate_hz: 1000.0,
        }
    }

    /// An answer with this verdict, and probabilities of single effects and of unknown.
    pub fn answer(verdict: Value, effects: &[(&str, f64)], unknown: f64) -> Value {
        let effects: Vec<Value> = effects
            .iter()
            .map(|(name, probability)| {
                json!({"name": name, "probability": probability, "parameters": {
                    "eps": {"value": 4.2e-5, "std": 2e-6, "unit": ""},
                    "phase_rad": {"value": 6.35, "std": 0.05, "unit": "rad"},
                    "dj_mm": {"value": 0.03, "std": 1e-3, "unit": "mm"}}})
            })
            .collect();
        let mut said = json!({"effects": effects, "groups": [], "unknown": {"probability": unknown},
               "gap": {"before_rad": 5e-5, "after_rad": 3e-5, "floor_rad": 3e-5}});
        said["verdict"] = verdict;
        said
    }

    #[test]
    fn the_truth_alone_is_exact_and_more_or_less_is_not() {
        let truth = label(Family::Pair, &[("backlash_error", false, 30.0), ("time_skew", false, 30.0)]);
        let scored = |verdict: Value| score_case(&truth, &answer(verdict, &[], 0.0), 1.0);
        assert!(scored(json!(["time_skew", "backlash_error"])).exact);
        let less = scored(json!(["time_skew"]));
        assert!(!less.exact && less.truths[1].named && !less.truths[0].named && less.false_names.is_empty());
        let more = scored(json!(["time_skew", "backlash_error", "slip"]));
        assert!(!more.exact && more.false_names == ["slip"]);
        assert!(!scored(json!(["time_skew", "backlash_error", "unknown"])).exact);
        assert!(!scored(json!([])).exact);
        assert!(score_case(&label(Family::Null, &[]), &answer(json!([]), &[], 0.0), 1.0).exact);
    }

    #[test]
    fn a_group_counts_where_physics_ties_it_and_for_one_truth_only() {
        let one = label(Family::Single, &[("backlash_error", false, 30.0)]);
        let group = |angle: f64| json!([{"members": ["bearing_clearance", "backlash_error"], "angle_deg": angle}]);
        let tied = score_case(&one, &answer(group(0.3), &[], 0.0), 1.0);
        assert!(tied.exact && tied.truths[0].group_size == 2);
        let loose = score_case(&one, &answer(group(12.0), &[], 0.0), 1.0);
        assert!(!loose.exact && loose.false_names == ["bearing_clearance | backlash_error"]);
        let two = label(Family::Pair, &[("backlash_error", false, 30.0), ("bearing_clearance", false, 30.0)]);
        assert!(!score_case(&two, &answer(group(0.3), &[], 0.0), 1.0).exact);
    }

    #[test]
    fn what_is_outside_or_left_out_must_be_called_unknown() {
        let outside = label(Family::Mixed, &[("backlash_error", false, 30.0), ("knocks", true, 30.0)]);
        assert!(score_case(&outside, &answer(json!(["backlash_error", "unknown"]), &[], 1.0), 1.0).exact);
        assert!(!score_case(&outside, &answer(json!(["backlash_error"]), &[], 0.1), 1.0).exact);
        let mut left_out = label(Family::LeftOut, &[("time_skew", false, 30.0)]);
        left_out.exclude = vec!["time_skew".into()];
        let scored = score_case(&left_out, &answer(json!(["unknown"]), &[], 1.0), 1.0);
        assert!(scored.exact && scored.truths.is_empty() && scored.hidden == ["time_skew"]);
    }

    #[test]
    fn probabilities_become_events_once_and_groups_stand_for_their_members() {
        let truth = label(Family::Single, &[("backlash_error", false, 30.0)]);
        let mut said = answer(json!([]), &[("backlash_error", 0.5), ("bearing_clearance", 0.48), ("slip", 0.1)], 0.02);
        said["groups"] = json!([{"members": ["backlash_error", "bearing_clearance"], "probability": 0.98}]);
        let scored = score_case(&truth, &said, 1.0);
        assert_eq!(scored.events, [(0.98, true), (0.1, false), (0.02, false)]);
        assert_eq!(scored.truths[0].probability, 0.98);
    }

    #[test]
    fn parameters_are_covered_within_ninety_percent_and_angles_around_the_turn() {
        let truth = label(Family::Single, &[("encoder2_eccentricity", false, 30.0)]);
        let scored = score_case(&truth, &answer(json!([]), &[("encoder2_eccentricity", 0.9)], 0.0), 1.0);
        let mut covered = scored.truths[0].covered.clone();
        covered.sort();
        let expected = [("dj_mm", false), ("eps", true), ("phase_rad", true)];
        assert_eq!(covered, expected.map(|(name, right)| (name.to_owned(), right)));
        assert!((scored.truths[0].standard_errors.unwrap() - 20.0).abs() < 1e-9);
        // 5² − 3² = 16 of (30 µrad)² = 9e-10.
        assert!((scored.shrink.unwrap() - 16.0 / 9.0).abs() < 1e-9);
    }

    #[test]
    fn no_answer_is_never_right() {
        let scored = CaseScore::unanswered(&label(Family::Null, &[]), "it refused".into());
        assert!(!scored.exact && scored.false_names.is_empty() && scored.no_answer.is_some());
    }

    #[test]
    fn an_answer_without_fields_is_an_answer_without_content() {
        let scored = score_case(&label(Family::Single, &[("slip", false, 30.0)]), &json!({}), 1.0);
        assert!(!scored.exact && scored.events.is_empty() && scored.shrink.is_none());
    }
}
