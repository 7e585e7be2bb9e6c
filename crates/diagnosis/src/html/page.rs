//! The page: what is wrong and what to do first, the evidence after.

use std::fmt::Write as _;

use super::svg::escape;
use super::{charts, maps, tables};
use crate::diagnosis::{Diagnosis, Verdict};
use crate::summary::quantity::{percent, urad};
use crate::summary::{self, words};

const STYLE: &str = include_str!("style.css");

/// A cause with less of the reducible gap than this is named below, not in the headline.
const SMALL: f64 = 0.01;

/// The causes that carry the gap, and how many are left out for being small.
fn main_causes(diagnosis: &Diagnosis) -> (Vec<&Verdict>, usize) {
    let ranked = words::ranked(diagnosis);
    let large: Vec<&Verdict> = ranked.iter().copied().filter(|v| words::share(diagnosis, v) >= SMALL).collect();
    // Without a budget, or where all are small, all count.
    if large.is_empty() { (ranked, 0) } else { (large.clone(), ranked.len() - large.len()) }
}

/// The verdict as a headline.
pub(super) fn headline(diagnosis: &Diagnosis) -> String {
    let (causes, small) = main_causes(diagnosis);
    let items: Vec<String> = causes.into_iter().map(words::item).collect();
    let mut text = match items.as_slice() {
        [] => summary::unexplained(diagnosis).to_owned(),
        [one] => format!("Candidate: {one}"),
        many => format!("{} causes: {}", many.len(), many.join("; ")),
    };
    if small > 0 {
        let _ = write!(text, " (and {small} that carry under 1 % of the gap each)");
    }
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// How far the gap closes, in one sentence.
fn outcome(diagnosis: &Diagnosis) -> String {
    let gap = &diagnosis.gap;
    let mut text = format!(
        "The gap between model and rig is {} µrad rms; {} µrad of it is what the rig does not repeat.",
        urad(gap.before_rad),
        urad(gap.floor_rad)
    );
    if let (Some(closed), false) = (gap.closed, diagnosis.verdict.is_empty()) {
        let _ = write!(
            text,
            " With the causes found it falls to {} µrad: {} of what can be reduced",
            urad(gap.after_rad),
            percent(closed)
        );
        if let Some([low, high]) = gap.closed_interval {
            let _ = write!(text, " (90 % interval {:.1} … {:.1} %)", 100.0 * low, 100.0 * high);
        }
        text.push_str(", on runs that were not used for the fit.");
        if diagnosis.verdict.iter().any(|v| matches!(v, Verdict::Name(n) if n == "unknown")) {
            text.push_str(
                " The part from outside the library is followed there by a pattern that fits it, not explained: see its share in the budget.",
            );
        }
    }
    text
}

/// What to do, in one sentence.
fn advice(diagnosis: &Diagnosis) -> String {
    let first = diagnosis.next.first().map(|e| e.action.as_str());
    let uncertain = diagnosis.verdict.iter().any(|v| matches!(v, Verdict::Group { .. }));
    let unknown = diagnosis.verdict.iter().any(|v| matches!(v, Verdict::Name(n) if n == "unknown"));
    let fixes: Vec<&str> = main_causes(diagnosis)
        .0
        .into_iter()
        .filter_map(|v| match v {
            Verdict::Name(name) => words::remedy(name),
            Verdict::Group { .. } => None,
        })
        .collect();
    let mut parts = Vec::new();
    if !fixes.is_empty() {
        parts.push(format!("On the rig: {}.", fixes.join("; ")));
    }
    if let (Some(action), true) = (first, uncertain || unknown) {
        parts.push(format!("{}: {action}.", if fixes.is_empty() { "Next" } else { "Then" }));
    }
    if parts.is_empty() {
        parts.push(match first {
            Some(action) => format!("Nothing to fix by this data. To be surer: {action}."),
            None => "Nothing to fix.".to_owned(),
        });
    }
    parts.join(" ")
}

fn section(page: &mut String, title: &str, note: &str, body: &str) {
    if body.is_empty() {
        return;
    }
    // Writing to a String cannot fail.
    let _ = write!(page, "<section><h2>{}</h2>", escape(title));
    if !note.is_empty() {
        let _ = write!(page, "<p class=\"quiet\">{}</p>", escape(note));
    }
    let _ = write!(page, "{body}</section>");
}

/// Charts side by side.
fn many(figures: impl Iterator<Item = String>) -> String {
    let figures: String = figures.filter(|f| !f.is_empty()).map(|f| format!("<figure>{f}</figure>")).collect();
    if figures.is_empty() { figures } else { format!("<div class=\"many\">{figures}</div>") }
}

fn location(diagnosis: &Diagnosis) -> String {
    let place = &diagnosis.location;
    let charts = [
        ("by order of the driver", "periods a turn of the driver", &place.input_order),
        ("by order of the driven shaft", "periods a turn of the driven shaft", &place.output_order),
        ("by order of the mesh", "periods a tooth", &place.mesh_order),
        ("by driver angle", "deg", &place.input_angle),
        ("by driven angle", "deg", &place.driven_angle),
        ("by driver tooth", "tooth", &place.tooth),
        ("by sense", "sense", &place.direction),
        ("by load", "N·m", &place.load),
        ("by speed", "rpm", &place.speed),
        ("by revolution since the start", "driver revolution", &place.revolution),
        ("by time since the start", "s", &place.time),
        ("by encoder line", "order of the line", &place.line_phase),
    ];
    many(charts.into_iter().map(|(title, unit, slices)| charts::slices(title, unit, slices)))
}

/// A self-contained page: no script, picture or font from elsewhere.
#[must_use]
pub fn page(diagnosis: &Diagnosis) -> String {
    let mut page = head(diagnosis);
    let causes = tables::causes(diagnosis);
    if !causes.is_empty() {
        section(&mut page, "Causes", "", &format!("<div class=\"cards\">{causes}</div>"));
    }
    if !diagnosis.next.is_empty() {
        section(&mut page, "What to do next", "", &tables::experiments(&diagnosis.next));
    }
    if !diagnosis.gap.budget.is_empty() && diagnosis.gap.closed.is_some() {
        section(
            &mut page,
            "Gap budget",
            "Share of the reducible gap, that is of before² − floor². Parts that work against each other may exceed 100 % or be negative.",
            &format!("{}{}", charts::budget(diagnosis), tables::budget(diagnosis)),
        );
    }
    each_run(&mut page, diagnosis);
    section(
        &mut page,
        "Where the gap lies",
        "Bars: the gap against the nominal model, RMS, for orders the amplitude; coloured where more than half above the floor. \
         Dashed: what repeatability alone gives there.",
        &location(diagnosis),
    );
    section(
        &mut page,
        "Residual over angle and revolution",
        "Stripes that stand upright belong to an angle; rows that differ belong to time, load or single revolutions. Grey: not measured.",
        &maps::by_revolution(&diagnosis.curves),
    );
    section(
        &mut page,
        "Residual over angle and load",
        "What deepens downwards within a sense grows with the load; what changes colour between the senses is odd: play, wind-up, friction, delay.",
        &maps::by_load(&diagnosis.curves),
    );
    section(&mut page, "Probability of every effect", "", &tables::probabilities(diagnosis));
    section(
        &mut page,
        "Who looks like whom under this plan",
        "Angle between the traces of two effects, degrees: 0 is the same trace, 90 is nothing in common. Framed: under 2°, not to be told apart by this data.",
        &tables::confusability(diagnosis),
    );
    page.push_str("</main></body></html>\n");
    page
}

/// The headline, what is advised, and what the data does not allow.
fn head(diagnosis: &Diagnosis) -> String {
    let mut page = String::new();
    let title = headline(diagnosis);
    let _ = write!(
        page,
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width,initial-scale=1\"><title>Gap diagnosis: {0}</title><style>{STYLE}</style></head><body><main>\
         <p class=\"kicker\">Gap diagnosis: model against rig</p><h1>{0}</h1><p class=\"advice\">{1}</p><p>{2}</p>",
        escape(&title),
        escape(&advice(diagnosis)),
        escape(&outcome(diagnosis)),
    );
    if !diagnosis.verdict.is_empty() {
        let _ = write!(
            page,
            "<p>Where: {}.</p>",
            escape(&words::location(diagnosis).replace("     -> ", "; this points to "))
        );
    }
    let _ = write!(
        page,
        "<figure>{}<figcaption>RMS of a sample's residual; dashed: what the rig does not repeat, below which no model can get.\
         </figcaption></figure>",
        charts::gap(diagnosis)
    );
    if !diagnosis.warnings.is_empty() {
        let items: String = diagnosis.warnings.iter().map(|w| format!("<li>{}</li>", escape(w))).collect();
        let _ = write!(
            page,
            "<div class=\"warn\"><b>What this data does not allow one to conclude</b><ul>{items}</ul></div>"
        );
    }
    page
}

/// Every run before and after.
fn each_run(page: &mut String, diagnosis: &Diagnosis) {
    let shown = diagnosis.curves.len().min(charts::MOST_RUNS);
    let scale = charts::shared_scale_rad(&diagnosis.curves);
    let rest = if shown < diagnosis.curves.len() {
        format!(" The first {shown} of {} runs.", diagnosis.curves.len())
    } else {
        String::new()
    };
    section(
        page,
        "Each run before and after",
        "",
        &if shown == 0 {
            String::new()
        } else {
            format!(
                "<p class=\"quiet\">Mean residual over the driver's angle, <span class=\"key k-before\"></span> against the nominal model, \
                 <span class=\"key k-after\"></span> with the causes found. One scale for all runs; what lies beyond it is cut off.{rest}</p>{}",
                many(diagnosis.curves.iter().take(shown).map(|curve| charts::run(curve, scale)))
            )
        },
    );
}
