//! An analysis as text, JSON, table and picture.

use std::fmt::Write as _;
use std::path::Path;

use gearmodel::Direction;
use gearmodel::measure::{OrderAxis, OrderSpectrum};
use serde_json::{Value, json};

use super::figures::{Figures, name};
use super::{AnalyseError, Run};
use crate::chart::{Axis, Chart, Ink, Mark, Panel, Scale, Series};
use crate::cli::model::error::OutputError;
use crate::cli::model::output::{Extra, Report};
use crate::cli::model::table::{Column, Table};
use crate::present::{angle, arcsec};

/// The report of all runs.
pub fn report(logs: &[String], runs: &[Figures], top: usize, warnings: &[String]) -> Report {
    let mut text = String::new();
    for run in runs {
        // Writing to a String cannot fail.
        let _ = write_text(&mut text, run, top);
    }
    let json = json!({
        "schema": "rigd.analyse/1",
        "log": logs,
        "runs": runs.iter().map(object).collect::<Vec<_>>(),
        "warnings": warnings,
    });
    Report { text: text.trim().to_owned(), json, table: table(runs), chart: chart(runs) }
}

/// What an order of an axis counts.
fn per(axis: OrderAxis) -> &'static str {
    match axis {
        OrderAxis::Driver => "periods a turn of the input shaft",
        OrderAxis::Driven => "periods a turn of the output shaft",
        OrderAxis::Mesh => "periods a tooth",
    }
}

/// The largest lines, largest first, as index and amplitude.
fn strongest(spectrum: &OrderSpectrum, top: usize) -> Vec<usize> {
    let mut lines: Vec<usize> = (0..spectrum.lines.len()).collect();
    let amplitude = |line: usize| spectrum.lines[line].amplitude_rad;
    lines.sort_by(|one, other| amplitude(*other).total_cmp(&amplitude(*one)));
    lines.truncate(top);
    lines
}

fn write_text(out: &mut String, run: &Figures, top: usize) -> std::fmt::Result {
    let (conditions, te) = (&run.conditions, &run.te);
    writeln!(
        out,
        "\n{}  {} N·m, {} rpm, {} whole revolutions of the input shaft, {} of the output shaft, {} samples, {} lost",
        conditions.direction,
        conditions.load_nm,
        conditions.speed_rpm,
        te.revolutions,
        run.driven_revolutions,
        run.samples,
        run.losses
    )?;
    writeln!(out, "  F'is (total)          {}", angle(te.f_is_total_rad))?;
    if te.f_is_tooth_rad.is_finite() {
        writeln!(out, "  f'is (tooth to tooth) {}", angle(te.f_is_tooth_rad))?;
    }
    match &run.waves {
        Ok(waves) => {
            writeln!(
                out,
                "  parted at {} order {}, half of which passes:",
                name(run.filter.axis),
                run.filter.cut_off_order
            )?;
            for (part, figures) in [("long waves, ", &waves.long_figures), ("short waves,", &waves.short_figures)] {
                write!(out, "    {part}        F'is {}", angle(figures.f_is_total_rad))?;
                if figures.f_is_tooth_rad.is_finite() {
                    write!(out, "   f'is {}", angle(figures.f_is_tooth_rad))?;
                }
                writeln!(out)?;
            }
        }
        Err(reason) => writeln!(out, "  no long and short waves: {reason}")?,
    }
    for (axis, spectrum) in &run.spectra {
        match spectrum {
            Ok(spectrum) => {
                writeln!(
                    out,
                    "  {} spectrum, {}, {} lines; the largest:",
                    name(*axis),
                    per(*axis),
                    spectrum.lines.len()
                )?;
                let lines = strongest(spectrum, top).into_iter().map(|line| {
                    let line = &spectrum.lines[line];
                    format!("{}: {:.2}\"", order(line.order), arcsec(line.amplitude_rad))
                });
                writeln!(out, "    {}", lines.collect::<Vec<_>>().join("  "))?;
            }
            Err(reason) => writeln!(out, "  no {} spectrum: {reason}", name(*axis))?,
        }
    }
    if te.offset_per_rev_rad.is_finite() {
        writeln!(out, "  offset per revolution {}", angle(te.offset_per_rev_rad))?;
    }
    match &run.floor {
        Ok(floor) => writeln!(
            out,
            "  floor, rms            {}   {:.0} % in {:.2}\" to {:.2}\"",
            angle(floor.floor_rms_rad),
            100.0 * floor.confidence,
            arcsec(floor.lower_rms_rad),
            arcsec(floor.upper_rms_rad)
        ),
        Err(reason) => writeln!(out, "  no floor: {reason}"),
    }
}

/// An order as people write it: whole where it is.
fn order(order: f64) -> String {
    if (order - order.round()).abs() < 1e-9 { format!("{order:.0}") } else { format!("{order:.4}") }
}

fn object(run: &Figures) -> Value {
    let reason = |reason: &dyn std::fmt::Display| json!({ "reason": reason.to_string() });
    let spectra = run.spectra.iter().map(|(axis, spectrum)| {
        let found = match spectrum {
            Ok(spectrum) => json!({
                "mean_rad": spectrum.mean_rad, "rms_rad": spectrum.rms_rad, "lines": spectrum.lines,
            }),
            Err(error) => reason(error),
        };
        (name(*axis).to_owned(), found)
    });
    json!({
        "direction": run.conditions.direction.as_str(),
        "load_nm": run.conditions.load_nm,
        "speed_rpm": run.conditions.speed_rpm,
        "samples": run.samples,
        "losses": run.losses,
        "revolutions": {"input": run.te.revolutions, "output": run.driven_revolutions},
        "te": run.te,
        "floor": match &run.floor {
            Ok(floor) => json!(floor),
            Err(error) => reason(error),
        },
        "spectra": Value::Object(spectra.collect()),
        "waves": match &run.waves {
            Ok(split) => json!({
                "axis": name(run.filter.axis),
                "cut_off_order": run.filter.cut_off_order,
                "long": split.long_figures,
                "short": split.short_figures,
            }),
            Err(error) => reason(error),
        },
    })
}

