//! `rigd model phases`: how to mount the gears so that their eccentricities disturb least.

use std::f64::consts::TAU;

use gearmodel::Direction;
use gearmodel::phase::{PhaseFreedom, PhaseObjective, PhaseStudy, PhaseValue};
use serde_json::json;

use super::error::ModelError;
use super::output::{Output, Report};
use super::source::Source;
use super::table::{Column, Table};
use crate::chart::{Axis, Chart, Ink, Mark, Panel, Scale, Series};
use crate::present::angle;

/// How to mount the gears so that their eccentricities disturb least.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    /// What is to be small, peak-to-peak over a turn
    #[arg(long, value_enum, default_value = "backlash")]
    objective: Objective,
    /// How the driver can be mounted: `fixed`, `hub` (turned on it by any angle), or `index:N` (by steps of 1/N of a turn)
    #[arg(long, default_value = "hub", value_parser = freedom)]
    driver: PhaseFreedom,
    /// How the driven gear can be mounted
    #[arg(long, default_value = "hub", value_parser = freedom)]
    driven: PhaseFreedom,
    #[command(flatten)]
    output: Output,
}

/// What is to be small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Objective {
    /// The periodic backlash
    Backlash,
    /// TE driving ccw
    #[value(name = "te_ccw")]
    TeCcw,
    /// TE driving cw
    #[value(name = "te_cw")]
    TeCw,
    /// The larger TE of both senses
    #[value(name = "te_both")]
    TeBoth,
}

impl Objective {
    fn of(self) -> (PhaseObjective, &'static str) {
        match self {
            Self::Backlash => (PhaseObjective::Backlash, "backlash"),
            Self::TeCcw => (PhaseObjective::TransmissionError(Direction::Ccw), "TE ccw"),
            Self::TeCw => (PhaseObjective::TransmissionError(Direction::Cw), "TE cw"),
            Self::TeBoth => (PhaseObjective::TransmissionErrorBoth, "the larger TE of both senses"),
        }
    }
}

/// Most steps of an index.
const MAX_STEPS: u32 = 10_000;

fn freedom(text: &str) -> Result<PhaseFreedom, String> {
    match text {
        "fixed" => return Ok(PhaseFreedom::Fixed),
        "hub" => return Ok(PhaseFreedom::Hub),
        _ => {}
    }
    text.strip_prefix("index:")
        .and_then(|steps| steps.parse().ok())
        .filter(|steps| (1..=MAX_STEPS).contains(steps))
        .map(|steps| PhaseFreedom::Index { steps })
        .ok_or_else(|| {
            format!("'{text}' is no way of mounting; write fixed, hub or index:N with N of 1 to {MAX_STEPS}")
        })
}

/// Points of a phase's curve.
const POINTS: u32 = 360;

/// Runs the command.
///
/// # Errors
/// [`ModelError`] says what is asked for in vain.
pub fn run(args: &Args) -> Result<(), ModelError> {
    args.output.check(&[])?;
    let loaded = args.source.load()?;
    let errors = &loaded.model.errors;
    let (objective, name) = args.objective.of();
    let study = PhaseStudy::new(&loaded.model.pair, errors, objective)
        .map_err(|source| ModelError::Geometry { pair: loaded.name.clone(), source })?;
    let phases = study.optimal(args.driver, args.driven);
    let documented = PhaseValue {
        phi1_rad: errors.phi1_rad,
        phi2_rad: errors.phi2_rad,
        value_rad: study.value_rad(errors.phi1_rad, errors.phi2_rad),
    };
    let [even, odd] = phases.published;
    let rows = [
        ("optimum", phases.best),
        ("as documented", documented),
        ("published, n even and even", even),
        ("published, n even and odd", odd),
    ];

    let mut text = format!(
        "{}\ne1 = {} mm, e2 = {} mm; peak-to-peak of {name} over a turn\n\n{:<28}  {:>9}  {:>9}  peak-to-peak\n",
        loaded.heading(),
        errors.e1_mm,
        errors.e2_mm,
        "",
        "φ1 / °",
        "φ2 / °"
    );
    for (label, at) in &rows {
        text += &format!(
            "{label:<28}  {:>9.3}  {:>9.3}  {}\n",
            at.phi1_rad.to_degrees(),
            at.phi2_rad.to_degrees(),
            angle(at.value_rad)
        );
    }
    if errors.e1_mm == 0.0 && errors.e2_mm == 0.0 {
        text += "\nboth eccentricities are 0: every mounting is as good as any other (set e1_mm and e2_mm)\n";
    }
    let entry = |at: &PhaseValue| json!({"phi1_rad": at.phi1_rad, "phi2_rad": at.phi2_rad, "value_rad": at.value_rad});
    let json = json!({
        "schema": "rigd.model.phases/1",
        "pair": loaded.json(),
        "objective": args.objective.of().1,
        "best": entry(&phases.best),
        "documented": entry(&documented),
        "published": [entry(&even), entry(&odd)],
    });
    let table = Table {
        columns: vec![
            Column::texts("mounting", rows.iter().map(|(label, _)| (*label).to_owned()).collect()),
            Column::numbers("phi1_rad", rows.iter().map(|(_, at)| at.phi1_rad).collect()),
            Column::numbers("phi2_rad", rows.iter().map(|(_, at)| at.phi2_rad).collect()),
            Column::numbers("value_pp_rad", rows.iter().map(|(_, at)| at.value_rad).collect()),
        ],
    };
    let around = |value: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
        (0..=POINTS)
            .map(|n| TAU * (f64::from(n) / f64::from(POINTS) - 0.5))
            .map(|phi| (phi.to_degrees(), value(phi) * 1e6))
            .collect()
    };
    let best = phases.best;
    let series = vec![
        Series {
            name: format!("over φ1 at φ2 = {:.1}°", best.phi2_rad.to_degrees()),
            ink: Ink::Numbered(0),
            mark: Mark::Line,
            points: around(&|phi| study.value_rad(phi, best.phi2_rad)),
        },
        Series {
            name: format!("over φ2 at φ1 = {:.1}°", best.phi1_rad.to_degrees()),
            ink: Ink::Numbered(1),
            mark: Mark::Line,
            points: around(&|phi| study.value_rad(best.phi1_rad, phi)),
        },
    ];
    let panel = Panel {
        title: format!("Peak-to-peak of {name} about the best mounting"),
        x: Axis::Fitted("phase / °".into()),
        y_label: "peak-to-peak / µrad".into(),
        scale: Scale::Free,
        series,
    };
    Ok(args.output.deliver(Report { text, json, table, chart: Chart { panels: vec![panel] } }, &[])?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn freedoms_are_read_or_refused() {
        assert_eq!(freedom("hub"), Ok(PhaseFreedom::Hub));
        assert_eq!(freedom("index:47"), Ok(PhaseFreedom::Index { steps: 47 }));
        for wrong in ["index:0", "index:", "loose", "index:-1"] {
            assert!(freedom(wrong).unwrap_err().contains("index:N"), "{wrong}");
        }
    }
}
