//! What was taken off the points before anything was fitted.

use super::line_phase::LineError;
use super::settings::TransientSettings;
use super::tones::Tone;
use super::transients::Transients;

/// What was taken off the points before anything was fitted.
pub(crate) struct TakenOff {
    /// Sub-divisional errors of the encoders.
    pub(crate) lines: Vec<LineError>,
    /// Tones in time.
    pub(crate) tones: Vec<Tone>,
    /// Knocks and lost readings.
    pub(crate) transients: Option<Transients>,
}

impl TakenOff {
    /// Mean square of the tones, rad².
    pub(crate) fn tones_rad2(&self) -> f64 {
        self.tones.iter().map(|tone| 0.5 * tone.amplitude_rad * tone.amplitude_rad).sum()
    }

    /// Mean square of the sub-divisional errors over so many samples, rad².
    pub(crate) fn lines_rad2(&self, samples: f64) -> f64 {
        self.lines.iter().map(|line| line.explained_rad2).sum::<f64>() / samples
    }

    /// Mean square of tones and transients, rad².
    pub(crate) fn events_rad2(&self) -> f64 {
        self.tones_rad2() + self.transients.map_or(0.0, |transients| transients.mean_square_rad2)
    }

    /// RMS below which nothing is told from the tails of the knocks, rad.
    pub(crate) fn least_rad(&self, settings: &TransientSettings) -> f64 {
        self.transients.map_or(0.0, |transients| settings.tails * transients.mean_square_rad2.sqrt())
    }

    /// True where nothing was taken off.
    pub(crate) fn is_empty(&self) -> bool {
        self.lines.is_empty() && self.tones.is_empty() && self.transients.is_none()
    }
}
