//! Plain words for the rig's people: what an effect is called, what to do about it, and what a signature says.

use crate::diagnosis::{Diagnosis, Verdict};
use gearmodel::effect::{Accumulates, Carrier, Parity, SharedTrace, Signature, by_name};

/// An effect in plain words; a name outside the library stays as it is.
#[must_use]
pub fn plain(name: &str) -> &str {
    if name == "unknown" {
        return "something outside the library";
    }
    by_name(name).map_or(name, |effect| effect.words().plain_name)
}

/// What to do about an effect.
#[must_use]
pub fn remedy(name: &str) -> Option<&'static str> {
    by_name(name).map(|effect| effect.words().remedy)
}

/// A group in plain words; two members that differ in the shaft alone are named once.
#[must_use]
pub fn group(members: &[String]) -> String {
    let family = |member: &String| by_name(member).and_then(|effect| effect.words().family);
    let mut words: Vec<&str> = Vec::new();
    for member in members {
        let shared =
            family(member).filter(|own| members.iter().filter(|other| family(other) == Some(*own)).count() > 1);
        match shared {
            Some(shared) if words.contains(&shared) => {}
            Some(shared) => words.push(shared),
            None => words.push(plain(member)),
        }
    }
    words.join(", or ")
}

/// An item of the verdict in plain words.
#[must_use]
pub fn item(verdict: &Verdict) -> String {
    match verdict {
        Verdict::Name(name) if name == "unknown" => "something outside the library".to_owned(),
        Verdict::Name(name) => plain(name).to_owned(),
        Verdict::Group { members, .. } => group(members),
    }
}

/// Why a group's members look alike.
#[must_use]
pub fn same_trace(members: &[String], elliptic: bool) -> &'static str {
    let all = |trace| members.iter().all(|m| by_name(m).is_some_and(|effect| effect.shared_trace() == Some(trace)));
    if elliptic && all(SharedTrace::TurnOfAnEllipse) {
        "one set-up cannot tell which: same trace for an elliptic pair"
    } else if all(SharedTrace::Play) {
        "running cannot tell which: same trace for every pair"
    } else {
        "this data cannot tell which: same trace under this plan"
    }
}

/// A part of the budget in plain words: where the verdict holds a group, its member stands for all of it.
#[must_use]
pub fn within(diagnosis: &Diagnosis, name: &str) -> String {
    let of =
        |verdict: &&Verdict| matches!(verdict, Verdict::Group { members, .. } if members.iter().any(|m| m == name));
    diagnosis.verdict.iter().find(of).map_or_else(|| plain(name).to_owned(), item)
}

/// Share of the reducible gap that an item of the verdict holds; 0 where there is no budget.
#[must_use]
pub fn share(diagnosis: &Diagnosis, verdict: &Verdict) -> f64 {
    let holds = |name: &str| match verdict {
        Verdict::Name(own) if own == "unknown" => name.starts_with("unknown"),
        Verdict::Name(own) => own == name,
        Verdict::Group { members, .. } => members.iter().any(|m| m == name),
    };
    diagnosis.gap.budget.iter().filter(|row| holds(&row.effect)).map(|row| row.share).sum()
}

/// The verdict, what holds most of the gap first: that is what is worth fixing first.
#[must_use]
pub fn ranked(diagnosis: &Diagnosis) -> Vec<&Verdict> {
    let mut items: Vec<&Verdict> = diagnosis.verdict.iter().collect();
    items.sort_by(|a, b| share(diagnosis, b).total_cmp(&share(diagnosis, a)));
    items
}

/// Where the gap lies, as a sentence, and what that points to.
#[must_use]
pub fn location(diagnosis: &Diagnosis) -> String {
    let place = &diagnosis.location;
    let several = if diagnosis.verdict.len() > 1 { "largest part " } else { "" };
    let order = match place.signature.carrier {
        Carrier::Input => leading_order(&place.input_order),
        Carrier::Output => leading_order(&place.output_order),
        _ => None,
    };
    let points = points_to(&place.signature, order).map(|to| format!("     -> {to}")).unwrap_or_default();
    format!("{several}{}, {}{points}", carrier(diagnosis), behaviour(&place.signature))
}

/// Order that stands for most of a list's power, if one does.
fn leading_order(slices: &[crate::diagnosis::Slice]) -> Option<i64> {
    let total: f64 = slices.iter().map(|s| s.rad * s.rad).sum();
    slices.iter().find(|s| s.rad * s.rad > 0.6 * total).and_then(|s| s.at.as_i64())
}

fn carrier(diagnosis: &Diagnosis) -> String {
    let location = &diagnosis.location;
    // With one cause alone the signature is surely its own.
    let name = |shaft: &str| match diagnosis.verdict.first().filter(|_| diagnosis.verdict.len() == 1) {
        Some(Verdict::Group { members, .. })
            if members.iter().any(|m| m.contains('1') || m.ends_with("input"))
                && members.iter().any(|m| m.contains('2') || m.ends_with("output")) =>
        {
            "the shafts".to_owned()
        }
        _ => shaft.to_owned(),
    };
    let turns = |orders, shaft: &str| match leading_order(orders) {
        Some(1) => format!("once a turn of {}", name(shaft)),
        Some(2) => format!("twice a turn of {}", name(shaft)),
        Some(n) => format!("{n} times a turn of {}", name(shaft)),
        None => format!("with the angle of {}", name(shaft)),
    };
    match location.signature.carrier {
        Carrier::Input => turns(&location.input_order, "the driver"),
        Carrier::Output => turns(&location.output_order, "the driven shaft"),
        Carrier::Mesh => "with the tooth mesh".to_owned(),
        Carrier::EncoderLine => "with an encoder's line period".to_owned(),
        Carrier::Time => "with time".to_owned(),
        Carrier::None => "tied to no angle".to_owned(),
    }
}

