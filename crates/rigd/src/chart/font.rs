//! The font by which text is measured and, in pixels, drawn: DejaVu Sans, reduced to Latin, Greek and the signs of units.
//!
//! It comes with the program, so that pictures are the same on every computer and no font has to be installed.

use std::sync::Once;

use plotters::style::{FontStyle, register_font};

/// Its name in styles; an SVG viewer takes its own sans-serif.
pub const SANS: &str = "sans-serif";

const DEJAVU: &[u8] = include_bytes!("font/DejaVuSans-subset.ttf");

/// Makes the font known to plotters, once.
pub fn register() {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        // A font that is not accepted shows when text is measured, as an error of the drawing.
        let _ = register_font(SANS, FontStyle::Normal, DEJAVU);
    });
}
