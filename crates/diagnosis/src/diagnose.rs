//! From recordings to the answer: each step in its own file, here in order.

use gearmodel::recording::Recording;
use gearmodel::{Direction, NominalModel};
use rayon::prelude::*;

use super::diagnosis::Diagnosis;
use super::grid::Grid;
use super::line_errors;
use super::line_phase::LinePhase;
use super::nominal::Nominal;
use super::options::{GapError, Options};
use super::reduce::{ReducedRun, Reducer, Sample};
use super::report::report;
use super::runs::join;
use super::settings::Settings;
use super::solve::solve;
use super::taken_off::TakenOff;
use super::{interpolation, tones, transients};

/// Diagnoses recordings against a nominal model; recordings that reverse are split at their reversals, and all share one
/// clock.
///
/// # Errors
/// [`GapError`] when there is too little motion or an effect is named that does not exist.
pub fn diagnose(recordings: &[Recording<'_>], model: &NominalModel, options: &Options) -> Result<Diagnosis, GapError> {
    diagnose_with_nominal(recordings, model, options).map(|(diagnosis, _)| diagnosis)
}

/// [`diagnose`], with the nominal model that the residual was taken against.
///
/// # Errors
/// As for [`diagnose`].
pub fn diagnose_with_nominal(
    recordings: &[Recording<'_>],
    model: &NominalModel,
    options: &Options,
) -> Result<(Diagnosis, Nominal), GapError> {
    if recordings.is_empty() {
        return Err(GapError::NoRecording);
    }
    let settings = &options.settings;
    let lines = [0, 1].map(|encoder| {
        recordings
            .iter()
            .find_map(|r| if encoder == 0 { r.columns().input_lines } else { r.columns().output_lines })
            .map(|lines| lines as f64)
    });
    let quantum =
        recordings.iter().find_map(|r| interpolation::counts_per_rev(&r.columns().theta2_rad, &settings.lines));
    let mut nominal = Nominal::new(model.clone(), lines, quantum);
    let parts: Vec<Recording<'_>> = recordings.iter().flat_map(Recording::split).collect();
    let lines = interpolation::search_lines(&parts, &nominal, lines, &settings.lines);
    nominal.set_lines(lines);
    let reduced = parts.par_iter().map(|part| reduce(part, &nominal, settings)).collect();
    let diagnosis = diagnose_runs(&nominal, reduced, options)?;
    Ok((diagnosis, nominal))
}

/// A recording as points.
fn reduce(recording: &Recording<'_>, nominal: &Nominal, settings: &Settings) -> (ReducedRun, LinePhase) {
    let columns = recording.columns();
    let direction = columns.direction.unwrap_or(Direction::Ccw);
    let mut reducer = Reducer::new(nominal, direction, columns.speed_rpm.mean().abs(), settings);
    let load = columns.load_nm.mean();
    for n in 0..recording.samples() {
        reducer.push(Sample {
            time_s: columns.time_s[n],
            theta1_rad: columns.theta1_rad[n],
            theta2_rad: columns.theta2_rad[n],
            load_nm: columns.load_nm.at(n).unwrap_or(load),
        });
    }
    reducer.finish()
}

/// Diagnoses runs that were reduced before, as when they are read from a log sample by sample.
///
/// # Errors
/// As for [`diagnose`].
pub fn diagnose_runs(
    nominal: &Nominal,
    reduced: Vec<(ReducedRun, LinePhase)>,
    options: &Options,
) -> Result<Diagnosis, GapError> {
    options.check()?;
    let settings = &options.settings;
    let recordings = reduced.len();
    let mut lines: Option<LinePhase> = None;
    let mut runs = Vec::new();
    for (run, seen) in reduced {
        match &mut lines {
            Some(sum) => sum.merge(&seen),
            None => lines = Some(seen),
        }
        runs.push(run);
    }
    let mut runs = join(runs, &settings.reduction);
    nominal.take_off_effects(&mut runs, &settings.reduction);
    let points = runs.iter().map(|run| run.points.len()).sum();
    if points < settings.reduction.fewest_points {
        return Err(GapError::TooShort { recordings, points, needed: settings.reduction.fewest_points });
    }
    let lines = line_errors::take_off(&mut runs, lines.as_ref(), options);
    let mut grid = Grid::new(nominal.rig(), &runs, settings);
    let transients = transients::take_off(&grid, &mut runs, &settings.transients);
    if transients.is_some() {
        grid = Grid::new(nominal.rig(), &runs, settings);
    }
    let (tones, grid) = tones::take_off(nominal.rig(), &mut runs, grid, settings);
    let solution = solve(nominal.rig(), grid, TakenOff { lines, tones, transients }, options);
    report(&solution).ok_or(GapError::Singular)
}