/// A signature without its carrier.
#[must_use]
pub fn behaviour(signature: &Signature) -> String {
    let parity = match signature.parity {
        Parity::Even => "both senses alike",
        Parity::Odd => "opposite in the two senses",
        Parity::Mixed => "partly alike, partly opposite in the two senses",
        Parity::OneFlank => "one flank only",
    };
    let grows = |quantity: &str, exponent: Option<f64>| match exponent {
        None => format!("{quantity} dependence unknown"),
        Some(0.0) => format!("any {quantity}"),
        Some(p) if (p - 1.0).abs() < 1e-9 => format!("growing with the {quantity}"),
        Some(p) => format!("as {quantity}^{p}"),
    };
    let accumulates = match signature.accumulates {
        Accumulates::No => "not accumulating",
        Accumulates::PerRevolution => "accumulating with every revolution",
        Accumulates::PerTime => "growing with time",
    };
    let sector = signature
        .sector_deg
        .map_or_else(String::new, |[from, to]| format!(", driver angle {from:.0} to {to:.0} deg only"));
    format!(
        "{parity}, {}, {}, {accumulates}{sector}",
        grows("load", signature.load_exponent),
        grows("speed", signature.speed_exponent)
    )
}

/// Where on the rig such a signature points; `None` where it does not by itself.
fn points_to(signature: &Signature, order: Option<i64>) -> Option<&'static str> {
    let any = |exponent: Option<f64>| exponent == Some(0.0);
    let grows = |exponent: Option<f64>| exponent.is_some_and(|p| p > 0.0);
    let (load, speed) = (signature.load_exponent, signature.speed_exponent);
    match (signature.accumulates, signature.carrier, signature.parity) {
        // Heat opens the centre distance: the senses part. What takes both alike is no matter of the gears.
        (Accumulates::PerTime, _, Parity::Even) => Some("counting or a mounting that creeps, not gears"),
        (Accumulates::PerTime, _, _) => Some("heat or drift, not teeth"),
        (Accumulates::PerRevolution, _, _) if grows(load) => Some("slip or wear, not elasticity"),
        (Accumulates::PerRevolution, _, _) if any(load) => {
            Some("counting, or a pair that does not close; not elasticity")
        }
        (_, Carrier::EncoderLine, _) => Some("an encoder's electronics, not gears"),
        (_, Carrier::Mesh, _) if any(load) => Some("tooth flanks, not shafts"),
        (_, Carrier::Mesh, _) if grows(load) => Some("teeth that give way under load"),
        (_, Carrier::Input | Carrier::Output, Parity::OneFlank) if signature.sector_deg.is_some() => {
            Some("one place of the turn: a tooth, not a shaft")
        }
        (_, Carrier::Input | Carrier::Output, Parity::Even) if any(load) && any(speed) => Some(match order {
            Some(1) => "instrument or clocking, not teeth, not drive train",
            Some(2) => "an encoder's disc or a coupling, not teeth",
            _ => "something that turns with that shaft; not play, not wind-up",
        }),
        (_, Carrier::Input | Carrier::Output, Parity::Mixed) if any(load) && any(speed) => {
            Some("gears on their shafts or their centre distance, not encoders")
        }
        (_, _, Parity::Odd) if grows(load) => Some("something that gives way under load"),
        (_, _, Parity::Odd) if grows(speed) => Some("timing between the channels"),
        (_, _, Parity::Odd) if any(load) && any(speed) => Some("play or drag: teeth, bearings, seals"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gearmodel::effect::LIBRARY;

    #[test]
    fn every_effect_of_the_library_has_words_and_a_remedy() {
        for effect in LIBRARY {
            assert!(remedy(effect.name()).is_some(), "{}", effect.name());
            assert_ne!(plain(effect.name()), effect.name());
        }
    }

    #[test]
    fn members_of_one_family_are_named_once() {
        let members = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let both = members(&["encoder2_eccentricity", "encoder1_eccentricity"]);
        assert_eq!(group(&both), "encoder eccentricity, input or output");
        let three = members(&["encoder2_eccentricity", "phasing_error", "encoder1_eccentricity"]);
        assert_eq!(group(&three), "encoder eccentricity, input or output, or clocking of gear 1 against the index");
        assert!(same_trace(&both, true).contains("elliptic"));
        assert!(!same_trace(&both, false).contains("elliptic"));
    }

    #[test]
    fn accumulation_without_load_never_points_to_elasticity() {
        let row = Signature::steady(Carrier::None, Parity::Even).accumulating(Accumulates::PerRevolution);
        assert!(points_to(&row, None).unwrap().contains("not elasticity"));
        // One load only: nothing is claimed.
        let unknown = Signature { load_exponent: None, ..row };
        assert_eq!(points_to(&unknown, None), None);
    }
}
