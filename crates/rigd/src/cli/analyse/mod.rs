//! `rigd analyse`: the measured side of logs beyond the summary: order spectra of both shafts and the mesh, long and short
//! waves, synchronous averages, and the floor with its interval.

mod figures;
mod forms;

use std::ops::ControlFlow;
use std::path::PathBuf;

use gearmodel::NominalModel;
use gearmodel::measure::{AngleGrid, MeasureError, OrderAxis, RunConditions, RunTe};
use riglog::{LogError, LogParts, RunSpan, RunStream, RunTotals, RunVisitor, SampleBlock};
use thiserror::Error;

use super::model::error::OutputError;
use super::model::output::Output;
use super::recorded::Recorded;
use super::{Exit, fail};
use crate::replay::{ReplayError, model_for};
use figures::{Figures, Split};

/// Order spectra, long and short waves, averages and noise floor of logs.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    recorded: Recorded,
    /// Angle bins a turn
    #[arg(long, value_name = "N", default_value_t = 720)]
    bins: usize,
    /// Highest line of a spectrum, periods a turn of the driver [default: 180, or what the bins resolve]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    highest: Option<u32>,
    /// How many of the largest lines of each spectrum the text names
    #[arg(long, value_name = "N", default_value_t = 6)]
    top: usize,
    /// Cut-off between long and short waves: `input`, `output` or `mesh`, and the order at which half passes [default:
    /// mesh:0.5; input:10 for a pair without teeth]
    #[arg(long, value_name = "AXIS:ORDER", value_parser = split)]
    split: Option<Split>,
    /// Write the synchronous averages over both shafts' angles as CSV (`-` is stdout)
    #[arg(long, value_name = "FILE")]
    averages: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

fn split(text: &str) -> Result<Split, String> {
    let form = "write AXIS:ORDER, as mesh:0.5 or input:10, with the axes input, output, mesh";
    let (axis, order) = text.split_once(':').ok_or(form)?;
    let axis = figures::AXES.iter().find(|(_, name)| *name == axis).ok_or(form)?.0;
    match order.parse::<f64>() {
        Ok(cut_off_order) if cut_off_order.is_finite() && cut_off_order > 0.0 => Ok(Split { axis, cut_off_order }),
        _ => Err(format!("'{order}' is no order > 0; {form}")),
    }
}

/// Why logs are not analysed.
#[derive(Debug, Error)]
enum AnalyseError {
    #[error(transparent)]
    Replay(#[from] ReplayError),
    #[error(transparent)]
    Log(#[from] LogError),
    #[error("--bins: {0}")]
    Bins(#[from] MeasureError),
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    match run(args) {
        Ok(exit) => exit,
        Err(AnalyseError::Output(error)) => fail(error.exit(), &error),
        Err(error) => fail(Exit::BadInput, &error),
    }
}

/// A run over the angles of both shafts.
pub struct Run {
    /// Bins of θ1.
    pub over_driver: RunTe,
    /// Bins of θ2.
    pub over_driven: RunTe,
    /// Samples that are missing.
    pub losses: u64,
}

struct Collector<'a> {
    model: &'a NominalModel,
    grid: AngleGrid,
    runs: Vec<Run>,
}

impl RunVisitor for Collector<'_> {
    fn run_start(&mut self, _: usize, span: &RunSpan) -> ControlFlow<()> {
        let RunSpan { direction, load_nm, speed_rpm, .. } = *span;
        let empty = RunTe::new(self.grid, RunConditions { direction, load_nm, speed_rpm });
        self.runs.push(Run { over_driver: empty.clone(), over_driven: empty, losses: 0 });
        ControlFlow::Continue(())
    }

    fn samples(&mut self, _: usize, block: &SampleBlock<'_>) -> ControlFlow<()> {
        if let Some(run) = self.runs.last_mut() {
            for (theta1, theta2) in block.theta1_rad.iter().zip(block.theta2_rad) {
                run.over_driver.push(&self.model.pair, *theta1, *theta2);
                run.over_driven.push_over_driven(&self.model.pair, *theta1, *theta2);
            }
        }
        ControlFlow::Continue(())
    }

    fn run_end(&mut self, _: usize, _: &RunSpan, totals: &RunTotals) -> ControlFlow<()> {
        if let Some(run) = self.runs.last_mut() {
            run.losses = totals.losses;
        }
        ControlFlow::Continue(())
    }
}

fn run(args: &Args) -> Result<Exit, AnalyseError> {
    args.output.check(&[("--averages", args.averages.as_deref())])?;
    let grid = AngleGrid::new(args.bins)?;
    let (model, _) = model_for(&args.recorded.logs[0], args.recorded.pair.as_deref())?;
    let mut collector = Collector { model: &model, grid, runs: Vec::new() };
    let mut incomplete = Vec::new();
    for log in LogParts::group(&args.recorded.logs)? {
        let path = log.first().to_owned();
        let totals = RunStream::open_parts(log)?.stream(&mut collector)?;
        if totals.losses_in_file > 0 {
            incomplete.push(format!("{}: {} samples are missing", path.display(), totals.losses_in_file));
        }
        if !totals.completeness.is_complete() {
            incomplete.push(format!("{}: {}", path.display(), totals.completeness));
        }
    }
    if collector.runs.is_empty() {
        incomplete.push("no recorded run: an analysis needs a stretch of phase RECORD".into());
    }
    let split = args.split.unwrap_or(if model.pair.has_teeth() {
        Split { axis: OrderAxis::Mesh, cut_off_order: 0.5 }
    } else {
        Split { axis: OrderAxis::Driver, cut_off_order: 10.0 }
    });
    let figures: Vec<Figures> =
        collector.runs.iter().map(|run| Figures::of(run, &model, args.highest, split)).collect();
    let logs: Vec<String> = args.recorded.logs.iter().map(|path| path.display().to_string()).collect();
    let report = forms::report(&logs, &figures, args.top, &incomplete);
    let extras = match &args.averages {
        Some(path) => vec![forms::averages(path, &collector.runs)?],
        None => Vec::new(),
    };
    args.output.deliver(report, &extras)?;
    for line in &incomplete {
        eprintln!("warning: {line}");
    }
    Ok(if incomplete.is_empty() { Exit::Done } else { Exit::Incomplete })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_off_is_an_axis_and_an_order() {
        assert_eq!(split("mesh:0.3"), Ok(Split { axis: OrderAxis::Mesh, cut_off_order: 0.3 }));
        assert_eq!(split("output:4"), Ok(Split { axis: OrderAxis::Driven, cut_off_order: 4.0 }));
        for wrong in ["mesh", "tooth:1", "mesh:0", "mesh:-1", "mesh:nan", "mesh:"] {
            assert!(split(wrong).is_err_and(|said| said.contains("AXIS:ORDER")), "{wrong}");
        }
    }
}
