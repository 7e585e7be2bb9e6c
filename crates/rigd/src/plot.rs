//! The picture beside a log: TE of both senses and backlash over θ1, measured and predicted.

use std::path::{Path, PathBuf};

use gearmodel::Direction;
use gearmodel::measure::{AngleGrid, Curve};
use thiserror::Error;

use crate::analysis::Analysis;
use crate::chart::{Chart, ChartError, Ink, Mark, Panel, Series};

/// Why no picture was made.
#[derive(Debug, Error)]
pub enum PlotError {
    /// Drawing failed.
    #[error("picture {path}: {error}; TE and backlash are in the log and the summary all the same")]
    Chart {
        /// The picture.
        path: PathBuf,
        /// Why.
        error: ChartError,
    },
    /// The file could not be written.
    #[error("picture {path}: {source}; the log itself is complete")]
    Write {
        /// The picture.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
}

struct Line {
    name: String,
    ink: Ink,
    measured: Curve,
    predicted: Curve,
}

/// Draws the last load's TE and backlash to `path`. Returns `false` when there is nothing to draw.
///
/// # Errors
/// [`PlotError`] when the file cannot be written.
pub fn draw(analysis: &Analysis, path: &Path) -> Result<bool, PlotError> {
    let Some(last) = analysis.runs().last() else { return Ok(false) };
    let load = last.te.conditions().load_nm;
    let mut te = Vec::new();
    for run in analysis.runs().iter().filter(|run| run.te.conditions().load_nm == load) {
        let conditions = run.te.conditions();
        let (name, ink) = match conditions.direction {
            Direction::Ccw => ("TE ccw", Ink::Ccw),
            Direction::Cw => ("TE cw", Ink::Cw),
        };
        te.push(Line {
            name: name.into(),
            ink,
            measured: run.te.mean_curve(),
            predicted: analysis.predicted(&conditions),
        });
    }
    let backlash: Vec<Line> = analysis
        .backlash()
        .iter()
        .filter(|measured| measured.conditions.load_nm == load)
        .map(|measured| Line {
            name: "backlash".into(),
            ink: Ink::Backlash,
            measured: measured.curve.curve.clone(),
            predicted: analysis.predicted_backlash(&measured.conditions).curve,
        })
        .collect();
    let title = format!("{load} N·m, {} rpm", last.te.conditions().speed_rpm);
    let svg = chart(&title, &te, &backlash).svg().map_err(|error| PlotError::Chart { path: path.into(), error })?;
    std::fs::write(path, svg).map_err(|source| PlotError::Write { path: path.into(), source })?;
    Ok(true)
}

fn chart(title: &str, te: &[Line], backlash: &[Line]) -> Chart {
    let over = "Transmission error, ";
    let mut panels = vec![
        Panel::over_turn(format!("{over}{title}: measured (points), predicted (lines)"), "TE / µrad", both(te)),
        Panel::over_turn("What the model leaves: measured minus predicted", "ΔTE / µrad", residuals(te)),
    ];
    if !backlash.is_empty() {
        panels.push(Panel::over_turn("Backlash at the driven shaft", "backlash / µrad", both(backlash)));
    }
    Chart { panels }
}

fn points(values_rad: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
    let grid = AngleGrid::default();
    values_rad.enumerate().map(|(bin, value_rad)| (grid.centre(bin).to_degrees(), value_rad * 1e6)).collect()
}

/// Measured points and predicted lines.
fn both(lines: &[Line]) -> Vec<Series> {
    let one = |line: &Line| {
        [
            Series {
                name: format!("{} measured", line.name),
                ink: line.ink,
                // Every fourth bin, 2°.
                mark: Mark::Rings(4),
                points: points(line.measured.values_rad.iter().copied()),
            },
            Series {
                name: format!("{} predicted", line.name),
                ink: Ink::Predicted,
                mark: Mark::Line,
                points: points(line.predicted.values_rad.iter().copied()),
            },
        ]
    };
    lines.iter().flat_map(one).collect()
}

fn residuals(lines: &[Line]) -> Vec<Series> {
    let one = |line: &Line| {
        let differences = line.measured.values_rad.iter().zip(&line.predicted.values_rad).map(|(m, p)| m - p);
        Series {
            name: format!("{} measured − predicted", line.name),
            ink: line.ink,
            mark: Mark::Dots,
            points: points(differences),
        }
    };
    lines.iter().map(one).collect()
}
