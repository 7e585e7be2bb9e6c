//! The picture beside a log: TE of both senses and backlash over θ1, measured and predicted.

use std::path::{Path, PathBuf};

use gearmodel::Direction;
use gearmodel::measure::{AngleGrid, Curve};
use plotters::prelude::*;
use thiserror::Error;

use crate::analysis::Analysis;

/// Why no picture was made.
#[derive(Debug, Error)]
#[error("picture {path}: {reason}; the log itself is complete")]
pub struct PlotError {
    path: PathBuf,
    reason: String,
}

const CCW: RGBColor = RGBColor(0, 90, 160);
const CW: RGBColor = RGBColor(190, 70, 0);
const BACKLASH: RGBColor = RGBColor(40, 120, 60);

struct Line {
    name: String,
    colour: RGBColor,
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
        let (name, colour) = match conditions.direction {
            Direction::Ccw => ("TE ccw", CCW),
            Direction::Cw => ("TE cw", CW),
        };
        te.push(Line {
            name: name.into(),
            colour,
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
            colour: BACKLASH,
            measured: measured.curve.curve.clone(),
            predicted: analysis.predicted_backlash(load).curve,
        })
        .collect();
    let title = format!("{load} N·m, {} rpm", last.te.conditions().speed_rpm);
    render(path, &title, &te, &backlash).map_err(|error| PlotError { path: path.into(), reason: error.to_string() })?;
    Ok(true)
}

fn render(path: &Path, title: &str, te: &[Line], backlash: &[Line]) -> Result<(), Box<dyn std::error::Error>> {
    let rows = if backlash.is_empty() { 2 } else { 3 };
    let root = SVGBackend::new(path, (960, 320 * rows)).into_drawing_area();
    root.fill(&WHITE)?;
    let panels = root.split_evenly((rows as usize, 1));
    panel(
        &panels[0],
        &format!("Transmission error, {title}: measured (points), predicted (lines)"),
        "TE / µrad",
        te,
        false,
    )?;
    panel(&panels[1], "What the model leaves: measured minus predicted", "ΔTE / µrad", te, true)?;
    if rows == 3 {
        panel(&panels[2], "Backlash at the driven shaft", "backlash / µrad", backlash, false)?;
    }
    root.present()?;
    Ok(())
}

fn panel(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    title: &str,
    unit: &str,
    lines: &[Line],
    residual: bool,
) -> Result<(), Box<dyn std::error::Error>> {
    let grid = AngleGrid::default();
    let points = |values: &[f64], reference: Option<&[f64]>| -> Vec<(f64, f64)> {
        values
            .iter()
            .enumerate()
            .map(|(bin, value)| {
                (grid.centre(bin).to_degrees(), (value - reference.map_or(0.0, |curve| curve[bin])) * 1e6)
            })
            .filter(|(_, value)| value.is_finite())
            .collect()
    };
    let series: Vec<_> = lines
        .iter()
        .map(|line| {
            let measured = points(&line.measured.values_rad, residual.then_some(line.predicted.values_rad.as_slice()));
            let predicted = if residual { Vec::new() } else { points(&line.predicted.values_rad, None) };
            (line, measured, predicted)
        })
        .collect();
    let values =
        || series.iter().flat_map(|(_, measured, predicted)| measured.iter().chain(predicted)).map(|(_, value)| *value);
    let (low, high) =
        values().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return Ok(());
    }
    let margin = (0.06 * (high - low)).max(0.5);
    // Above the curves: room for the legend.
    let headroom = 1.0 + 2.0 * lines.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 18))
        .margin(8)
        .x_label_area_size(34)
        .y_label_area_size(64)
        .build_cartesian_2d((0.0..360.0).step(45.0), (low - margin)..(high + headroom * margin))?;
    chart
        .configure_mesh()
        .x_desc("θ1 / °")
        .y_desc(unit)
        .x_labels(9)
        .x_label_formatter(&|degrees| format!("{degrees:.0}"))
        .y_label_formatter(&|value| format!("{value:.*}", usize::from(high - low < 10.0)))
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .draw()?;
    for (line, measured, predicted) in series {
        let colour = line.colour;
        // Every fourth bin (2°), open: points that can be told from the line through them.
        let every = if residual { 1 } else { 4 };
        let (size, style) = if residual { (1, colour.filled()) } else { (3, colour.stroke_width(1)) };
        chart
            .draw_series(measured.iter().step_by(every).map(|point| Circle::new(*point, size, style)))?
            .label(format!("{} {}", line.name, if residual { "measured − predicted" } else { "measured" }))
            .legend(move |(x, y)| Circle::new((x + 10, y), 3, style));
        if !predicted.is_empty() {
            chart
                .draw_series(LineSeries::new(predicted, BLACK.mix(0.7).stroke_width(1)))?
                .label(format!("{} predicted", line.name))
                .legend(|(x, y)| PathElement::new([(x, y), (x + 20, y)], BLACK.mix(0.7)));
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperMiddle)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.2))
        .draw()?;
    Ok(())
}
