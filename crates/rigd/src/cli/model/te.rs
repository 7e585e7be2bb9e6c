//! `rigd model te`: predicted transmission error over θ1.

use gearmodel::Direction;
use serde_json::json;

use super::curve::{Figures, points, rows};
use super::error::ModelError;
use super::method::{Method, Predictor};
use super::output::Report;
use super::question::{Asked, Question};
use super::table::{Column, Table};
use crate::chart::{Chart, Ink, Mark, Panel, Series};
use crate::run::senses::Senses;

/// Predicted transmission error over θ1.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    question: Question,
    /// Senses of the driver
    #[arg(long, value_enum, default_value = "both")]
    direction: Senses,
    /// Subtract the value at θ1 = 0; `published` keeps its printed start terms either way
    #[arg(long)]
    relative_to_start: bool,
}

struct Curve {
    method: Method,
    direction: Direction,
    values_rad: Vec<f64>,
    figures: Figures,
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
        for direction in args.direction.list() {
            let start_rad = match method {
                // Its start terms are part of the printed form.
                Method::Published => 0.0,
                _ if args.relative_to_start => predictor.te_rad(0.0, direction)?,
                _ => 0.0,
            };
            let mut values_rad = predictor.te_curve_rad(&theta1_rad, direction)?;
            values_rad.iter_mut().for_each(|te_rad| *te_rad -= start_rad);
            let figures = Figures::of(&theta1_rad, &values_rad);
            curves.push(Curve { method: *method, direction, values_rad, figures });
        }
    }

    let mut text = format!("{}\nTE at {load_nm} N·m, positive = driven gear ahead\n", pair.heading());
    for curve in &curves {
        text += &format!("\nTE {}, {}\n{}", curve.direction, curve.method.name(), curve.figures.text());
    }
    let listed: Vec<_> = curves
        .iter()
        .map(|curve| (name(curve, args.question.method.len(), " "), curve.values_rad.as_slice()))
        .collect();
    text += &format!("\n{}", rows(&theta1_rad, &listed));

    let mut columns = vec![
        Column::numbers("theta1_rad", theta1_rad.clone()),
        Column::numbers("theta2_nominal_rad", theta1_rad.iter().map(|theta| pair.model.pair.theta2(*theta)).collect()),
    ];
    columns.extend(curves.iter().map(|curve| {
        Column::numbers(format!("te_{}_rad", name(curve, args.question.method.len(), "_")), curve.values_rad.clone())
    }));
    let json = json!({
        "schema": "rigd.model.te/1",
        "pair": pair.json(),
        "load_nm": load_nm,
        "relative_to_start": args.relative_to_start,
        "figures": curves.iter().map(|curve| json!({
            "method": curve.method.name(),
            "direction": curve.direction.as_str(),
            "te": curve.figures,
        })).collect::<Vec<_>>(),
    });
    let series = curves
        .iter()
        .enumerate()
        .map(|(index, curve)| Series {
            name: format!("TE {}", name(curve, args.question.method.len(), ", ")),
            ink: ink(curve.direction, args.question.method.len(), index),
            mark: Mark::Line,
            points: points(&theta1_rad, &curve.values_rad),
        })
        .collect();
    let panel = Panel {
        x: args.question.sampling.into(),
        ..Panel::over_turn(format!("Transmission error at {load_nm} N·m"), "TE / µrad", series)
    };
    let report = Report { text, json, table: Table { columns }, chart: Chart { panels: vec![panel] } };
    Ok(args.question.output.deliver(report, &[])?)
}

/// The sense, and the method where there are several.
fn name(curve: &Curve, methods: usize, between: &str) -> String {
    if methods > 1 {
        format!("{}{between}{}", curve.direction, curve.method.name())
    } else {
        curve.direction.to_string()
    }
}

fn ink(direction: Direction, methods: usize, index: usize) -> Ink {
    match direction {
        _ if methods > 1 => Ink::Numbered(index),
        Direction::Ccw => Ink::Ccw,
        Direction::Cw => Ink::Cw,
    }
}
