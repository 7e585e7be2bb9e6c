//! How far a long computation is, on a terminal's stderr; quiet elsewhere.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar that any thread may move.
pub struct Progress(ProgressBar);

/// Redraws a second: more would cost the computation.
const REDRAWS_HZ: u8 = 4;

impl Progress {
    /// A bar of `total` steps.
    #[must_use]
    pub fn new(total: usize, what: &'static str) -> Self {
        // Without a terminal indicatif draws nothing.
        let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr_with_hz(REDRAWS_HZ));
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}") {
            bar.set_style(style);
        }
        bar.set_message(what);
        Self(bar)
    }

    /// `done` steps are finished.
    pub fn at(&self, done: usize) {
        self.0.set_position(done as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
