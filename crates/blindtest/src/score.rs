//! Many scored cases: the figures that a diagnosis is held to.

use std::collections::BTreeMap;

use serde::Serialize;

use super::calibration::Calibration;
use super::case_score::{CaseScore, TrueEffect};
use super::family::{Family, SINGLE_SIZES_RAD};

/// Edges of the power curve, standard errors.
const POWER_EDGES: [f64; 8] = [0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0];
/// Effects under this size are not asked for their probability, rad RMS.
const CLEAR_RAD: f64 = 9.5e-6;

/// What stands behind an effect's name where the diagnosis had to do without it.
pub const LEFT_OUT: &str = " (left out)";

/// How many of how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Rate {
    /// So many.
    pub hits: usize,
    /// Of so many.
    pub of: usize,
}

impl Rate {
    /// Counts.
    pub fn of(outcomes: impl Iterator<Item = bool>) -> Self {
        outcomes.fold(Self::default(), |rate, hit| Self { hits: rate.hits + usize::from(hit), of: rate.of + 1 })
    }

    /// Their share; nothing of nothing has none.
    #[must_use]
    pub fn share(self) -> Option<f64> {
        (self.of > 0).then(|| self.hits as f64 / self.of as f64)
    }

    /// Wilson's 90 % interval of the share.
    #[must_use]
    pub fn interval(self) -> Option<(f64, f64)> {
        const Z: f64 = 1.644_854;
        let (p, n) = (self.share()?, self.of as f64);
        let centre = (p + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
        let half = Z / (1.0 + Z * Z / n) * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
        Some(((centre - half).max(0.0), (centre + half).min(1.0)))
    }
}

/// One figure with its aim.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it says.
    pub name: String,
    /// Its value.
    pub value: Option<f64>,
    /// Counts behind it, where it is a share.
    pub rate: Option<Rate>,
    /// Smallest and largest value aimed at.
    pub aim: (Option<f64>, Option<f64>),
}

impl Figure {
    fn share(name: impl Into<String>, rate: Rate, at_least: f64) -> Self {
        Self { name: name.into(), value: rate.share(), rate: Some(rate), aim: (Some(at_least), None) }
    }

    /// Whether the aim is met; `None` without a value.
    #[must_use]
    pub fn met(&self) -> Option<bool> {
        let value = self.value?;
        Some(self.aim.0.is_none_or(|least| value >= least) && self.aim.1.is_none_or(|most| value <= most))
    }
}

/// One bin of the power curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Power {
    /// Standard errors from.
    pub from: f64,
    /// Standard errors to; open at the end.
    pub to: Option<f64>,
    /// Effects named.
    pub named: Rate,
}

/// All figures of a set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Schema of this object.
    pub schema: &'static str,
    /// Cases scored.
    pub cases: usize,
    /// Cases without an answer: number and reason.
    pub failed: Vec<(usize, String)>,
    /// The figures that have aims.
    pub figures: Vec<Figure>,
    /// Single effects, by name: exact verdicts at each of the four sizes.
    pub by_effect: BTreeMap<String, [Rate; 4]>,
    /// Outside effects, by name: cases that called them unknown.
    pub by_outside: BTreeMap<String, Rate>,
    /// True effect → what was said instead or of it → how often.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
    /// Calibration of all probabilities.
    pub calibration: Calibration,
    /// Share of effects named, over their size in standard errors.
    pub power: Vec<Power>,
    /// 90 % intervals that hold the truth, by parameter.
    pub coverage: BTreeMap<String, Rate>,
    /// Slowest and mean diagnosis, s.
    pub seconds: (f64, f64),
    /// The cases.
    pub outcomes: Vec<CaseScore>,
}

