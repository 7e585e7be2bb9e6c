//! `rigd model backlash`: predicted backlash over θ1.

use serde_json::json;

use super::curve::{Figures, points, rows};
use super::error::ModelError;
use super::method::{Method, Predictor};
use super::output::Report;
use super::question::{Asked, Question};
use super::table::{Column, Table};
use crate::chart::{Chart, Ink, Mark, Panel, Series};

/// Predicted backlash over θ1.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    question: Question,
}

/// Runs the command.
///
/// # Errors
/// [`ModelError`] says what is asked for in vain.
pub fn run(args: &Args) -> Result<(), ModelError> {
    let Asked { pair, load_nm, theta1_rad } = args.question.ask()?;
    let mut curves = Vec::new();
    for method in &args.question.method {
        let predictor = Predictor::new(&pair, *method, load_nm)?;
        let values_rad =
            theta1_rad.iter().map(|theta| predictor.backlash_rad(*theta)).collect::<Result<Vec<_>, _>>()?;
        curves.push((predictor.method(), values_rad));
    }
    let figures: Vec<Figures> = curves.iter().map(|(_, values_rad)| Figures::of(&theta1_rad, values_rad)).collect();

    let mut text = format!("{}\nbacklash at the driven shaft, TE cw − TE ccw, at {load_nm} N·m\n", pair.heading());
    for ((method, values_rad), figures) in curves.iter().zip(&figures) {
        text += &format!("\nbacklash, {}\n{}", method.name(), figures.text());
        if let Some(line) = along_the_pitch_curve(&pair.model.pair, &theta1_rad, values_rad) {
            text += &line;
        }
        if figures.min_rad < 0.0 && *method != Method::Published {
            text += "  negative: there the teeth bind; give backlash_mm or a larger centre distance\n";
        }
    }
    let name = |method: &Method| if curves.len() > 1 { format!("_{}", method.name()) } else { String::new() };
    let listed: Vec<_> = curves
        .iter()
        .map(|(method, values_rad)| (format!("backlash{}", name(method).replace('_', " ")), values_rad.as_slice()))
        .collect();
    text += &format!("\n{}", rows(&theta1_rad, &listed));

    let mut columns = vec![Column::numbers("theta1_rad", theta1_rad.clone())];
    columns.extend(
        curves.iter().map(|(method, values)| Column::numbers(format!("backlash{}_rad", name(method)), values.clone())),
    );
    let json = json!({
        "schema": "rigd.model.backlash/1",
        "pair": pair.json(),
        "load_nm": load_nm,
        "figures": curves.iter().zip(&figures).map(|((method, _), figures)| json!({
            "method": method.name(),
            "backlash": figures,
        })).collect::<Vec<_>>(),
    });
    let series = curves
        .iter()
        .enumerate()
        .map(|(index, (method, values_rad))| Series {
            name: if curves.len() > 1 { format!("backlash, {}", method.name()) } else { "backlash".into() },
            ink: if curves.len() > 1 { Ink::Numbered(index) } else { Ink::Backlash },
            mark: Mark::Line,
            points: points(&theta1_rad, values_rad),
        })
        .collect();
    let panel = Panel {
        x: args.question.sampling.into(),
        ..Panel::over_turn(format!("Backlash at the driven shaft, {load_nm} N·m"), "backlash / µrad", series)
    };
    let report = Report { text, json, table: Table { columns }, chart: Chart { panels: vec![panel] } };
    Ok(args.question.output.deliver(report, &[])?)
}

/// The same as a length, b·r2, where the pair has teeth.
fn along_the_pitch_curve(pair: &gearmodel::GearPair, theta1_rad: &[f64], values_rad: &[f64]) -> Option<String> {
    pair.has_teeth().then(|| {
        let (low, high) = theta1_rad
            .iter()
            .zip(values_rad)
            .map(|(theta, value)| value * pair.driven_radius(*theta))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), mm| (low.min(mm), high.max(mm)));
        format!("  at radius r2   {low:.4} to {high:.4} mm\n")
    })
}
