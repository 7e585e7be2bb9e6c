//! Charts: panels of curves over an angle or any other axis, as SVG, PNG or a page that shows values under the pointer.
//!
//! What is drawn is plain data here; `render` draws it on any backend of plotters, `html` adds the pointer.

mod font;
mod html;
mod png;
mod render;

use std::path::Path;

use plotters::style::{Color as _, RGBAColor, RGBColor};
use thiserror::Error;

/// A picture: panels below each other.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// The panels, from the top.
    pub panels: Vec<Panel>,
}

/// One pair of axes.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Above the axes.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Quantity and unit of the vertical axis.
    pub y_label: String,
    /// How the axes are divided.
    pub scale: Scale,
    /// The curves, later ones above earlier ones.
    pub series: Vec<Series>,
}

/// A horizontal axis.
#[derive(Debug, Clone, PartialEq)]
pub enum Axis {
    /// θ1 over one turn, in degrees.
    Turn,
    /// As far as the points reach; quantity and unit.
    Fitted(String),
}

/// How the axes of a panel are divided.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scale {
    /// Each by itself.
    #[default]
    Free,
    /// A unit is as long on both, as a drawing needs it.
    Equal,
    /// The vertical one by powers of ten; points at or below 0 are left out.
    Logarithmic,
}

/// A curve or a cloud of points.
#[derive(Debug, Clone)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Colour.
    pub ink: Ink,
    /// How points are drawn.
    pub mark: Mark,
    /// Points in the axes' units; a value that is not finite is left out.
    pub points: Vec<(f64, f64)>,
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A line through all points.
    Line,
    /// Open rings at every n-th point, that can be told from a line through them.
    Rings(usize),
    /// Small dots.
    Dots,
    /// Vertical lines from the axis up to the points.
    Stems,
}

/// What a colour stands for, the same in every picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ink {
    /// Driving ccw.
    Ccw,
    /// Driving cw.
    Cw,
    /// Backlash.
    Backlash,
    /// A prediction beside a measurement.
    Predicted,
    /// One of several of a kind.
    Numbered(usize),
}

const CCW: RGBColor = RGBColor(0, 90, 160);
const CW: RGBColor = RGBColor(190, 70, 0);
const BACKLASH: RGBColor = RGBColor(40, 120, 60);
const PREDICTED: RGBColor = RGBColor(0, 0, 0);
/// Told apart by people who see few colours, too (Okabe and Ito 2008).
const NUMBERED: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
];

impl Ink {
    fn colour(self) -> RGBAColor {
        match self {
            Self::Ccw => CCW.to_rgba(),
            Self::Cw => CW.to_rgba(),
            Self::Backlash => BACKLASH.to_rgba(),
            Self::Predicted => PREDICTED.mix(0.7),
            Self::Numbered(n) => NUMBERED[n % NUMBERED.len()].to_rgba(),
        }
    }
}

impl Panel {
    /// A panel over one turn of θ1.
    #[must_use]
    pub fn over_turn(title: impl Into<String>, y_label: impl Into<String>, series: Vec<Series>) -> Self {
        Self { title: title.into(), x: Axis::Turn, y_label: y_label.into(), scale: Scale::Free, series }
    }
}

/// What a chart is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Scalable Vector Graphics.
    Svg,
    /// Pixels.
    Png,
    /// A page with the SVG in it and values under the pointer; needs nothing else.
    Html,
}

impl Format {
    /// The format that a file's name asks for; `-` is SVG.
    ///
    /// # Errors
    /// [`ChartError::Format`] lists those that there are.
    pub fn of(path: &Path) -> Result<Self, ChartError> {
        if path == Path::new("-") {
            return Ok(Self::Svg);
        }
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "svg" => Ok(Self::Svg),
            "png" => Ok(Self::Png),
            "html" | "htm" => Ok(Self::Html),
            _ => Err(ChartError::Format { extension: extension.to_owned() }),
        }
    }
}