impl Score {
    /// Of scored cases, those without an answer among them, which count as wrong; `failed` could not even be asked.
    #[must_use]
    pub fn of(outcomes: Vec<CaseScore>, mut failed: Vec<(usize, String)>) -> Self {
        let cases = outcomes.len() + failed.len();
        failed.extend(outcomes.iter().filter_map(|case| Some((case.case, case.no_answer.clone()?))));
        failed.sort();
        let calibration = Calibration::of(&outcomes.iter().flat_map(|case| case.events.clone()).collect::<Vec<_>>());
        let coverage = coverage(&outcomes);
        let answered = outcomes.iter().filter(|case| case.no_answer.is_none());
        let times: Vec<f64> = answered.map(|case| case.seconds).collect();
        let mean_s = times.iter().fold(0.0, |sum, time| sum + time) / times.len().max(1) as f64;
        Self {
            schema: "rigd.blindtest/1",
            cases,
            figures: figures(&outcomes, &calibration, &coverage),
            by_effect: by_effect(&outcomes),
            by_outside: by_outside(&outcomes),
            confusion: confusion(&outcomes),
            power: power(&outcomes),
            coverage,
            calibration,
            seconds: (times.iter().copied().fold(0.0, f64::max), mean_s),
            failed,
            outcomes,
        }
    }
}

fn family(outcomes: &[CaseScore], family: Family) -> impl Iterator<Item = &CaseScore> {
    outcomes.iter().filter(move |case| case.family == family)
}

fn truths(outcomes: &[CaseScore]) -> impl Iterator<Item = &TrueEffect> {
    outcomes.iter().flat_map(|case| &case.truths)
}

/// Which of the four sizes a single effect has.
fn size_index(rms_rad: f64) -> usize {
    // Between two sizes, their geometric mean divides.
    SINGLE_SIZES_RAD.windows(2).filter(|pair| rms_rad > (pair[0] * pair[1]).sqrt()).count()
}

fn figures(outcomes: &[CaseScore], calibration: &Calibration, coverage: &BTreeMap<String, Rate>) -> Vec<Figure> {
    let exact = |of: Family| Rate::of(family(outcomes, of).map(|case| case.exact));
    let sized = |wanted: &[usize]| {
        Rate::of(
            family(outcomes, Family::Single)
                .filter(|case| wanted.contains(&size_index(case.rms_rad)))
                .map(|case| case.exact),
        )
    };
    let flagged = |of: Family| Rate::of(family(outcomes, of).map(|case| case.says_unknown));
    let most = |name: &str, rate: Rate, limit: f64| Figure {
        name: name.into(),
        value: rate.share(),
        rate: Some(rate),
        aim: (None, Some(limit)),
    };
    let number = |name: &str, value: Option<f64>, aim| Figure { name: name.into(), value, rate: None, aim };
    let clear: Vec<f64> =
        truths(outcomes).filter(|truth| truth.rms_rad >= CLEAR_RAD).map(|truth| truth.probability).collect();
    let mean_of = |values: &[f64]| (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64);
    let mut shrink: Vec<f64> = outcomes.iter().filter_map(|case| case.shrink).collect();
    shrink.sort_by(f64::total_cmp);
    let all =
        coverage.values().fold(Rate::default(), |sum, rate| Rate { hits: sum.hits + rate.hits, of: sum.of + rate.of });
    let sizes: Vec<f64> = truths(outcomes).filter(|truth| truth.named).map(|truth| truth.group_size as f64).collect();
    vec![
        Figure::share("single effect of 30 µrad and more: exact verdict", sized(&[2, 3]), 0.98),
        Figure::share("single effect of 10 µrad: exact verdict", sized(&[1]), 0.92),
        Figure::share("single effect of 3 µrad: exact verdict", sized(&[0]), 0.75),
        Figure::share("two effects: exact set", exact(Family::Pair), 0.95),
        Figure::share("three effects: exact set", exact(Family::Triple), 0.90),
        most(
            "nothing wrong: a false name",
            Rate::of(family(outcomes, Family::Null).map(|case| !case.false_names.is_empty())),
            0.03,
        ),
        most("nothing wrong: false \u{201c}unknown\u{201d}", flagged(Family::Null), 0.03),
        Figure::share("outside the library: flagged", flagged(Family::Outside), 0.97),
        Figure::share("outside the library: exact verdict", exact(Family::Outside), 0.92),
        Figure::share("outside the library mixed with a known effect: exact verdict", exact(Family::Mixed), 0.85),
        Figure::share("a known effect left out: called unknown", flagged(Family::LeftOut), 0.97),
        number("mean probability on true effects of 10 µrad and more", mean_of(&clear), (Some(0.95), None)),
        number("calibration error (ECE) of probabilities over 0.02", calibration.ece, (None, Some(0.05))),
        number("Brier score of the same", calibration.brier, (None, None)),
        number("shrink against an oracle, mean", mean_of(&shrink), (Some(0.97), None)),
        number("shrink against an oracle, median", shrink.get(shrink.len() / 2).copied(), (Some(0.97), None)),
        Figure {
            name: "parameters: truth within the 90 % interval".into(),
            value: all.share(),
            rate: Some(all),
            aim: (Some(0.85), Some(0.95)),
        },
        Figure::share("signature right", Rate::of(outcomes.iter().filter_map(|case| case.signature)), 0.95),
        number("members of a claim that names a true effect, mean", mean_of(&sizes), (None, None)),
    ]
}

