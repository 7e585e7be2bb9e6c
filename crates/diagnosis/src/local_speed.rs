//! The driver's speed at every point of a run: what it did there, not what was set.

use super::reduce::{Point, ReducedRun};
use super::settings::ReductionSettings;

/// From a run's first point to its last, signed, rad/s; 0 of a single point.
pub(super) fn mean_speed(run: &ReducedRun) -> f64 {
    let (Some(first), Some(last)) = (run.points.first(), run.points.last()) else { return 0.0 };
    (last.theta1_rad - first.theta1_rad) / (last.time_s - first.time_s).max(1e-9)
}

/// Speed at every point over a little of the turn about it, signed, rad/s; the mean where that says nothing.
pub(super) fn local_speeds(points: &[Point], mean: f64, settings: &ReductionSettings) -> Vec<f64> {
    let half = settings.speed_window_rad;
    let (mut low, mut high) = (0, 0);
    points
        .iter()
        .map(|point| {
            while (points[low].theta1_rad - point.theta1_rad).abs() > half && low + 1 < points.len() {
                low += 1;
            }
            while high + 1 < points.len() && (points[high].theta1_rad - point.theta1_rad).abs() < half {
                high += 1;
            }
            let span_s = points[high].time_s - points[low].time_s;
            let speed = (points[high].theta1_rad - points[low].theta1_rad) / span_s;
            // A pause or a gap inside the window says nothing about the speed.
            let says = span_s > 0.0 && speed.is_finite() && speed * mean > 0.0;
            if says && (speed / mean - 1.0).abs() < settings.speed_off { speed } else { mean }
        })
        .collect()
}
