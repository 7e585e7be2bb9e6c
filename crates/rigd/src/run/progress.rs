//! The progress line on stderr: phase, revolutions, samples, live TE and losses. Quiet without a terminal.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::acquire::Acquisition;
use crate::present::angle;

/// Shortest time between two drawings.
const PERIOD: Duration = Duration::from_millis(80);

/// The progress line.
pub struct Progress {
    bar: ProgressBar,
    drawn: Option<Instant>,
    note: String,
}

impl Progress {
    /// A line for `total` revolutions; hidden when `quiet` or without a terminal.
    #[must_use]
    pub fn new(total_revolutions: f64, quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(
            Some((total_revolutions * 1000.0) as u64),
            if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() },
        );
        if let Ok(style) = ProgressStyle::with_template("{prefix:>9} [{bar:24}] {msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        Self { bar, drawn: None, note: String::new() }
    }

    /// Something to show before everything else: which run of how many, time left, a pause.
    pub fn note(&mut self, note: impl Into<String>) {
        self.note = note.into();
        self.drawn = None;
    }

    /// Prints a line above the progress line; without a terminal, on stderr.
    pub fn line(&self, text: &str) {
        if self.bar.is_hidden() {
            eprintln!("{text}");
        } else {
            self.bar.println(text);
        }
    }

    /// Draws the rig as it stands.
    pub fn show(&mut self, rig: &Acquisition, recorded_revolutions: f64) {
        if self.bar.is_hidden() || self.drawn.is_some_and(|drawn| drawn.elapsed() < PERIOD) {
            return;
        }
        self.drawn = Some(Instant::now());
        let phase = rig.status.phase.as_str_name();
        self.bar.set_prefix(phase.to_ascii_lowercase());
        self.bar.set_position((recorded_revolutions * 1000.0) as u64);
        let latest = &rig.latest;
        let te = if latest.te_range_rad[0] < latest.te_range_rad[1] {
            format!("TE {} p-p {}", angle(latest.te_rad), angle(latest.te_range_rad[1] - latest.te_range_rad[0]))
        } else {
            "TE -".to_owned()
        };
        let backlash = latest.backlash_rad.map_or(String::new(), |backlash| format!("  backlash {}", angle(backlash)));
        let direction = rig.status.direction.map_or(String::new(), |direction| direction.to_string());
        let note = if self.note.is_empty() { String::new() } else { format!("{}  ", self.note) };
        self.bar.set_message(format!(
            "{note}{direction} {recorded_revolutions:.2} rev  {:+.2} rpm  {:.1} N·m  {} samples  lost {}  {te}{backlash}",
            latest.speed_rpm,
            rig.status.load_nm,
            rig.samples(),
            rig.lost(),
        ));
    }

    /// Clears the line.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