fn by_effect(outcomes: &[CaseScore]) -> BTreeMap<String, [Rate; 4]> {
    let mut rows: BTreeMap<String, [Rate; 4]> = BTreeMap::new();
    for case in family(outcomes, Family::Single) {
        for truth in &case.truths {
            let rate = &mut rows.entry(truth.name.clone()).or_default()[size_index(truth.rms_rad)];
            *rate = Rate { hits: rate.hits + usize::from(case.exact), of: rate.of + 1 };
        }
    }
    rows
}

fn by_outside(outcomes: &[CaseScore]) -> BTreeMap<String, Rate> {
    let mut rows: BTreeMap<String, Rate> = BTreeMap::new();
    for case in outcomes {
        for name in &case.hidden {
            let rate = rows.entry(name.clone()).or_default();
            *rate = Rate { hits: rate.hits + usize::from(case.says_unknown), of: rate.of + 1 };
        }
    }
    rows
}

/// A named truth stands on the diagonal; a missed one beside every false claim of its case, else beside "unknown" or "nothing".
fn confusion(outcomes: &[CaseScore]) -> BTreeMap<String, BTreeMap<String, usize>> {
    let mut matrix: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    let mut count = |truth: &str, said: &str| {
        *matrix.entry(truth.to_owned()).or_default().entry(said.to_owned()).or_default() += 1;
    };
    for case in outcomes {
        let missed: Vec<&str> =
            case.truths.iter().filter(|truth| !truth.named).map(|truth| truth.name.as_str()).collect();
        for truth in case.truths.iter().filter(|truth| truth.named) {
            count(&truth.name, &truth.name);
        }
        for name in &missed {
            if case.false_names.is_empty() {
                count(name, if case.says_unknown && case.hidden.is_empty() { "unknown" } else { "nothing" });
            }
            for said in &case.false_names {
                count(name, said);
            }
        }
        let hidden: Vec<String> = case.hidden.iter().map(|name| hidden_name(case.family, name)).collect();
        for name in &hidden {
            count(name, if case.says_unknown { "unknown" } else { "nothing" });
        }
        if missed.is_empty() {
            let owner = hidden.first().map_or("nothing", String::as_str);
            for said in &case.false_names {
                count(owner, said);
            }
        }
        if case.truths.is_empty() && case.hidden.is_empty() && case.false_names.is_empty() {
            count("nothing", if case.says_unknown { "unknown" } else { "nothing" });
        }
    }
    matrix
}

/// A hidden effect's row: one that the diagnosis knows but had to do without is a row of its own.
fn hidden_name(family: Family, name: &str) -> String {
    if family == Family::LeftOut { format!("{name}{LEFT_OUT}") } else { name.to_owned() }
}

