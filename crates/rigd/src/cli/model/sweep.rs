//! `rigd model sweep`: a figure over a grid of parameters.

use std::fmt::Write as _;

use gearmodel::Direction;
use gearmodel::sensitivity::Parameter;
use gearmodel::sweep::{Sweep, SweepFigure, SweepMethod, SweepTable};
use serde_json::json;

use super::error::{ModelError, check_count};
use super::output::{Output, Report};
use super::parameter::axis;
use super::progress::Progress;
use super::source::Source;
use super::table::{Column, Table};
use crate::chart::{Axis, Chart, Ink, Mark, Panel, Scale, Series};
use crate::cli::Exit;
use crate::present::arcsec;
use crate::quantity::TORQUE;

/// A figure over a grid of parameters.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    /// An axis of the grid, as `eccentricity=0.2,0.4` or `e1_mm=0..0.1:0.02`; repeat it for more, the last runs fastest
    #[arg(long, required = true, value_name = "KEY=VALUES", value_parser = axis)]
    over: Vec<(Parameter, Vec<f64>)>,
    /// Figures, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "te_ccw_pp")]
    of: Vec<Of>,
    /// How TE is computed
    #[arg(long, value_enum, default_value = "common_normal")]
    method: How,
    /// Torque on the driven shaft, as `10Nm`
    #[arg(long, default_value = "0Nm")]
    load: String,
    /// Angles a turn
    #[arg(long, default_value_t = 720, value_name = "N")]
    points: u32,
    #[command(flatten)]
    output: Output,
}

/// A figure of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
enum Of {
    /// Peak-to-peak of TE driving ccw
    TeCcwPp,
    /// Peak-to-peak of TE driving cw
    TeCwPp,
    /// RMS of TE about its mean, ccw
    TeCcwRms,
    /// RMS of TE about its mean, cw
    TeCwRms,
    /// Mean of TE, ccw
    TeCcwMean,
    /// Mean of TE, cw
    TeCwMean,
    /// Peak-to-peak of the backlash
    BacklashPp,
    /// Mean of the backlash
    BacklashMean,
}

impl Of {
    fn figure(self) -> SweepFigure {
        use Direction::{Ccw, Cw};
        match self {
            Self::TeCcwPp => SweepFigure::TePp(Ccw),
            Self::TeCwPp => SweepFigure::TePp(Cw),
            Self::TeCcwRms => SweepFigure::TeRms(Ccw),
            Self::TeCwRms => SweepFigure::TeRms(Cw),
            Self::TeCcwMean => SweepFigure::TeMean(Ccw),
            Self::TeCwMean => SweepFigure::TeMean(Cw),
            Self::BacklashPp => SweepFigure::BacklashPp,
            Self::BacklashMean => SweepFigure::BacklashMean,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::TeCcwPp => "te_ccw_pp",
            Self::TeCwPp => "te_cw_pp",
            Self::TeCcwRms => "te_ccw_rms",
            Self::TeCwRms => "te_cw_rms",
            Self::TeCcwMean => "te_ccw_mean",
            Self::TeCwMean => "te_cw_mean",
            Self::BacklashPp => "backlash_pp",
            Self::BacklashMean => "backlash_mean",
        }
    }
}

/// How TE is computed in a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum How {
    /// Increment along the common normal
    #[value(name = "common_normal", alias = "common-normal")]
    CommonNormal,
    /// Exact contact of rigid teeth
    Exact,
}

/// Rows that people are shown.
const ROWS: usize = 60;

/// Runs the command.
///
/// # Errors
/// [`ModelError`] when nothing can be swept; cells without a pair are told on stderr and give [`Exit::Incomplete`].
pub fn run(args: &Args) -> Result<Exit, ModelError> {
    args.output.check(&[])?;
    let load_nm = TORQUE.parse(&args.load)?;
    let points = check_count("--points", args.points.into(), (8, 100_000))? as usize;
    let loaded = args.source.load()?;
    let mut results: Vec<(Of, SweepTable)> = Vec::new();
    let cells: usize = args.over.iter().map(|(_, values)| values.len()).product();
    let progress = Progress::new(cells * args.of.len(), "sweep");
    for (index, of) in args.of.iter().enumerate() {
        let sweep = Sweep {
            gears: loaded.file.gears.clone(),
            errors: loaded.model.errors,
            load_nm,
            over: args.over.clone(),
            of: of.figure(),
            method: if args.method == How::Exact { SweepMethod::Exact } else { SweepMethod::CommonNormal },
            angles: points,
        };
        let table = sweep
            .run(&|done| progress.at(index * cells + done))
            .map_err(|source| ModelError::Geometry { pair: loaded.name.clone(), source })?;
        results.push((*of, table));
    }
    drop(progress);

    let table = labelled(&args.over, &results);
    let faults: &[(usize, String)] = results.first().map_or(&[], |(_, table)| &table.faults);
    for (cell, reason) in faults.iter().take(5) {
        eprintln!("warning: no pair at {}: {reason}", place(&args.over, *cell));
    }
    if faults.len() > 5 {
        eprintln!("warning: and {} more of {cells} cells have no pair", faults.len() - 5);
    }
    let json = json!({
        "schema": "rigd.model.sweep/1",
        "pair": loaded.json(),
        "load_nm": load_nm,
        "over": args.over.iter().map(|(parameter, values)| json!({"parameter": parameter.name(), "values": values})).collect::<Vec<_>>(),
        "of": args.of.iter().map(|of| of.name()).collect::<Vec<_>>(),
        "faults": faults.iter().map(|(cell, reason)| json!({"cell": cell, "reason": reason})).collect::<Vec<_>>(),
    });
    let text = format!("{}\n{cells} cells at {load_nm} N·m\n\n{}", loaded.heading(), people(&args.over, &results));
    let chart = Chart { panels: results.iter().map(|(of, table)| panel(&args.over, *of, table)).collect() };
    args.output.deliver(Report { text, json, table, chart }, &[])?;
    Ok(if faults.is_empty() { Exit::Done } else { Exit::Incomplete })
}

