//! Tables: the causes with their parameters, probabilities, experiments, and who looks like whom.

use std::fmt::Write as _;

use super::charts::part_class;
use super::svg::{Anchor, Svg, escape};
use crate::diagnosis::{Diagnosis, EffectFinding, Experiment, Verdict};
use crate::summary::quantity::{parameter, percent, plain, probability, tenth, urad};
use crate::summary::{group_probability, is_elliptic, words};

/// Effects under this probability are listed by name alone.
const SHOWN: f64 = 0.01;

/// A parameter's text with the signs that a page can show.
fn pretty(text: &str) -> String {
    let text = text.replace("+-", "±").replace("urad", "µrad").replace(" um", " µm").replace(" us", " µs");
    let text = text.replace("N.m", "N·m").replace(" deg", "°").replace("mm2", "mm²");
    escape(&text)
}

/// The parameters of an effect, one a line.
fn parameters(effect: &EffectFinding) -> String {
    let line = |(name, entry): (&String, &serde_json::Value)| format!("<li>{}</li>", pretty(&parameter(name, entry)));
    format!("<ul class=\"plain\">{}</ul>", effect.parameters.iter().map(line).collect::<String>())
}

fn closes(shrink: Option<f64>) -> String {
    match shrink {
        None => String::new(),
        Some(s) if s < 0.005 => " · alone it closes next to nothing of the gap".to_owned(),
        Some(s) => format!(" · alone it closes {} of the reducible gap", percent(s)),
    }
}

/// What the diagnosis stakes its name on, one card each.
pub fn causes(diagnosis: &Diagnosis) -> String {
    let mut out = String::new();
    let effect = |name: &String| diagnosis.effects.iter().find(|e| e.name == *name);
    for item in words::ranked(diagnosis) {
        let title = escape(&words::item(item));
        // Writing to a String cannot fail.
        match item {
            Verdict::Name(name) if name == "unknown" => {
                let unknown = &diagnosis.unknown;
                let _ = write!(
                    out,
                    "<article class=\"card odd\"><h3>{title}</h3><p class=\"quiet\">p {} · {} µrad rms</p>",
                    escape(&probability(unknown.probability)),
                    urad(unknown.rms_rad)
                );
                match &unknown.location {
                    Some(location) => {
                        let _ = write!(out, "<p>Where: {}.</p>", escape(&location.description));
                    }
                    None => out.push_str("<p>It has no pattern of its own over angle, load, speed or time.</p>"),
                }
                out.push_str("<p>None of the library's effects explains it: look for something that is not in the list below.</p></article>");
            }
            Verdict::Name(name) => {
                let Some(effect) = effect(name) else { continue };
                let _ = write!(
                    out,
                    "<article class=\"card\"><h3>{title}</h3><p class=\"quiet\">p {} · sits on: {}{}</p>{}<p><code>{}</code></p>",
                    escape(&probability(effect.probability)),
                    escape(&effect.component),
                    closes(effect.shrink),
                    parameters(effect),
                    escape(name)
                );
                if let Some(remedy) = words::remedy(name) {
                    let _ = write!(out, "<p><b>To do:</b> {}.</p>", escape(remedy));
                }
                out.push_str("</article>");
            }
            Verdict::Group { members, angle_deg } => {
                let shrink = members.iter().filter_map(effect).filter_map(|e| e.shrink).reduce(f64::max);
                let _ = write!(
                    out,
                    "<article class=\"card wide\"><h3>{title}</h3><p class=\"quiet\">p {} that one of them is there{}</p>\
                     <p>Do not fix one of them yet: {} (they stand {angle_deg:.1}° apart).</p>",
                    escape(&probability(group_probability(diagnosis, members))),
                    closes(shrink),
                    words::same_trace(members, is_elliptic(diagnosis))
                );
                out.push_str("<table><tr><th>if it is</th><th>then</th><th>to do</th></tr>");
                for effect in diagnosis.effects.iter().filter(|e| members.contains(&e.name)) {
                    let _ = write!(
                        out,
                        "<tr><td>{}<br><code>{}</code></td><td>{}</td><td>{}</td></tr>",
                        escape(words::plain(&effect.name)),
                        escape(&effect.name),
                        parameters(effect),
                        escape(words::remedy(&effect.name).unwrap_or_default())
                    );
                }
                out.push_str("</table></article>");
            }
        }
    }
    out
}

