//! Sub-divisional errors of the encoders: found on the samples' line phase and taken off the points.

use super::line_phase::{LineError, LinePhase};
use super::options::Options;
use super::reduce::ReducedRun;
use gearmodel::effect::{Effect, LIBRARY, Shaft};

/// Number of the encoder within whose lines an effect lies.
pub(crate) fn encoder_of(effect: &dyn Effect) -> Option<usize> {
    effect.within_lines_of().map(|shaft| usize::from(shaft == Shaft::Output))
}

/// The effect that lies within an encoder's lines.
pub(crate) fn effect_of(encoder: usize) -> Option<&'static dyn Effect> {
    LIBRARY.iter().copied().find(|effect| encoder_of(*effect) == Some(encoder))
}

/// Finds sub-divisional errors and takes them off the points, so that they are no noise for the rest.
pub(crate) fn take_off(runs: &mut [ReducedRun], lines: Option<&LinePhase>, options: &Options) -> Vec<LineError> {
    let mut found: Vec<LineError> = Vec::new();
    if let Some(lines) = lines {
        // The strongest first, and each judged on what the others leave.
        let mut left = lines.clone();
        let open: Vec<(usize, usize)> = (0..2)
            .filter(|encoder| effect_of(*encoder).is_none_or(|effect| !options.excludes(effect)))
            .flat_map(|encoder| [1, 2].map(|order| (encoder, order)))
            .collect();
        while let Some(error) = open
            .iter()
            .filter(|(encoder, order)| !found.iter().any(|f| f.encoder == *encoder && f.order == *order))
            .filter_map(|(encoder, order)| left.pair(*encoder, *order))
            .max_by(|a, b| a.log_bayes_factor.total_cmp(&b.log_bayes_factor))
            .filter(|error| error.log_bayes_factor > options.settings.lines.taken_off_nats)
        {
            left.take_off(&error);
            found.push(error);
        }
    }
    let explained_rad2: f64 = found.iter().map(|error| error.explained_rad2).sum();
    let within_rad2: f64 = runs.iter().map(|run| run.within_rad2).sum();
    let samples: f64 = runs.iter().map(|run| run.samples).sum();
    let points: usize = runs.iter().map(|run| run.points.len()).sum();
    // That part of the samples' scatter which lies inside the segments goes there.
    let inside = if samples > 0.0 { 1.0 - points as f64 / samples } else { 0.0 };
    for run in runs {
        for point in &mut run.points {
            point.rho_rad -= found.iter().map(|error| error.te_rad(&point.lines)).sum::<f64>();
        }
        let share = if within_rad2 > 0.0 { run.within_rad2 / within_rad2 } else { 0.0 };
        run.within_rad2 = (run.within_rad2 - explained_rad2 * inside * share).max(0.0);
    }
    found
}
