//! What to measure next: the cheapest experiments that separate what is still confused.

use std::fmt::Write as _;

use super::diagnosis::{Experiment, PlanRow, Unknown};
use super::grid::Grid;

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

/// What separates the members of a group, and why.
struct Remedy {
    /// Members that it tells from the others, by the beginning of their names.
    of: &'static [&'static str],
    action: &'static str,
}

/// Remedies by hand, in the order in which they are tried.
const REMEDIES: &[Remedy] = &[
    Remedy {
        of: &["encoder1_eccentricity", "encoder2_eccentricity", "phasing_error", "pitch_curve_error"],
        action: "turn the output encoder by 180 deg on its shaft and repeat one run: the trace turns its sign if that encoder is the \
                 cause, and stays if it is the input encoder, the clocking or the pitch curve",
    },
    Remedy {
        of: &["encoder1_eccentricity", "phasing_error", "pitch_curve_error"],
        action: "turn the input encoder by 180 deg on its shaft and repeat one run: an eccentric disc turns the sign of its \
                 trace, clocking and pitch curve do not",
    },
    Remedy {
        of: &["backlash_error", "bearing_clearance"],
        action: "press the driven shaft sideways in its bearings with an indicator on it: play shows there, thin teeth do not; or \
                 preload the bearings and repeat one run in both senses",
    },
    Remedy {
        of: &["mesh_compliance", "bearing_compliance"],
        action: "put an indicator on the driven shaft beside the gear and repeat the highest load: bearings that give way move the \
                 shaft, teeth do not",
    },
    Remedy {
        of: &["encoder1_ellipticity", "coupling_misalignment_input"],
        action: "swap the input coupling for the output one, or realign it, and repeat one run: order 2 follows the coupling or stays",
    },
    Remedy {
        of: &["encoder2_ellipticity", "coupling_misalignment_output"],
        action: "swap the output coupling for the input one, or realign it, and repeat one run: order 2 follows the coupling or stays",
    },
    Remedy {
        of: &["friction_windup", "backlash_error", "bearing_clearance"],
        action: "take the seals off and repeat one run in both senses: drag goes with them, backlash stays",
    },
    Remedy {
        of: &["gear1_eccentricity", "gear2_eccentricity", "encoder"],
        action: "re-index gear 2 by a quarter of its teeth and repeat one run in both senses: what belongs to gear 1 stays where it is \
                 against the driver's angle, what belongs to gear 2 moves",
    },
];

/// Up to three experiments.
pub(super) fn experiments(grid: &Grid, open: &Open, unknown: &Unknown, warnings: &[String]) -> Vec<Experiment> {
    let plan = &grid.plan;
    let mut found: Vec<Experiment> = Vec::new();
    let rpm = plan.speeds_rad_per_s.last().copied().unwrap_or(0.0) * 60.0 / std::f64::consts::TAU;
    let rpm = if rpm > 0.0 { rpm } else { 5.0 };
    let load_nm = plan.loads_nm.last().copied().unwrap_or(0.0);
    let seen = if plan.senses[0] { "ccw" } else { "cw" };
    let other = if plan.senses[0] { "cw" } else { "ccw" };
    for members in &open.groups {
        let covered = |remedy: &&Remedy| {
            let hits = members.iter().filter(|m| remedy.of.iter().any(|o| m.starts_with(o))).count();
            hits >= 2
        };
        if let Some(remedy) = REMEDIES.iter().find(covered) {
            let rows = vec![PlanRow {
                direction: seen.to_owned(),
                load_nm: plan.loads_nm.first().copied().unwrap_or(0.0),
                speed_rpm: rpm,
                revolutions: 4,
            }];
            found.push(experiment(
                remedy.action.to_owned(),
                members.clone(),
                expected(members.len(), 2),
                rows,
                HANDS_MIN,
            ));
        }
    }
    let runs = |directions: &[&str], loads: &[f64], speeds: &[f64], revolutions: u32| -> Vec<PlanRow> {
        let mut rows = Vec::new();
        for load in loads {
            for speed in speeds {
                for direction in directions {
                    rows.push(PlanRow {
                        direction: (*direction).to_owned(),
                        load_nm: *load,
                        speed_rpm: *speed,
                        revolutions,
                    });
                }
            }
        }
        rows
    };
    let unsure = open.unsure.clone();
    if plan.senses != [true, true] {
        let rows = runs(&[other], &plan.loads_nm, &[rpm], 4);
        found.push(experiment("record the other sense at the same loads".to_owned(), unsure.clone(), 0.95, rows, 0.0));
    }
    if plan.loads_nm.len() < 2 {
        let more = if load_nm > 0.0 { vec![0.3 * load_nm, load_nm, 1.5 * load_nm] } else { vec![0.0, 5.0, 10.0] };
        let rows = runs(&["ccw", "cw"], &more, &[rpm], 4);
        found.push(experiment("record two more loads in both senses".to_owned(), unsure.clone(), 0.95, rows, 0.0));
    }
    if plan.speeds_rad_per_s.len() < 2 {
        let rows = runs(&["ccw", "cw"], &[load_nm], &[0.5 * rpm, 2.0 * rpm], 4);
        found.push(experiment(
            "record half and twice the speed in both senses".to_owned(),
            unsure.clone(),
            0.9,
            rows,
            0.0,
        ));
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
    if !unsure.is_empty() || !warnings.is_empty() && found.is_empty() {
        // As many revolutions again halve the variance: log odds grow with them.
        let rows = runs(&["ccw", "cw"], &plan.loads_nm, &[rpm], 8);
        found.push(experiment("repeat the plan with twice the revolutions".to_owned(), unsure, 0.9, rows, 0.0));
    }
    found.truncate(MOST);
    found
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