/// Why there is no picture.
#[derive(Debug, Error)]
pub enum ChartError {
    /// The file's name asks for a format that is not made.
    #[error("a picture of the form '{extension}' cannot be made; name it .svg, .png or .html")]
    Format {
        /// The name's extension.
        extension: String,
    },
    /// Drawing failed.
    #[error("the picture could not be drawn: {0}")]
    Draw(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// Packing the pixels failed.
    #[error("the pixels could not be packed: {0}")]
    Png(#[from] ::png::EncodingError),
}

impl Chart {
    /// The picture in a format.
    ///
    /// # Errors
    /// [`ChartError`] when it cannot be drawn.
    pub fn encode(&self, format: Format) -> Result<Vec<u8>, ChartError> {
        match format {
            Format::Svg => Ok(self.svg()?.into_bytes()),
            Format::Png => png::encode(self),
            Format::Html => Ok(html::page(self)?.into_bytes()),
        }
    }

    /// The picture as SVG.
    ///
    /// # Errors
    /// [`ChartError`] when it cannot be drawn.
    pub fn svg(&self) -> Result<String, ChartError> {
        Ok(render::svg(self)?.0)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn chart() -> Chart {
        let points = (0..=360).map(|n| (f64::from(n), (TAU * f64::from(n) / 360.0).sin())).collect();
        let gap = vec![(0.0, f64::NAN), (90.0, 0.5)];
        Chart {
            panels: vec![
                Panel::over_turn(
                    "A <sine> & more",
                    "TE / µrad",
                    vec![
                        Series { name: "TE ccw".into(), ink: Ink::Ccw, mark: Mark::Line, points },
                        Series { name: "one".into(), ink: Ink::Cw, mark: Mark::Rings(1), points: gap },
                    ],
                ),
                Panel::over_turn("nothing", "b", Vec::new()),
            ],
        }
    }

    #[test]
    fn every_format_begins_as_it_must() {
        let chart = chart();
        let svg = chart.svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("A &lt;sine&gt; &amp; more") && !svg.contains("NaN"));
        assert!(chart.encode(Format::Png).unwrap().starts_with(b"\x89PNG\r\n\x1a\n"));
        let page = String::from_utf8(chart.encode(Format::Html).unwrap()).unwrap();
        assert!(page.starts_with("<!DOCTYPE html>") && page.contains("TE ccw"));
        assert!(!page.contains("http://") || !page.contains("src="), "the page needs nothing else");
    }

    #[test]
    fn powers_of_ten_have_no_place_for_zero() {
        let points = vec![(1.0, 1000.0), (2.0, 0.0), (3.0, 0.01), (4.0, -1.0)];
        let series = Series { name: "orders".into(), ink: Ink::Ccw, mark: Mark::Stems, points };
        let panel = Panel {
            x: Axis::Fitted("order".into()),
            scale: Scale::Logarithmic,
            ..Panel::over_turn("Orders", "amplitude / µrad", vec![series])
        };
        let chart = Chart { panels: vec![panel] };
        let page = String::from_utf8(chart.encode(Format::Html).unwrap()).unwrap();
        assert!(page.contains("\"log\":true") && page.contains("[[1.0,1000.0],[3.0,0.01]]"), "{page}");
        let svg = chart.svg().unwrap();
        assert!(svg.contains(">\n1000\n<") && svg.contains(">\n0.01\n<"), "{svg}");
        // Two stems and what the legend shows of them.
        assert_eq!(svg.matches("#005AA0").count(), 3, "{svg}");
    }

    #[test]
    fn a_drawing_counts_in_parts_of_a_pixel_and_keeps_its_size() {
        let svg = chart().svg().unwrap();
        assert!(svg.starts_with("<svg width=\"960\" height=\"640\" viewBox=\"0 0 9600 6400\""), "{}", &svg[..80]);
        assert!(svg.contains(">\n360\n<"), "the full turn has its label");
    }

    #[test]
    fn names_ask_for_formats() {
        assert_eq!(Format::of(Path::new("a.PNG")).unwrap(), Format::Png);
        assert_eq!(Format::of(Path::new("-")).unwrap(), Format::Svg);
        let said = Format::of(Path::new("a.jpeg")).unwrap_err().to_string();
        assert!(said.contains("jpeg") && said.contains(".svg"), "{said}");
    }
}
