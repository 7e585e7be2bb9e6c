//! `rigd model tolerance`: what scatter of the errors does to TE and backlash of made pairs.

use gearmodel::sensitivity::Parameter;
use gearmodel::tolerance::{Scatter, ToleranceFigure, ToleranceStudy};
use serde_json::json;

use super::error::{ModelError, check_count};
use super::output::{Extra, Output, Report};
use super::parameter::width;
use super::progress::Progress;
use super::source::Source;
use super::table::{Column, Table};
use crate::chart::{Axis, Chart, Ink, Mark, Panel, Scale, Series};
use crate::present::{angle, arcsec};
use crate::quantity::TORQUE;

/// What scatter of the errors does to TE and backlash of made pairs.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    /// A parameter that scatters normally: KEY=STANDARD DEVIATION, as `e1_mm=0.01`; may be repeated
    #[arg(long, value_name = "KEY=SIGMA", value_parser = width)]
    sigma: Vec<(Parameter, f64)>,
    /// A parameter that scatters uniformly within ± WIDTH, as `phi1_rad=3.1416`; may be repeated
    #[arg(long, value_name = "KEY=WIDTH", value_parser = width)]
    uniform: Vec<(Parameter, f64)>,
    /// Pairs to draw
    #[arg(long, default_value_t = 100_000, value_name = "N")]
    pairs: u32,
    /// Seed of the draws: the same seed gives the same pairs on any number of cores
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Torque on the driven shaft, as `10Nm`
    #[arg(long, default_value = "0Nm")]
    load: String,
    /// Angles a turn
    #[arg(long, default_value_t = 720, value_name = "N")]
    points: u32,
    /// Quantiles, percent, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "5,50,95,99", value_parser = percent)]
    quantiles: Vec<f64>,
    /// Write the figures of every drawn pair as CSV (`-` is stdout)
    #[arg(long, value_name = "FILE")]
    draws: Option<std::path::PathBuf>,
    #[command(flatten)]
    output: Output,
}

fn percent(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if (0.0..=100.0).contains(&value) => Ok(value),
        _ => Err(format!("'{text}' is no quantile; write percent between 0 and 100, for instance 5,50,95")),
    }
}

/// Runs the command.
///
/// # Errors
/// [`ModelError`] says what cannot scatter, or what is out of range.
pub fn run(args: &Args) -> Result<(), ModelError> {
    args.output.check(&[("--draws", args.draws.as_deref())])?;
    let load_nm = TORQUE.parse(&args.load)?;
    let pairs = check_count("--pairs", args.pairs.into(), (2, 2_000_000))? as usize;
    let angles = check_count("--points", args.points.into(), (8, 100_000))? as usize;
    let loaded = args.source.load()?;
    let normal = args.sigma.iter().map(|(parameter, sigma)| (*parameter, Scatter::Normal(*sigma)));
    let uniform = args.uniform.iter().map(|(parameter, width)| (*parameter, Scatter::Uniform(*width)));
    let scatter: Vec<_> = normal.chain(uniform).collect();
    if scatter.is_empty() {
        return Err(ModelError::NothingScatters);
    }
    let study = ToleranceStudy { scatter, load_nm, pairs, angles, seed: args.seed };
    let progress = Progress::new(pairs, "pairs");
    let figures = study.run(&loaded.model, &|done| progress.at(done))?;
    drop(progress);

    let quantile = |figure: &ToleranceFigure, percent: f64| figure.quantile_rad(percent / 100.0);
    let mut text = format!("{}\n{pairs} pairs at {load_nm} N·m, seed {}\n", loaded.heading(), args.seed);
    for figure in &figures {
        text += &format!(
            "\n{}\n  mean  {}   standard deviation {:.2}\"\n",
            figure.name.trim_end_matches("_rad"),
            angle(figure.mean_rad),
            arcsec(figure.std_rad)
        );
        for percent in &args.quantiles {
            text += &format!("  {percent:>4} % below  {}\n", angle(quantile(figure, *percent)));
        }
        let shares: Vec<_> = figure
            .shares
            .iter()
            .map(|(parameter, share)| format!("{} {:.1} %", parameter.name(), share * 100.0))
            .collect();
        text += &format!("  share of the variance  {}\n", shares.join(", "));
    }
    let json = json!({
        "schema": "rigd.model.tolerance/1",
        "pair": loaded.json(),
        "load_nm": load_nm,
        "pairs": pairs,
        "seed": args.seed,
        "scatter": study.scatter.iter().map(|(parameter, scatter)| match scatter {
            Scatter::Normal(sigma) => json!({"parameter": parameter.name(), "sigma": sigma}),
            Scatter::Uniform(width) => json!({"parameter": parameter.name(), "half_width": width}),
        }).collect::<Vec<_>>(),
    });
    let mut columns = vec![
        Column::texts("figure", figures.iter().map(|figure| figure.name.to_owned()).collect()),
        Column::numbers("mean_rad", figures.iter().map(|figure| figure.mean_rad).collect()),
        Column::numbers("std_rad", figures.iter().map(|figure| figure.std_rad).collect()),
    ];
    for percent in &args.quantiles {
        let values = figures.iter().map(|figure| quantile(figure, *percent)).collect();
        columns.push(Column::numbers(format!("q{percent}_rad"), values));
    }
    for (parameter, _) in &study.scatter {
        let share = |figure: &ToleranceFigure| {
            figure.shares.iter().find(|(other, _)| other == parameter).map_or(f64::NAN, |(_, share)| *share)
        };
        columns.push(Column::numbers(format!("share_{}", parameter.name()), figures.iter().map(share).collect()));
    }
    let extras = draws(args, &figures)?;
    let report = Report { text, json, table: Table { columns }, chart: chart(&figures) };
    Ok(args.output.deliver(report, &extras)?)
}

/// The file of `--draws`.
fn draws(args: &Args, figures: &[ToleranceFigure]) -> Result<Vec<Extra>, ModelError> {
    let Some(path) = &args.draws else { return Ok(Vec::new()) };
    let columns = figures.iter().map(|figure| Column::numbers(figure.name, figure.values_rad.clone())).collect();
    let mut content = Vec::new();
    Table { columns }.write_csv(&mut content).map_err(|source| super::error::OutputError::Csv {
        option: "--draws",
        path: path.clone(),
        source,
    })?;
    Ok(vec![Extra { option: "--draws", path: path.clone(), content }])
}

/// Share of the pairs below a value, by figure.
fn chart(figures: &[ToleranceFigure]) -> Chart {
    const STEPS: u32 = 400;
    let series = figures
        .iter()
        .enumerate()
        .map(|(index, figure)| Series {
            name: figure.name.trim_end_matches("_rad").to_owned(),
            ink: Ink::Numbered(index),
            mark: Mark::Line,
            points: (0..=STEPS)
                .map(|n| f64::from(n) / f64::from(STEPS))
                .map(|share| (figure.quantile_rad(share) * 1e6, share * 100.0))
                .collect(),
        })
        .collect();
    let panel = Panel {
        title: "Share of the pairs that stay below".into(),
        x: Axis::Fitted("figure / µrad".into()),
        y_label: "pairs / %".into(),
        scale: Scale::Free,
        series,
    };
    Chart { panels: vec![panel] }
}