/// Value of each axis at a cell; the last axis runs fastest.
fn coordinates(over: &[(Parameter, Vec<f64>)], cell: usize) -> Vec<f64> {
    let mut rest = cell;
    let mut values: Vec<f64> = over
        .iter()
        .rev()
        .map(|(_, values)| {
            let value = values[rest % values.len()];
            rest /= values.len();
            value
        })
        .collect();
    values.reverse();
    values
}

fn place(over: &[(Parameter, Vec<f64>)], cell: usize) -> String {
    let values = coordinates(over, cell);
    over.iter().zip(values).map(|((p, _), value)| format!("{} = {value}", p.name())).collect::<Vec<_>>().join(", ")
}

fn labelled(over: &[(Parameter, Vec<f64>)], results: &[(Of, SweepTable)]) -> Table {
    let cells = results.first().map_or(0, |(_, table)| table.values_rad.len());
    let axes = over.iter().enumerate().map(|(axis, (parameter, _))| {
        Column::numbers(parameter.name(), (0..cells).map(|cell| coordinates(over, cell)[axis]).collect())
    });
    let figures =
        results.iter().map(|(of, table)| Column::numbers(format!("{}_rad", of.name()), table.values_rad.clone()));
    Table { columns: axes.chain(figures).collect() }
}

fn people(over: &[(Parameter, Vec<f64>)], results: &[(Of, SweepTable)]) -> String {
    let mut text = String::new();
    let width = |name: &str| name.chars().count().max(12);
    // Writing to a String cannot fail.
    for (parameter, _) in over {
        let _ = write!(text, "{:>1$}  ", parameter.name(), width(parameter.name()));
    }
    for (of, _) in results {
        let _ = write!(text, "{:>16}  ", of.name());
    }
    text.push('\n');
    let cells = results.first().map_or(0, |(_, table)| table.values_rad.len());
    for cell in 0..cells.min(ROWS) {
        for ((parameter, _), value) in over.iter().zip(coordinates(over, cell)) {
            let _ = write!(text, "{:>1$.6}  ", value, width(parameter.name()));
        }
        for (_, table) in results {
            let value = table.values_rad[cell];
            let shown = if value.is_finite() { format!("{:.3}\"", arcsec(value)) } else { "no pair".into() };
            let _ = write!(text, "{shown:>16}  ");
        }
        text.push('\n');
    }
    if cells > ROWS {
        let _ = writeln!(text, "… {} more rows: --csv, --json or --plot give all", cells - ROWS);
    }
    text
}

/// The figure over the last axis, a line for each combination of the others.
fn panel(over: &[(Parameter, Vec<f64>)], of: Of, table: &SweepTable) -> Panel {
    /// Lines that can still be told apart.
    const LINES: usize = 12;
    let Some(((last, values), others)) = over.split_last() else {
        return Panel::over_turn(of.name(), "", Vec::new());
    };
    let series = table
        .values_rad
        .chunks(values.len())
        .take(LINES)
        .enumerate()
        .map(|(line, chunk)| Series {
            name: if others.is_empty() { of.name().into() } else { place(others, line) },
            ink: Ink::Numbered(line),
            mark: Mark::Line,
            points: values.iter().zip(chunk).map(|(x, value)| (*x, value * 1e6)).collect(),
        })
        .collect();
    Panel {
        title: format!("{} over {}", of.name(), last.name()),
        x: Axis::Fitted(last.name().into()),
        y_label: format!("{} / µrad", of.name()),
        scale: Scale::Free,
        series,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_axis_runs_fastest() {
        let over = [(Parameter::E1Mm, vec![0.0, 0.1]), (Parameter::Eccentricity, vec![0.2, 0.3, 0.4])];
        assert_eq!(coordinates(&over, 0), [0.0, 0.2]);
        assert_eq!(coordinates(&over, 2), [0.0, 0.4]);
        assert_eq!(coordinates(&over, 3), [0.1, 0.2]);
        assert_eq!(place(&over, 5), "e1_mm = 0.1, eccentricity = 0.4");
    }
}