/// Shares of the reducible gap.
pub fn budget(diagnosis: &Diagnosis) -> String {
    let mut out = String::from(
        "<table><tr><th></th><th>part</th><th class=\"n\">share</th><th class=\"n\">90 % interval</th></tr>",
    );
    for (n, row) in diagnosis.gap.budget.iter().enumerate() {
        let interval =
            row.interval.map_or_else(String::new, |[a, b]| format!("{} … {} %", tenth(100.0 * a), tenth(100.0 * b)));
        let _ = write!(
            out,
            "<tr><td><span class=\"key k-{}\"></span></td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{interval}</td></tr>",
            part_class(n, &row.effect),
            escape(&words::within(diagnosis, &row.effect)),
            percent(row.share)
        );
    }
    out.push_str("</table>");
    out
}

fn bar(p: f64) -> String {
    let width = 100.0 * p.clamp(0.0, 1.0);
    let text = probability(p);
    format!(
        "<span class=\"row\"><span class=\"meter\"><span style=\"width:{width:.1}%\"></span></span> {}</span>",
        escape(text.trim_start_matches("= "))
    )
}

/// Probability of every effect, groups as one statement.
pub fn probabilities(diagnosis: &Diagnosis) -> String {
    let mut out = String::from(
        "<table><tr><th>effect</th><th>sits on</th><th>probability</th><th class=\"n\">trace, µrad rms</th>\
         <th class=\"n\">closes alone</th></tr>",
    );
    // Alone on held-out runs an effect that is not there makes things worse: it closes nothing.
    let shrink = |e: &EffectFinding| e.shrink.filter(|s| *s > 0.0005).map_or_else(|| "–".to_owned(), percent);
    let mut grouped: Vec<&str> = Vec::new();
    let row = |e: &EffectFinding, class: &str| {
        format!(
            "<tr class=\"{class}\"><td>{}<br><code>{}</code></td><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            escape(words::plain(&e.name)),
            escape(&e.name),
            escape(&e.component),
            bar(e.probability),
            urad(e.rms_rad),
            shrink(e)
        )
    };
    for group in diagnosis.groups.iter().filter(|g| g.probability >= SHOWN) {
        let _ = write!(
            out,
            "<tr class=\"group\"><td colspan=\"2\"><b>one of:</b> {} <span class=\"quiet\">({:.1}° apart)</span></td>\
             <td>{}</td><td></td><td></td></tr>",
            escape(&words::group(&group.members)),
            group.angle_deg,
            bar(group.probability)
        );
        for effect in diagnosis.effects.iter().filter(|e| group.members.contains(&e.name)) {
            grouped.push(&effect.name);
            out.push_str(&row(effect, "member"));
        }
    }
    let mut absent = Vec::new();
    for effect in diagnosis.effects.iter().filter(|e| !grouped.contains(&e.name.as_str())) {
        if effect.probability >= SHOWN {
            out.push_str(&row(effect, ""));
        } else {
            absent.push(words::plain(&effect.name));
        }
    }
    let unknown = &diagnosis.unknown;
    let _ = write!(
        out,
        "<tr><td>something outside the library</td><td>–</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">–</td></tr></table>",
        bar(unknown.probability),
        urad(unknown.rms_rad)
    );
    if !absent.is_empty() {
        let _ = write!(
            out,
            "<p class=\"quiet\">Looked for and not seen (p &lt; {SHOWN}): {}.</p>",
            escape(&absent.join("; "))
        );
    }
    out
}