/// A row a line of every spectrum.
fn table(runs: &[Figures]) -> Table {
    let (mut numbers, mut texts): ([Vec<f64>; 7], [Vec<String>; 2]) = Default::default();
    for (index, run) in runs.iter().enumerate() {
        for (axis, spectrum) in &run.spectra {
            let Ok(spectrum) = spectrum else { continue };
            for line in &spectrum.lines {
                texts[0].push(run.conditions.direction.to_string());
                texts[1].push(name(*axis).to_owned());
                let row = [
                    index as f64,
                    run.conditions.load_nm,
                    run.conditions.speed_rpm,
                    f64::from(line.per_driver_turn),
                    line.order,
                    line.amplitude_rad,
                    line.phase_rad,
                ];
                numbers.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
            }
        }
    }
    let [run, load, speed, per_driver_turn, order, amplitude, phase] = numbers;
    let [direction, axis] = texts;
    Table {
        columns: vec![
            Column::numbers("run", run),
            Column::texts("direction", direction),
            Column::numbers("load_nm", load),
            Column::numbers("speed_rpm", speed),
            Column::texts("axis", axis),
            Column::numbers("per_driver_turn", per_driver_turn),
            Column::numbers("order", order),
            Column::numbers("amplitude_rad", amplitude),
            Column::numbers("phase_rad", phase),
        ],
    }
}

fn label(run: &Figures) -> String {
    format!("{} {} N·m {} rpm", run.conditions.direction, run.conditions.load_nm, run.conditions.speed_rpm)
}

/// A run's colour: its sense's, where no other run has that.
fn ink(runs: &[Figures], index: usize) -> Ink {
    let direction = runs[index].conditions.direction;
    if runs.iter().filter(|run| run.conditions.direction == direction).count() > 1 {
        return Ink::Numbered(index);
    }
    match direction {
        Direction::Ccw => Ink::Ccw,
        Direction::Cw => Ink::Cw,
    }
}

const URAD: f64 = 1e6;

fn chart(runs: &[Figures]) -> Chart {
    let curves = runs.iter().enumerate().map(|(index, run)| {
        let values = run.grid.centres().zip(&run.mean.values_rad);
        Series {
            name: format!("TE {}", label(run)),
            ink: ink(runs, index),
            mark: Mark::Line,
            points: values.map(|(theta, value)| (theta.to_degrees(), URAD * value)).collect(),
        }
    });
    let mut panels = vec![Panel::over_turn("Mean of the revolutions", "TE / µrad", curves.collect())];
    for (axis, title) in [
        (OrderAxis::Driver, "Orders of the input shaft"),
        (OrderAxis::Driven, "Orders of the output shaft"),
        (OrderAxis::Mesh, "Orders of the mesh"),
    ] {
        let series: Vec<Series> = runs
            .iter()
            .enumerate()
            .filter_map(|(index, run)| {
                let spectrum = run.spectra.iter().find(|(known, _)| *known == axis)?.1.as_ref().ok()?;
                Some(Series {
                    name: label(run),
                    ink: ink(runs, index),
                    mark: Mark::Stems,
                    points: spectrum.lines.iter().map(|line| (line.order, URAD * line.amplitude_rad)).collect(),
                })
            })
            .collect();
        if !series.is_empty() {
            panels.push(Panel {
                title: title.into(),
                x: Axis::Fitted(per(axis).into()),
                y_label: "amplitude / µrad".into(),
                scale: Scale::Logarithmic,
                series,
            });
        }
    }
    Chart { panels }
}

/// The synchronous averages of all runs, a row a bin.
///
/// # Errors
/// [`AnalyseError`] when the table cannot be written.
pub fn averages(path: &Path, runs: &[Run]) -> Result<Extra, AnalyseError> {
    let (mut run_of, mut direction, mut shaft_of) = (Vec::new(), Vec::new(), Vec::new());
    let (mut angle_rad, mut te_rad, mut revolutions) = (Vec::new(), Vec::new(), Vec::new());
    for (index, run) in runs.iter().enumerate() {
        for (shaft, te) in [("input", &run.over_driver), ("output", &run.over_driven)] {
            for (angle, value) in te.grid().centres().zip(te.mean_curve().values_rad) {
                run_of.push(index as f64);
                direction.push(te.conditions().direction.to_string());
                shaft_of.push(shaft.to_owned());
                angle_rad.push(angle);
                te_rad.push(value);
                revolutions.push(te.revolutions() as f64);
            }
        }
    }
    let table = Table {
        columns: vec![
            Column::numbers("run", run_of),
            Column::texts("direction", direction),
            Column::texts("shaft", shaft_of),
            Column::numbers("revolutions", revolutions),
            Column::numbers("angle_rad", angle_rad),
            Column::numbers("te_rad", te_rad),
        ],
    };
    let mut content = Vec::new();
    table.write_csv(&mut content).map_err(|source| OutputError::Csv {
        option: "--averages",
        path: path.into(),
        source,
    })?;
    Ok(Extra { option: "--averages", path: path.into(), content })
}
