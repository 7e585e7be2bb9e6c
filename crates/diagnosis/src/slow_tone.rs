//! A tone slower than a few turns: a mount that swings with the room's temperature, a pump. Within a revolution it is a ramp, between
//! revolutions scatter; over the campaign's clock it is a line.

use std::f64::consts::TAU;

use super::grid::Grid;
use super::nuisance_patterns::Pattern;
use super::sectors::Sector;
use super::settings::RunningOnSettings;

/// The slow tone that takes most off the sectors of a residual, if any could be seen.
#[must_use]
pub(super) fn strongest(grid: &Grid, sectors: &[Sector], settings: &RunningOnSettings) -> Option<Pattern> {
    let duration_s = grid.plan.duration_s;
    let turn_hz = grid.plan.speeds_rad_per_s.last()? / TAU;
    if sectors.len() < settings.tone_sectors || duration_s <= 0.0 {
        return None;
    }
    let best = |low_hz: f64, high_hz: f64, step_hz: f64| {
        let steps = ((high_hz - low_hz) / step_hz).ceil().max(0.0) as usize;
        (0..=steps)
            .map(|n| low_hz + n as f64 * step_hz)
            .map(|frequency_hz| (frequency_hz, explained(sectors, frequency_hz)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let unit_hz = 1.0 / duration_s;
    let (coarse_hz, _) =
        best(settings.tone_cycles * unit_hz, settings.tone_turns * turn_hz, settings.tone_step * unit_hz)?;
    let (frequency_hz, _) = best(
        coarse_hz - settings.tone_step * unit_hz,
        coarse_hz + settings.tone_step * unit_hz,
        settings.tone_fine_step * unit_hz,
    )?;
    Some(Pattern::Tone { frequency_hz })
}

/// Weighted square that a tone and a constant take off more than the constant alone.
fn explained(sectors: &[Sector], frequency_hz: f64) -> f64 {
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for sector in sectors {
        let (sin, cos) = (TAU * frequency_hz * sector.middle_s).sin_cos();
        let x = nalgebra::Vector3::new(1.0, sin, cos);
        normal += x * x.transpose() / sector.variance_rad2;
        right += x * (sector.mean_rad / sector.variance_rad2);
    }
    normal.try_inverse().map_or(0.0, |inverse| right.dot(&(inverse * right)))
}
