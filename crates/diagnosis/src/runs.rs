//! Recordings → runs: in order of time, what was cut in two joined again.

use super::reduce::ReducedRun;
use super::settings::ReductionSettings;

/// Sorts by time and joins what is one run in two pieces.
pub(crate) fn join(mut runs: Vec<ReducedRun>, settings: &ReductionSettings) -> Vec<ReducedRun> {
    runs.retain(|run| !run.points.is_empty());
    runs.sort_by(|a, b| a.points[0].time_s.total_cmp(&b.points[0].time_s));
    let mut joined: Vec<ReducedRun> = Vec::new();
    for run in runs {
        let first = run.points[0];
        if let Some(before) = joined.last_mut() {
            let last = before.points[before.points.len() - 1];
            let step = (first.theta1_rad - last.theta1_rad) * run.direction.sign();
            let same = before.direction == run.direction
                && before.speed_rpm == run.speed_rpm
                && (first.load_nm - last.load_nm).abs() <= settings.same_level * first.load_nm.abs().max(1e-9);
            // As far apart as neighbouring points of the run are, in angle and in time.
            let speed = (last.theta1_rad - before.points[0].theta1_rad).abs()
                / (last.time_s - before.points[0].time_s).max(1e-9);
            let pause_s = first.time_s - last.time_s;
            if same && (0.0..settings.joined_step_rad).contains(&step) && pause_s * speed < settings.joined_pause_rad {
                before.points.extend(run.points);
                before.within_rad2 += run.within_rad2;
                before.samples += run.samples;
                continue;
            }
        }
        joined.push(run);
    }
    joined
}
