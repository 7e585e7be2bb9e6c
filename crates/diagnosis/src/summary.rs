//! The summary for the terminal.

pub mod quantity;
pub mod words;

use std::fmt::Write as _;

use super::diagnosis::{Diagnosis, EffectFinding, Verdict};
use quantity::{percent, probability, urad};

/// Probability above which an effect outside the verdict is mentioned.
const MENTIONED: f64 = 0.03;

/// The summary as text.
#[must_use]
pub fn text(diagnosis: &Diagnosis) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "gap   {}", gap(diagnosis));
    if diagnosis.verdict.is_empty() {
        let _ = writeln!(out, "where {}", unexplained(diagnosis));
    } else {
        let _ = writeln!(out, "where {}", words::location(diagnosis));
    }
    for item in words::ranked(diagnosis) {
        why(&mut out, diagnosis, item);
    }
    let _ = writeln!(out, "also  {}", also(diagnosis));
    for experiment in &diagnosis.next {
        let _ = writeln!(
            out,
            "next  {} ({:.0} min): p >= {:.2} expected",
            experiment.action,
            experiment.minutes.max(1.0),
            experiment.expected_probability
        );
    }
    for warning in &diagnosis.warnings {
        let _ = writeln!(out, "note  {warning}");
    }
    out
}

fn gap(diagnosis: &Diagnosis) -> String {
    let gap = &diagnosis.gap;
    let mut line = format!(
        "{} urad rms  ->  {} urad rms   (floor {})",
        urad(gap.before_rad),
        urad(gap.after_rad),
        urad(gap.floor_rad)
    );
    if let Some(closed) = gap.closed {
        let _ = write!(line, "   {} of the reducible gap closed", percent(closed));
        if let Some([low, high]) = gap.closed_interval {
            let _ = write!(line, " [{:.1}, {:.1}]", 100.0 * low, 100.0 * high);
        }
        line.push_str(", on held-out runs");
    }
    line
}

/// What to say where nothing is named.
#[must_use]
pub fn unexplained(diagnosis: &Diagnosis) -> &'static str {
    let gap = &diagnosis.gap;
    if gap.before_rad <= 1.15 * gap.floor_rad {
        "nothing stands out of what repeats: the nominal model suffices"
    } else {
        "a gap is there, but no cause is sure enough to be named"
    }
}

fn why(out: &mut String, diagnosis: &Diagnosis, item: &Verdict) {
    let words = words::item(item);
    let effect = |name: &String| diagnosis.effects.iter().find(|e| e.name == *name);
    match item {
        Verdict::Name(name) if name == "unknown" => {
            let unknown = &diagnosis.unknown;
            let place = unknown.location.as_ref().map_or("no pattern of its own", |l| l.description.as_str());
            let _ = writeln!(
                out,
                "why   {words}   p {}   {} urad rms: {place}",
                probability(unknown.probability),
                urad(unknown.rms_rad)
            );
        }
        Verdict::Name(name) => {
            if let Some(effect) = effect(name) {
                let _ = writeln!(out, "why   {words}   p {}{}", probability(effect.probability), closes(effect.shrink));
                let _ = writeln!(out, "        {}   {}", effect.name, parameters(effect));
            }
        }
        Verdict::Group { members, .. } => {
            let shrink = members.iter().filter_map(effect).filter_map(|e| e.shrink).reduce(f64::max);
            let _ = writeln!(
                out,
                "why   {words}   p {}{}      ({})",
                probability(group_probability(diagnosis, members)),
                closes(shrink),
                words::same_trace(members, is_elliptic(diagnosis))
            );
            for effect in diagnosis.effects.iter().filter(|e| members.contains(&e.name)) {
                let _ = writeln!(out, "        if {}   {}", effect.name, parameters(effect));
            }
        }
    }
}

/// Probability that one of a group is there.
#[must_use]
pub fn group_probability(diagnosis: &Diagnosis, members: &[String]) -> f64 {
    diagnosis.groups.iter().find(|g| g.members == *members).map_or(0.0, |g| g.probability)
}

/// True where the pair is elliptic: then first orders of both shafts leave one trace.
#[must_use]
pub fn is_elliptic(diagnosis: &Diagnosis) -> bool {
    diagnosis.found.rig.as_ref().is_some_and(|rig| rig.eccentricity().is_some_and(|k| k > 0.0))
}

/// Names that the verdict holds, members of groups included.
#[must_use]
pub fn named(diagnosis: &Diagnosis) -> Vec<&str> {
    let names = |item: &'_ Verdict| match item {
        Verdict::Name(name) => vec![name.clone()],
        Verdict::Group { members, .. } => members.clone(),
    };
    let names: Vec<String> = diagnosis.verdict.iter().flat_map(names).collect();
    diagnosis.effects.iter().map(|e| e.name.as_str()).filter(|n| names.iter().any(|m| m == n)).collect()
}

fn also(diagnosis: &Diagnosis) -> String {
    let named = named(diagnosis);
    let mut others: Vec<String> = Vec::new();
    let grouped = |name: &str| diagnosis.groups.iter().find(|g| g.members.iter().any(|m| m == name));
    let mut told: Vec<&[String]> = Vec::new();
    for effect in diagnosis.effects.iter().filter(|e| e.probability > MENTIONED && !named.contains(&e.name.as_str())) {
        match grouped(&effect.name) {
            Some(group) if told.contains(&group.members.as_slice()) => {}
            Some(group) => {
                told.push(&group.members);
                others.push(format!("{} p {}", words::group(&group.members), probability(group.probability)));
            }
            None => others.push(format!("{} p {}", words::plain(&effect.name), probability(effect.probability))),
        }
    }
    let others = if others.is_empty() {
        format!("nothing{} above p = {MENTIONED}", if named.is_empty() { "" } else { " else" })
    } else {
        others.join("; ")
    };
    let unknown = diagnosis.verdict.iter().any(|v| matches!(v, Verdict::Name(name) if name == "unknown"));
    if unknown { others } else { format!("{others}; unknown remainder p = {:.2}", diagnosis.unknown.probability) }
}

fn closes(shrink: Option<f64>) -> String {
    match shrink {
        None => String::new(),
        Some(shrink) if shrink < 0.005 => "   closes next to nothing".to_owned(),
        Some(shrink) => format!("   closes {}", percent(shrink)),
    }
}

/// Parameters with their standard deviations, one after the other.
#[must_use]
pub fn parameters(effect: &EffectFinding) -> String {
    effect.parameters.iter().map(|(name, entry)| quantity::parameter(name, entry)).collect::<Vec<_>>().join(", ")
}
