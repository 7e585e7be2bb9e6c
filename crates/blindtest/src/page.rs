//! The score as a page of its own: works offline, needs nothing from elsewhere.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::report::{counts, value};
use super::score::{LEFT_OUT, Rate, Score};
use rigsim::plant::UNMODELLED_FAULTS;

/// Size of a diagram, px.
const SIDE: f64 = 320.0;
/// Room for its labels, px.
const MARGIN: f64 = 44.0;

const STYLE: &str = "body{font-family:sans-serif;margin:1.5em auto;max-width:75em;padding:0 1em;color:#222}\
table{border-collapse:collapse;margin:.5em 0}td,th{padding:.2em .6em;border-bottom:1px solid #ddd;text-align:left}\
td.n{text-align:right;font-variant-numeric:tabular-nums}.met{color:#176f2c}.missed{color:#b3261e;font-weight:bold}\
.matrix td{text-align:center;min-width:1.5em;border:1px solid #eee}\
.matrix th.top{writing-mode:vertical-rl;transform:rotate(180deg);font-weight:normal;border:0}\
.row{display:flex;flex-wrap:wrap;gap:2em}svg text{font-size:11px;fill:#444}small{color:#666}";

/// The page.
#[must_use]
pub fn page(score: &Score, title: &str) -> String {
    let mut page = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title><style>{STYLE}</style></head><body>\n\
         <h1>{0}</h1>\n<p>{1} cases, {2} without an answer. A diagnosis takes {3:.1} s, {4:.1} s at most.</p>\n",
        escape(title),
        score.cases,
        score.failed.len(),
        score.seconds.1,
        score.seconds.0
    );
    figures(&mut page, score);
    page.push_str("<div class=\"row\">");
    calibration(&mut page, score);
    power(&mut page, score);
    page.push_str("</div>\n");
    by_effect(&mut page, score);
    confusion(&mut page, score);
    coverage(&mut page, score);
    wrong(&mut page, score);
    page.push_str("</body></html>\n");
    page
}

fn figures(page: &mut String, score: &Score) {
    page.push_str("<h2>Figures</h2>\n<table><tr><th>figure<th>value<th>90 % interval<th>counts and aim<th></tr>\n");
    for figure in &score.figures {
        let (class, word) = match figure.met() {
            Some(true) if figure.aim != (None, None) => ("met", "met"),
            Some(false) => ("missed", "missed"),
            _ => ("", ""),
        };
        let interval = figure
            .rate
            .and_then(Rate::interval)
            .map_or(String::new(), |(low, high)| format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high));
        let _ = writeln!(
            page,
            "<tr><td>{}<td class=\"n\">{}<td>{interval}<td>{}<td class=\"{class}\">{word}</tr>",
            escape(&figure.name),
            value(figure),
            counts(figure)
        );
    }
    page.push_str("</table>\n");
}