fn power(outcomes: &[CaseScore]) -> Vec<Power> {
    POWER_EDGES
        .iter()
        .enumerate()
        .map(|(n, &from)| {
            let to = POWER_EDGES.get(n + 1).copied();
            let inside = |size: f64| size >= from && to.is_none_or(|to| size < to);
            let named = truths(outcomes).filter(|truth| truth.standard_errors.is_some_and(inside));
            Power { from, to, named: Rate::of(named.map(|truth| truth.named)) }
        })
        .collect()
}

fn coverage(outcomes: &[CaseScore]) -> BTreeMap<String, Rate> {
    let mut rows: BTreeMap<String, Rate> = BTreeMap::new();
    for truth in truths(outcomes) {
        for (parameter, right) in &truth.covered {
            let rate = rows.entry(format!("{}.{parameter}", truth.name)).or_default();
            *rate = Rate { hits: rate.hits + usize::from(*right), of: rate.of + 1 };
        }
    }
    rows
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::case_score::score_case;
    use crate::case_score::tests::{answer, label};
    use serde_json::json;

    /// A small set with a hit, a miss, a false name and an unknown.
    pub fn set() -> Score {
        let case = |family, effects: &[(&str, bool, f64)], verdict, p: &[(&str, f64)], unknown| {
            score_case(&label(family, effects), &answer(verdict, p, unknown), 2.0)
        };
        let outcomes = vec![
            case(Family::Null, &[], json!([]), &[("slip", 0.01)], 0.0),
            case(Family::Null, &[], json!(["slip"]), &[("slip", 0.9)], 0.0),
            case(Family::Single, &[("time_skew", false, 30.0)], json!(["time_skew"]), &[("time_skew", 0.99)], 0.0),
            case(Family::Single, &[("time_skew", false, 10.0)], json!(["slip"]), &[("time_skew", 0.3)], 0.0),
            case(Family::Single, &[("slip", false, 3.0)], json!([]), &[("slip", 0.1)], 0.0),
            case(Family::Outside, &[("knocks", true, 30.0)], json!(["unknown"]), &[], 0.97),
        ];
        Score::of(outcomes, vec![(6, "no answer".into())])
    }

    #[test]
    fn figures_count_what_they_say() {
        let score = set();
        assert_eq!(score.cases, 7);
        let figure = |start: &str| score.figures.iter().find(|figure| figure.name.starts_with(start)).unwrap();
        assert_eq!(figure("single effect of 30").rate, Some(Rate { hits: 1, of: 1 }));
        assert_eq!(figure("single effect of 10").rate, Some(Rate { hits: 0, of: 1 }));
        assert_eq!(figure("nothing wrong: a false name").rate, Some(Rate { hits: 1, of: 2 }));
        assert_eq!(figure("nothing wrong: a false name").met(), Some(false));
        assert_eq!(figure("outside the library: flagged").met(), Some(true));
        assert_eq!(figure("two effects").met(), None);
        assert!((figure("mean probability").value.unwrap() - 0.645).abs() < 1e-12);
    }

    #[test]
    fn misses_stand_beside_what_was_said_instead() {
        let matrix = set().confusion;
        assert_eq!(matrix["time_skew"], [("slip".to_owned(), 1), ("time_skew".to_owned(), 1)].into());
        assert_eq!(matrix["slip"], [("nothing".to_owned(), 1)].into());
        assert_eq!(matrix["nothing"], [("nothing".to_owned(), 1), ("slip".to_owned(), 1)].into());
        assert_eq!(matrix["knocks"], [("unknown".to_owned(), 1)].into());
    }

    #[test]
    fn sizes_fall_to_the_nearest_of_four() {
        assert_eq!([2e-6, 5e-6, 6e-6, 1.2e-5, 3e-5, 2e-4].map(size_index), [0, 0, 1, 1, 2, 3]);
    }

    #[test]
    fn wilsons_interval_holds_the_share_and_narrows() {
        let (low, high) = Rate { hits: 19, of: 20 }.interval().unwrap();
        assert!(low < 0.95 && high > 0.95 && high < 1.0);
        let (closer, _) = Rate { hits: 190, of: 200 }.interval().unwrap();
        assert!(closer > low);
        assert_eq!(Rate::default().interval(), None);
    }
}