/// The experiments.
pub fn experiments(experiments: &[Experiment]) -> String {
    let mut out = String::from("<ol class=\"steps\">");
    for experiment in experiments {
        let separates: Vec<&str> = experiment.separates.iter().map(|n| words::plain(n)).collect();
        let _ = write!(out, "<li><p><b>{}</b></p><p class=\"quiet\">", escape(&experiment.action));
        if !separates.is_empty() {
            let _ = write!(out, "tells apart: {} · ", escape(&separates.join("; ")));
        }
        let _ = write!(
            out,
            "expected probability of the right one ≥ {:.2} · about {:.0} min of rig time</p>",
            experiment.expected_probability,
            experiment.minutes.max(1.0)
        );
        if !experiment.plan.is_empty() {
            out.push_str(
                "<table class=\"tight\"><tr><th>sense</th><th class=\"n\">load, N·m</th><th class=\"n\">speed, rpm</th>\
                 <th class=\"n\">revolutions</th></tr>",
            );
            for row in &experiment.plan {
                let _ = write!(
                    out,
                    "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
                    escape(&row.direction),
                    plain(row.load_nm),
                    plain(row.speed_rpm),
                    row.revolutions
                );
            }
            out.push_str("</table>");
        }
        if !experiment.toml.is_empty() {
            let _ = write!(
                out,
                "<details><summary>as TOML for <code>rigd campaign</code> (one click selects it)</summary><pre>{}</pre></details>",
                escape(experiment.toml.trim_end())
            );
        }
        out.push_str("</li>");
    }
    out.push_str("</ol>");
    out
}

/// Angles between effects: the smaller, the more alike.
pub fn confusability(diagnosis: &Diagnosis) -> String {
    let table = &diagnosis.confusability;
    let count = table.names.len();
    if count < 2 {
        return String::new();
    }
    let (cell, left, top) = (32.0, 250.0, 14.0);
    let mut svg = Svg::new(left + cell * count as f64 + 20.0, top + cell * count as f64 + 40.0);
    for (m, name) in table.names.iter().enumerate() {
        let y = top + cell * m as f64;
        svg.text("t small", [left - 28.0, y + 21.0], Anchor::End, words::plain(name));
        svg.text("t small strong", [left - 8.0, y + 21.0], Anchor::End, &format!("{}", m + 1));
        svg.text(
            "t small strong",
            [left + cell * (m as f64 + 0.5), top + cell * count as f64 + 16.0],
            Anchor::Middle,
            &format!("{}", m + 1),
        );
        for (n, other) in table.names.iter().enumerate().take(m) {
            let Some(angle) = table.angle_deg.get(m).and_then(|row| row.get(n)).copied() else { continue };
            // Steps of alikeness, from the same to unrelated.
            let class = match angle {
                a if a < diagnosis.settings.report.same_deg => "a5",
                a if a < 10.0 => "a4",
                a if a < 20.0 => "a3",
                a if a < 35.0 => "a2",
                a if a < 60.0 => "a1",
                _ => "a0",
            };
            let x = left + cell * n as f64;
            let tip = format!("{} and {}: {angle:.1}°", words::plain(name), words::plain(other));
            svg.rect(class, [x + 1.0, y + 1.0], [cell - 2.0, cell - 2.0], &tip);
            let text = if angle < 10.0 { format!("{angle:.1}") } else { format!("{angle:.0}") };
            let on = if angle < 10.0 { "t small on strong" } else { "t small" };
            svg.text(on, [x + cell / 2.0, y + 20.0], Anchor::Middle, &text);
            if angle < diagnosis.settings.report.same_deg {
                svg.rect("same", [x + 1.0, y + 1.0], [cell - 2.0, cell - 2.0], "");
            }
        }
    }
    svg.finish("angles between the effects, degrees")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_become_signs() {
        assert_eq!(pretty("dx = 12.3 +- 0.4 um, phase 3 deg, 1 N.m"), "dx = 12.3 ± 0.4 µm, phase 3°, 1 N·m");
        assert_eq!(pretty("c < 1 urad/(N.m)"), "c &lt; 1 µrad/(N·m)");
    }
}