/// Frame of a diagram with axes from 0 to 1 and its labels; the content is drawn in px.
fn diagram(page: &mut String, title: &str, x_label: &str, y_label: &str, content: &str) {
    let full = SIDE + 2.0 * MARGIN;
    let _ = write!(
        page,
        "<figure><figcaption><b>{title}</b></figcaption><svg width=\"{full}\" height=\"{full}\" role=\"img\" aria-label=\"{title}\">\
         <rect x=\"{MARGIN}\" y=\"{MARGIN}\" width=\"{SIDE}\" height=\"{SIDE}\" fill=\"none\" stroke=\"#999\"/>"
    );
    for tick in 0..=5 {
        let share = f64::from(tick) / 5.0;
        let y = MARGIN + SIDE * (1.0 - share);
        let _ =
            write!(page, "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">{share:.1}</text>", MARGIN - 5.0, y + 4.0);
    }
    let _ = write!(
        page,
        "<text x=\"{0}\" y=\"{1}\" text-anchor=\"middle\">{x_label}</text>\
         <text transform=\"translate(12 {0}) rotate(-90)\" text-anchor=\"middle\">{y_label}</text>{content}</svg></figure>",
        MARGIN + 0.5 * SIDE,
        full - 8.0
    );
}

fn calibration(page: &mut String, score: &Score) {
    let at = |x: f64, y: f64| (MARGIN + SIDE * x, MARGIN + SIDE * (1.0 - y));
    let mut content = String::new();
    let ((x0, y0), (x1, y1)) = (at(0.0, 0.0), at(1.0, 1.0));
    let _ = write!(
        content,
        "<line x1=\"{x0}\" y1=\"{y0}\" x2=\"{x1}\" y2=\"{y1}\" stroke=\"#bbb\" stroke-dasharray=\"4\"/>"
    );
    for tick in 0..=5 {
        let (x, y) = at(f64::from(tick) / 5.0, 0.0);
        let _ = write!(
            content,
            "<text x=\"{x:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{:.1}</text>",
            y + 15.0,
            f64::from(tick) / 5.0
        );
    }
    for bin in &score.calibration.bins {
        let (x, y) = at(bin.said, bin.true_share);
        // The dot's area goes with the count.
        let radius = 2.0 + (bin.count as f64).sqrt();
        let _ = write!(
            content,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\" fill=\"#2a6fb5\" fill-opacity=\"0.7\"><title>{} probabilities, mean {:.3}, \
             came true {:.3}</title></circle>",
            radius.min(18.0),
            bin.count,
            bin.said,
            bin.true_share
        );
    }
    diagram(page, "Calibration: probabilities over 0.02", "said", "came true", &content);
}

fn power(page: &mut String, score: &Score) {
    let mut content = String::new();
    let width = SIDE / score.power.len().max(1) as f64;
    for (n, bin) in score.power.iter().enumerate() {
        let x = MARGIN + width * n as f64;
        let range = bin.to.map_or(format!("≥ {}", bin.from), |to| format!("{}–{to}", bin.from));
        let _ = write!(
            content,
            "<text x=\"{:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{range}</text>",
            x + 0.5 * width,
            MARGIN + SIDE + 15.0
        );
        let Some(share) = bin.named.share() else { continue };
        let _ = write!(
            content,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#2a6fb5\" fill-opacity=\"0.7\"><title>{} of {} \
             named</title></rect>",
            x + 2.0,
            MARGIN + SIDE * (1.0 - share),
            width - 4.0,
            SIDE * share,
            bin.named.hits,
            bin.named.of
        );
    }
    diagram(page, "Power: effects named", "true size in standard errors of the estimate", "share named", &content);
}

fn by_effect(page: &mut String, score: &Score) {
    let rate = |rate: &Rate| if rate.of == 0 { String::new() } else { format!("{} of {}", rate.hits, rate.of) };
    if !score.by_effect.is_empty() {
        page.push_str("<h2>Single effects: exact verdicts by size</h2>\n<table><tr><th>effect<th>3 µrad<th>10 µrad<th>30 µrad<th>100 µrad</tr>\n");
        for (name, rates) in &score.by_effect {
            let cells: String = rates
                .iter()
                .map(|one| format!("<td class=\"n{}\">{}", if one.hits < one.of { " missed" } else { "" }, rate(one)))
                .collect();
            let _ = writeln!(page, "<tr><td>{}{cells}</tr>", escape(name));
        }
        page.push_str("</table>\n");
    }
    if !score.by_outside.is_empty() {
        page.push_str("<h2>Outside the library or left out: called unknown</h2>\n<table>\n");
        for (name, one) in &score.by_outside {
            let _ = writeln!(page, "<tr><td>{}<td class=\"n\">{}</tr>", escape(name), rate(one));
        }
        page.push_str("</table>\n");
    }
}

fn confusion(page: &mut String, score: &Score) {
    let said: BTreeSet<&String> = score.confusion.values().flat_map(|row| row.keys()).collect();
    page.push_str(
        "<h2>Confusion: true effect (row), what was said of it (column)</h2>\n<table class=\"matrix\"><tr><th>",
    );
    for name in &said {
        let _ = write!(page, "<th class=\"top\">{}", escape(name));
    }
    page.push_str("</tr>\n");
    for (truth, row) in &score.confusion {
        let total: usize = row.values().sum();
        let _ = write!(page, "<tr><th>{}", escape(truth));
        for name in &said {
            let count = row.get(*name).copied().unwrap_or(0);
            let share = count as f64 / total.max(1) as f64;
            let hidden = truth.ends_with(LEFT_OUT) || UNMODELLED_FAULTS.iter().any(|effect| effect.name == truth);
            let right = *name == truth || hidden && *name == "unknown";
            let colour = if right { "23,111,44" } else { "179,38,30" };
            let text = if count == 0 { String::new() } else { count.to_string() };
            let _ = write!(page, "<td style=\"background:rgba({colour},{:.2})\">{text}", 0.6 * share);
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</table>\n<p><small>\u{201c}unknown\u{201d} is right for effects outside the library, \u{201c}nothing\u{201d} for rigs without a fault.</small></p>\n");
}

fn coverage(page: &mut String, score: &Score) {
    if score.coverage.is_empty() {
        return;
    }
    page.push_str("<h2>Parameters: truth within the 90 % interval</h2>\n<table>\n");
    for (name, rate) in &score.coverage {
        let _ = writeln!(page, "<tr><td>{}<td class=\"n\">{} of {}</tr>", escape(name), rate.hits, rate.of);
    }
    page.push_str("</table>\n");
}

fn wrong(page: &mut String, score: &Score) {
    page.push_str("<h2>Cases that are not exact</h2>\n<table><tr><th>case<th>family<th>true<th>missed<th>false names<th>unknown said</tr>\n");
    for case in score.outcomes.iter().filter(|case| !case.exact) {
        let listed = |named: Option<bool>| {
            let chosen = case.truths.iter().filter(|truth| named.is_none_or(|named| truth.named == named));
            let mut items: Vec<String> =
                chosen.map(|truth| format!("{} {:.0} µrad", truth.name, truth.rms_rad * 1e6)).collect();
            if named.is_none() {
                items.extend(case.hidden.iter().map(|name| format!("{name} (to be called unknown)")));
            }
            escape(&items.join(", "))
        };
        let _ = writeln!(
            page,
            "<tr><td class=\"n\">{}<td>{}<td>{}<td>{}<td>{}<td>{}</tr>",
            case.case,
            case.family.name(),
            listed(None),
            listed(Some(false)),
            escape(&case.false_names.join(", ")),
            if case.says_unknown { "yes" } else { "" }
        );
    }
    for (case, reason) in &score.failed {
        let _ = writeln!(page, "<tr><td class=\"n\">{case}<td colspan=\"5\">no answer: {}</tr>", escape(reason));
    }
    page.push_str("</table>\n");
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tests::set;

    #[test]
    fn the_page_stands_alone_and_says_what_went_wrong() {
        let page = page(&set(), "Blind test <1>");
        assert!(page.contains("<title>Blind test &lt;1&gt;</title>"));
        for outside in ["http://", "https://", "src=", "<link", "<script"] {
            assert!(!page.contains(outside), "{outside}");
        }
        assert!(page.contains("time_skew 10 µrad") && page.contains("no answer: no answer"));
        assert!(page.contains("<circle") && page.contains("class=\"matrix\""));
        assert_eq!(page.matches("<table").count(), page.matches("</table>").count());
    }
}
