//! What to measure next: the cheapest experiments that separate what is still confused.

use std::fmt::Write as _;

use super::diagnosis::{Experiment, PlanRow, Unknown};
use super::grid::Grid;
use gearmodel::effect::{HandTest, by_name};

/// Most experiments proposed.
const MOST: usize = 3;
/// Time to set up an experiment that needs hands on the rig, min.
const HANDS_MIN: f64 = 15.0;

/// What is still open.
pub(super) struct Open {
    /// Groups that one set-up cannot separate.
    pub(super) groups: Vec<Vec<String>>,
    /// Effects that are neither found nor excluded.
    pub(super) unsure: Vec<String>,
}

/// Up to three experiments: first those by hand that separate groups, then runs.
pub(super) fn experiments(grid: &Grid, open: &Open, unknown: &Unknown, warnings: &[String]) -> Vec<Experiment> {
    let mut found = by_hand(grid, &open.groups);
    found.extend(by_plan(grid, &open.unsure, unknown));
    if !open.unsure.is_empty() || !warnings.is_empty() && found.is_empty() {
        // As many revolutions again halve the variance: log odds grow with them.
        let rows = runs(&["ccw", "cw"], &grid.plan.loads_nm, &[usual_rpm(grid)], 8);
        let action = "repeat the plan with twice the revolutions".to_owned();
        found.push(experiment(action, open.unsure.clone(), 0.9, rows, 0.0));
    }
    found.truncate(MOST);
    found
}

/// The speed that most runs can be made at, rpm.
fn usual_rpm(grid: &Grid) -> f64 {
    let rpm = grid.plan.speeds_rad_per_s.last().copied().unwrap_or(0.0) * 60.0 / std::f64::consts::TAU;
    if rpm > 0.0 { rpm } else { 5.0 }
}

/// Tests by hand, for each group the first that tells members of it apart.
fn by_hand(grid: &Grid, groups: &[Vec<String>]) -> Vec<Experiment> {
    let plan = &grid.plan;
    let mut found = Vec::new();
    for members in groups {
        let takes_part = |test: HandTest| {
            move |name: &&String| by_name(name).is_some_and(|effect| effect.told_apart_by().contains(&test))
        };
        let tells_apart = |test: &HandTest| members.iter().filter(takes_part(*test)).count() >= 2;
        if let Some(test) = HandTest::ALL.into_iter().find(tells_apart) {
            let rows = vec![PlanRow {
                direction: if plan.senses[0] { "ccw" } else { "cw" }.to_owned(),
                load_nm: plan.loads_nm.first().copied().unwrap_or(0.0),
                speed_rpm: usual_rpm(grid),
                revolutions: 4,
            }];
            let expected = expected(members.len(), 2);
            found.push(experiment(test.action().to_owned(), members.clone(), expected, rows, HANDS_MIN));
        }
    }
    found
}

/// Runs under conditions that were not recorded.
fn by_plan(grid: &Grid, unsure: &[String], unknown: &Unknown) -> Vec<Experiment> {
    let plan = &grid.plan;
    let rpm = usual_rpm(grid);
    let load_nm = plan.loads_nm.last().copied().unwrap_or(0.0);
    let mut found = Vec::new();
    if plan.senses != [true, true] {
        let other = if plan.senses[0] { "cw" } else { "ccw" };
        let rows = runs(&[other], &plan.loads_nm, &[rpm], 4);
        let action = "record the other sense at the same loads".to_owned();
        found.push(experiment(action, unsure.to_vec(), 0.95, rows, 0.0));
    }
    if plan.loads_nm.len() < 2 {
        let more = if load_nm > 0.0 { vec![0.3 * load_nm, load_nm, 1.5 * load_nm] } else { vec![0.0, 5.0, 10.0] };
        let rows = runs(&["ccw", "cw"], &more, &[rpm], 4);
        found.push(experiment("record two more loads in both senses".to_owned(), unsure.to_vec(), 0.95, rows, 0.0));
    }
    if plan.speeds_rad_per_s.len() < 2 {
        let rows = runs(&["ccw", "cw"], &[load_nm], &[0.5 * rpm, 2.0 * rpm], 4);
        let action = "record half and twice the speed in both senses".to_owned();
        found.push(experiment(action, unsure.to_vec(), 0.9, rows, 0.0));
    }
    if unknown.probability > 0.3 {
        let rows = runs(&["ccw", "cw"], &[load_nm], &[rpm, 2.0 * rpm], 12);
        found.push(experiment(
            "record long runs at two speeds: what is tied to time, to one shaft's angle or to single revolutions comes apart".to_owned(),
            vec!["unknown".to_owned()],
            0.9,
            rows,
            0.0,
        ));
    }
    found
}

/// Rows for all combinations.
fn runs(directions: &[&str], loads_nm: &[f64], speeds_rpm: &[f64], revolutions: u32) -> Vec<PlanRow> {
    let mut rows = Vec::new();
    for load_nm in loads_nm {
        for speed_rpm in speeds_rpm {
            for direction in directions {
                rows.push(PlanRow {
                    direction: (*direction).to_owned(),
                    load_nm: *load_nm,
                    speed_rpm: *speed_rpm,
                    revolutions,
                });
            }
        }
    }
    rows
}

/// Probability of the right member once `told_apart` of `members` are separated.
fn expected(members: usize, told_apart: usize) -> f64 {
    if members <= told_apart { 0.99 } else { 0.99 / (members - 1) as f64 }
}

fn experiment(
    action: String,
    separates: Vec<String>,
    expected_probability: f64,
    plan: Vec<PlanRow>,
    hands_min: f64,
) -> Experiment {
    // A run takes its revolutions, one to get there and half a minute to settle.
    let minutes =
        hands_min + plan.iter().map(|row| f64::from(row.revolutions + 1) / row.speed_rpm.max(0.1) + 0.5).sum::<f64>();
    let mut toml = String::new();
    for row in &plan {
        // Writing to a String cannot fail.
        let _ = write!(
            toml,
            "[[runs]]\ndirection = \"{}\"\nload_nm = {:?}\nspeed_rpm = {:?}\nrevolutions = {}\n\n",
            row.direction, row.load_nm, row.speed_rpm, row.revolutions
        );
    }
    Experiment { action, separates, expected_probability, minutes, plan, toml }
}
