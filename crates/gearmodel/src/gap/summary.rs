//! The summary for the terminal.

use std::fmt::Write as _;

use super::diagnosis::{Diagnosis, EffectFinding, Verdict};
use crate::effect::{Accumulates, Carrier, Parity, Signature};

const URAD: f64 = 1e6;

/// The summary as text.
#[must_use]
pub fn text(diagnosis: &Diagnosis) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let gap = &diagnosis.gap;
    let _ = write!(
        out,
        "gap   {:.1} urad rms  ->  {:.1} urad rms   (floor {:.1})",
        URAD * gap.before_rad,
        URAD * gap.after_rad,
        URAD * gap.floor_rad
    );
    if let (Some(closed), Some([low, high])) = (gap.closed, gap.closed_interval) {
        let _ = write!(
            out,
            "   {:.1} % of the reducible gap closed [{:.1}, {:.1}], on held-out runs",
            100.0 * closed,
            100.0 * low,
            100.0 * high
        );
    }
    let _ = writeln!(out);
    if diagnosis.verdict.is_empty() {
        let _ = writeln!(out, "where nothing stands out of what repeats: the nominal model suffices");
    } else {
        let _ = writeln!(out, "where {}", in_words(&diagnosis.location.signature));
    }
    for item in &diagnosis.verdict {
        match item {
            Verdict::Name(name) if name == "unknown" => {
                let unknown = &diagnosis.unknown;
                let place = unknown.location.as_ref().map_or("no pattern of its own", |l| l.description.as_str());
                let _ = writeln!(
                    out,
                    "why   something outside the library   p = {:.3}   {:.1} urad rms: {place}",
                    unknown.probability,
                    URAD * unknown.rms_rad
                );
            }
            Verdict::Name(name) => {
                if let Some(effect) = diagnosis.effects.iter().find(|e| e.name == *name) {
                    let _ = writeln!(
                        out,
                        "why   {name} ({})   p = {:.3}{}",
                        effect.component,
                        effect.probability,
                        closes(effect)
                    );
                    let _ = writeln!(out, "        {}", parameters(effect));
                }
            }
            Verdict::Group { members, .. } => {
                let probability =
                    diagnosis.groups.iter().find(|g| g.members == *members).map_or(0.0, |g| g.probability);
                let shrink =
                    diagnosis.effects.iter().find(|e| members.contains(&e.name)).map(closes).unwrap_or_default();
                let _ = writeln!(
                    out,
                    "why   {}   p = {probability:.3}{shrink}   (this data cannot tell which: same trace)",
                    members.join(" or ")
                );
                for effect in diagnosis.effects.iter().filter(|e| members.contains(&e.name)) {
                    let _ = writeln!(out, "        if {}   {}", effect.name, parameters(effect));
                }
            }
        }
    }
    let named: Vec<&String> = diagnosis
        .verdict
        .iter()
        .flat_map(|item| match item {
            Verdict::Name(name) => vec![name],
            Verdict::Group { members, .. } => members.iter().collect(),
        })
        .collect();
    let others: Vec<String> = diagnosis
        .effects
        .iter()
        .filter(|e| e.probability > 0.03 && !named.contains(&&e.name))
        .map(|e| format!("{} p = {:.2}", e.name, e.probability))
        .collect();
    let others = if others.is_empty() { "nothing else above p = 0.03".to_owned() } else { others.join(", ") };
    let _ = writeln!(out, "also  {others}; unknown remainder p = {:.2}", diagnosis.unknown.probability);
    for experiment in &diagnosis.next {
        let _ = writeln!(
            out,
            "next  {} ({:.0} min): p >= {:.2} expected",
            experiment.action, experiment.minutes, experiment.expected_probability
        );
    }
    for warning in &diagnosis.warnings {
        let _ = writeln!(out, "note  {warning}");
    }
    out
}

fn closes(effect: &EffectFinding) -> String {
    effect.shrink.map_or_else(String::new, |shrink| format!("   closes {:.1} %", 100.0 * shrink))
}

fn parameters(effect: &EffectFinding) -> String {
    effect
        .parameters
        .iter()
        .map(|(name, entry)| {
            let unit = entry["unit"].as_str().unwrap_or_default();
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            match (entry["value"].as_f64(), entry["std"].as_f64()) {
                (Some(value), Some(std)) if std > 0.0 => format!("{name} = {value:.4e} +- {std:.1e}{unit}"),
                (Some(value), _) => format!("{name} = {value}{unit}"),
                _ => match entry["value"].as_array() {
                    Some(values) => {
                        let peak =
                            values.iter().filter_map(serde_json::Value::as_f64).fold(0.0_f64, |m, x| m.max(x.abs()));
                        format!("{name}: {} values up to {peak:.2e}{unit}", values.len())
                    }
                    None => format!("{name} = {}", entry["value"].as_str().unwrap_or("?")),
                },
            }
        })
        .collect::<Vec<_>>()
        .join(", ")
}

/// A signature as a sentence.
#[must_use]
pub fn in_words(signature: &Signature) -> String {
    let carrier = match signature.carrier {
        Carrier::Input => "with the driver's angle",
        Carrier::Output => "with the driven shaft's angle",
        Carrier::Mesh => "with the tooth mesh",
        Carrier::EncoderLine => "with an encoder's line period",
        Carrier::Time => "with time",
        Carrier::None => "tied to no angle",
    };
    let parity = match signature.parity {
        Parity::Even => "both senses alike",
        Parity::Odd => "opposite in the two senses",
        Parity::Mixed => "alike and opposite parts",
        Parity::OneFlank => "one flank only",
    };
    let grows = |quantity: &str, exponent: Option<f64>| match exponent {
        None => format!("{quantity} unknown"),
        Some(0.0) => format!("any {quantity}"),
        Some(p) => format!("as {quantity}^{p}"),
    };
    let accumulates = match signature.accumulates {
        Accumulates::No => "not accumulating",
        Accumulates::PerRevolution => "accumulating with every revolution",
        Accumulates::PerTime => "growing with time",
    };
    let sector =
        signature.sector_deg.map_or_else(String::new, |[from, to]| format!(", theta1 from {from:.1} to {to:.1} deg"));
    format!(
        "{carrier}, {parity}, {}, {}, {accumulates}{sector}",
        grows("load", signature.load_exponent),
        grows("speed", signature.speed_exponent)
    )
}
