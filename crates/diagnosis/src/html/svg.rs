//! A small drawing board: SVG by coordinates in px; colours are classes, so that light, dark and print share one drawing.

use std::fmt::Write as _;

/// Text that may stand in HTML and in attributes.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// Where a text stands to its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The point is where it begins.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}

/// A drawing.
#[derive(Debug)]
pub struct Svg {
    width: f64,
    height: f64,
    body: String,
}

impl Svg {
    /// An empty drawing.
    #[must_use]
    pub fn new(width: f64, height: f64) -> Self {
        Self { width, height, body: String::new() }
    }

    /// A box; `tip` shows under the pointer.
    pub fn rect(&mut self, class: &str, [x, y]: [f64; 2], [w, h]: [f64; 2], tip: &str) {
        // Writing to a String cannot fail.
        let _ = write!(self.body, "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" ", w.max(0.0));
        let _ = write!(self.body, "height=\"{:.1}\"", h.max(0.0));
        if tip.is_empty() {
            self.body.push_str("/>");
        } else {
            let _ = write!(self.body, "><title>{}</title></rect>", escape(tip));
        }
    }

    /// A line.
    pub fn line(&mut self, class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        let _ =
            write!(self.body, "<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>");
    }

    /// A text.
    pub fn text(&mut self, class: &str, [x, y]: [f64; 2], anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = escape(text);
        let _ = write!(
            self.body,
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>"
        );
    }

    /// A line through points; one that is not finite breaks it.
    pub fn curve(&mut self, class: &str, points: impl Iterator<Item = [f64; 2]>) {
        let _ = write!(self.body, "<path class=\"{class}\" d=\"");
        let mut down = false;
        for [x, y] in points {
            if x.is_finite() && y.is_finite() {
                let _ = write!(self.body, "{}{x:.1} {y:.1}", if down { 'L' } else { 'M' });
            }
            down = x.is_finite() && y.is_finite();
        }
        self.body.push_str("\"/>");
    }

    /// A path as SVG writes it, with the width of its stroke.
    pub fn stroke(&mut self, class: &str, width: f64, path: &str) {
        let _ = write!(self.body, "<path class=\"{class}\" stroke-width=\"{width:.2}\" d=\"{path}\"/>");
    }

    /// The element; `label` is what a screen reader says.
    #[must_use]
    pub fn finish(self, label: &str) -> String {
        let Self { width, height, body } = self;
        format!(
            "<svg role=\"img\" aria-label=\"{}\" viewBox=\"0 0 {width:.0} {height:.0}\" \
             style=\"max-width:{width:.0}px\">{body}</svg>",
            escape(label)
        )
    }
}

/// A step of 1, 2 or 5 times a power of ten that divides `span` into about `count`.
#[must_use]
pub fn tick_step(span: f64, count: f64) -> f64 {
    let rough = span / count;
    if !(rough.is_finite() && rough > 0.0) {
        return 1.0;
    }
    let power = 10.0_f64.powf(rough.log10().floor());
    let lead = rough / power;
    power
        * match lead {
            l if l <= 1.0 => 1.0,
            l if l <= 2.0 => 2.0,
            l if l <= 5.0 => 5.0,
            _ => 10.0,
        }
}

/// A tick's value without needless zeros.
#[must_use]
pub fn tick_label(value: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') { "0".to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_a_text_stays_text() {
        let mut svg = Svg::new(10.0, 10.0);
        svg.text("a", [0.0, 0.0], Anchor::Start, "<script>\"&'");
        let text = svg.finish("<b>");
        assert!(!text.contains("<script>") && !text.contains("<b>"));
        assert!(text.contains("&lt;script&gt;&quot;&amp;&#39;"));
    }

    #[test]
    fn gaps_break_a_curve() {
        let mut svg = Svg::new(10.0, 10.0);
        svg.curve("c", [[0.0, 0.0], [1.0, 1.0], [2.0, f64::NAN], [3.0, 0.0]].into_iter());
        assert!(svg.finish("").contains("M0.0 0.0L1.0 1.0M3.0 0.0"));
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(tick_step(97.0, 4.0), 50.0);
        assert_eq!(tick_step(0.0, 4.0), 1.0);
        assert_eq!(tick_label(-0.0, 0.5), "0");
        assert_eq!(tick_label(1.5, 0.5), "1.5");
    }
}
