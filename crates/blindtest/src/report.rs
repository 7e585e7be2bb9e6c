//! The score in the terminal.

use super::score::{Figure, Score};

/// A line a figure: value, counts, aim, and whether it is met.
#[must_use]
pub fn text(score: &Score) -> String {
    let mut lines = vec![format!(
        "{} cases, {} without an answer; a diagnosis takes {:.1} s, {:.1} s at most",
        score.cases,
        score.failed.len(),
        score.seconds.1,
        score.seconds.0
    )];
    lines.extend(score.figures.iter().filter(|figure| figure.value.is_some()).map(line));
    lines.extend(score.failed.iter().take(3).map(|(case, reason)| format!("case {case}: {reason}")));
    lines.join("\n")
}

fn line(figure: &Figure) -> String {
    let mark = match figure.met() {
        Some(true) if figure.aim != (None, None) => "met",
        Some(false) => "MISSED",
        _ => "",
    };
    format!("{:<62} {:>8}  {:<26} {mark}", figure.name, value(figure), counts(figure)).trim_end().to_owned()
}

/// The value: a share in percent, a number as it is.
#[must_use]
pub fn value(figure: &Figure) -> String {
    match (figure.value, figure.rate) {
        (None, _) => "–".into(),
        (Some(share), Some(_)) => format!("{:.1} %", 100.0 * share),
        (Some(number), None) => format!("{number:.3}"),
    }
}

/// Counts and aim.
#[must_use]
pub fn counts(figure: &Figure) -> String {
    let number = |limit: f64| if figure.rate.is_some() { format!("{:.0} %", 100.0 * limit) } else { limit.to_string() };
    let aim = match figure.aim {
        (Some(least), Some(most)) => format!("{} to {}", number(least), number(most)),
        (Some(least), None) => format!("≥ {}", number(least)),
        (None, Some(most)) => format!("≤ {}", number(most)),
        (None, None) => String::new(),
    };
    match figure.rate {
        Some(rate) if aim.is_empty() => format!("{} of {}", rate.hits, rate.of),
        Some(rate) => format!("{} of {}, aim {aim}", rate.hits, rate.of),
        None if aim.is_empty() => aim,
        None => format!("aim {aim}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tests::set;

    #[test]
    fn every_figure_with_a_value_has_its_line() {
        let text = text(&set());
        assert!(text.starts_with("7 cases, 1 without an answer"));
        assert!(text.contains("1 of 2, aim ≤ 3 %") && text.contains("MISSED"), "{text}");
        assert!(!text.contains("two effects"));
        assert!(text.ends_with("case 6: no answer"));
    }
}
